#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "torsio/actuator/data_sheet.hpp"
#include "torsio/actuator/wear.hpp"
#include "torsio/core/progress.hpp"
#include "torsio/data/dataset.hpp"
#include "torsio/data/recording.hpp"
#include "torsio/sim/faults/fault_schedule.hpp"

namespace torsio {

/// One bench run: actuator, experiment, and the seed of the noise.
struct ExperimentSpec {
  std::string actuator = "dfki-50";  ///< as `data_sheet` takes it
  std::string experiment = "sweep";
  std::uint64_t seed = 1;
  std::optional<double> duration_s = {};  ///< none: that of the experiment's protocol
  std::optional<double> lever_m = {};     ///< none: the first of `sweep_protocol`, or locked
  std::optional<double> mass_kg = {};  ///< on the lever; none: 9 kg, or what the experiment states
  double inclination_rad = 0.0;        ///< angle of the lever's plane of motion from the vertical
  // Excitation; an experiment has one of the amplitudes (`ExperimentInfo::amplitude_unit`); none:
  // its default.
  std::optional<double> torque_amplitude_Nm = {};
  std::optional<double> angle_amplitude_rad = {};
  std::optional<double> frequency_Hz = {};
  // Ends of the band of an experiment in the air; none: 0.1 and 8 Hz.
  std::optional<double> lowest_frequency_Hz = {};
  std::optional<double> highest_frequency_Hz = {};
  bool is_impedance_zero = false;  ///< impedance of the joint's controller is zero; false: high
  /// The motor has windings, an inverter and field-oriented current control (`ElectricalSheet`)
  /// instead of a lag; phase currents, supply current and stator temperature are logged as well.
  bool is_electrical = false;
  bool with_truth = false;  ///< add the `truth_*` channels, which no sensor measures
  OperatingConditions conditions = {};
  FaultSchedule faults = {};
};

struct ExperimentInfo {
  std::string_view name;
  std::string_view actuators;  ///< actuators that have it
  std::string_view description;
  std::string_view amplitude_unit = {};  ///< "Nm", "rad", or empty: no amplitude
};

/// The experiments of all benches. A name may be listed for more than one family.
[[nodiscard]] std::vector<ExperimentInfo> experiments();
/// The experiments of one actuator.
[[nodiscard]] std::vector<ExperimentInfo> experiments(const DataSheet& sheet);

/// The sweeps of one actuator: the lever with its 9 kg mass moves back and forth between
/// +-amplitude (specification 4.7). Levers of dfki-28, for which it has none, are ours: its
/// torques reach the shares of the rating that those of the others do (0.2 to 0.55).
struct SweepProtocol {
  double amplitude_rad = 0.0;
  std::array<double, 3> train_lever_m{};
  double test_lever_m = 0.0;
  double test_inclination_rad = 0.0;
};
/// A sheet of another name gets levers that take those shares of its rating.
/// @throws UsageError unless the actuator is series-elastic.
[[nodiscard]] SweepProtocol sweep_protocol(const DataSheet& sheet);

/// Runs an experiment on a simulated bench.
///
/// The recording has the channels and the rate of the actuator's family (docs/simulation/actuators.md); a load
/// cell that is slower than the log is held between its samples, which `Channel::fresh` marks. Its
/// torque rises with the twist. Equal specs give equal recordings.
///
/// Faults act on the sensor signals of the bench's loop and on the log; truth is not affected.
/// Where a sensor gives NaN, the loop continues with that sensor's last number, as a drive that
/// drops invalid frames; the log has the NaN.
/// @throws UsageError for an unknown name, or a value that the experiment cannot take; Cancelled if
/// `progress` asks to stop.
[[nodiscard]] Recording simulate(const ExperimentSpec& spec, const Progress& progress = {});
/// The same with another data sheet: `spec.actuator` is not used.
[[nodiscard]] Recording simulate(const DataSheet& nominal, const ExperimentSpec& spec,
                                 const Progress& progress = {});

/// The twist [rad] of the actuator's elastic element as measured: gear minus joint, the
/// coupling's own sensor, input minus joint, or the tube's two ends.
/// @throws Error if the recording is of another family.
[[nodiscard]] std::vector<double> measured_twist(const DataSheet& sheet,
                                                 const Recording& recording);

/// The dynamics that a simulation of the actuator must resolve.
struct PlantFigures {
  /// [Hz], the lower first: both ends free, no load on the joint, without damping.
  std::array<double, 2> natural_frequencies_Hz{};
  double longest_step_s = 0.0;  ///< limit from the stiffest mode and the strongest damping
};
[[nodiscard]] PlantFigures plant_figures(const DataSheet& sheet);

/// The recordings of paper 001 for fitting a spring (specification 4.7): training sweeps with the
/// mass at different places on the lever (three; the paper prints no number), and a test sweep with
/// another place and an inclined plane of motion. Seeds are `seed`, `seed + 1`, ...
/// @throws UsageError for an unknown actuator; Cancelled if `progress` asks to stop.
[[nodiscard]] Dataset sweep_dataset(std::string_view actuator, std::uint64_t seed,
                                    const Progress& progress = {});
/// The same with a data sheet.
[[nodiscard]] Dataset sweep_dataset(const DataSheet& sheet, std::uint64_t seed,
                                    const Progress& progress = {});

}  // namespace torsio

#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "torsio/actuator/data_sheet.hpp"
#include "torsio/core/progress.hpp"
#include "torsio/data/recording.hpp"

namespace torsio {

/// One bench run: which actuator, what is done to it, and the noise's seed.
struct ExperimentSpec {
  std::string actuator = "dfki-50";  ///< as `data_sheet` takes it
  std::string experiment = "sweep";
  std::uint64_t seed = 1;
  std::optional<double> duration_s = {};  ///< none: as long as the experiment's protocol is
  std::optional<double> lever_m = {};     ///< none: the first of `sweep_protocol`
  double inclination_rad = 0.0;           ///< of the lever's plane of motion from the vertical
  std::optional<double> amplitude = {};   ///< Nm or rad, as the experiment has it; none: its own
  std::optional<double> frequency_Hz = {};
  bool is_impedance_zero = false;  ///< of the joint's controller; false: high
  bool with_truth = false;         ///< add the `truth_*` channels, which no sensor sees
};

struct ExperimentInfo {
  std::string_view name;
  std::string_view actuators;  ///< that have it
  std::string_view description;
  std::string_view amplitude_unit = {};  ///< of `ExperimentSpec::amplitude`; empty: it takes none
};

/// What can be done on the benches. A name may stand there for more than one family.
[[nodiscard]] std::vector<ExperimentInfo> experiments();
/// Those of one actuator.
[[nodiscard]] std::vector<ExperimentInfo> experiments(const DataSheet& sheet);

/// How the sweeps of one actuator are made: the lever with its 9 kg mass goes to and fro between
/// +-amplitude (SPEC section 4.7). Levers of dfki-28, for which SPEC names none, are ours: its
/// torques reach the shares of the rating that those of the others do (0.2 to 0.55).
struct SweepProtocol {
  double amplitude_rad = 0.0;
  std::array<double, 3> train_lever_m{};
  double test_lever_m = 0.0;
  double test_inclination_rad = 0.0;
};
/// @throws UsageError for an unknown actuator.
[[nodiscard]] SweepProtocol sweep_protocol(std::string_view actuator);

/// Runs an experiment on a simulated bench.
///
/// The recording has the channels `motor_angle_rad` (of the rotor) `gear_angle_rad joint_angle_rad
/// motor_current_A torque_Nm` at 1 kHz; `torque_Nm` is a 125 Hz load cell, held between its
/// samples, which `Channel::fresh` marks, and 2 ms late. Equal specs give equal recordings.
/// @throws UsageError for an unknown name, or a value that the experiment cannot take; Cancelled if
/// `progress` asks to stop.
[[nodiscard]] Recording simulate(const ExperimentSpec& spec, const Progress& progress = {});
/// The same with an actuator of one's own: `spec.actuator` is not looked at.
[[nodiscard]] Recording simulate(const DataSheet& sheet, const ExperimentSpec& spec,
                                 const Progress& progress = {});

}  // namespace torsio

#pragma once

#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "torsio/actuator/data_sheet.hpp"
#include "torsio/actuator/wear.hpp"
#include "torsio/control/design/linear_system.hpp"
#include "torsio/control/joint_controller.hpp"
#include "torsio/control/model_inverse.hpp"
#include "torsio/control/torque_controller.hpp"
#include "torsio/core/progress.hpp"
#include "torsio/data/recording.hpp"
#include "torsio/files/model_file.hpp"
#include "torsio/signal/excitation.hpp"
#include "torsio/sim/closed_loop/tracking_score.hpp"
#include "torsio/sim/faults/fault_schedule.hpp"

namespace torsio {

/// A torque that a loop is to follow, at the 1 kHz of the benches.
struct TorqueReference {
  enum class Kind : std::uint8_t {
    chirp,        ///< 0.01 to 0.3 Hz over 100 s (specification 4.7)
    random_walk,  ///< noise below 1 Hz, with the RMS of the chirp
    steps,        ///< A, -A, A/2, -A/2, each for 2 s
    sweep,        ///< a logarithmic sweep through the loop's bandwidth, see `frequency_sweep`
    replay,       ///< replays `recorded_Nm`
  };

  Kind kind = Kind::chirp;
  /// None: 13 Nm on dfki-50 and 20 Nm on dfki-120, as specification 6 has it, else a fifth of the
  /// rating. Replay takes none.
  std::optional<double> amplitude_Nm = {};
  std::optional<double> duration_s =
      {};                                ///< none: 100 s, 20 s for steps and sweep, the recording's
  std::vector<double> recorded_Nm = {};  ///< replay
  double recorded_Hz = 1000.0;           ///< replay
};

[[nodiscard]] std::span<const std::string_view> reference_names() noexcept;
[[nodiscard]] std::string_view name(TorqueReference::Kind kind) noexcept;
/// @throws UsageError that lists the names.
[[nodiscard]] TorqueReference::Kind find_reference(std::string_view name);

/// What it asks for; a replay's is its largest.
[[nodiscard]] double amplitude_of(const TorqueReference& reference, const DataSheet& sheet);

/// The sweep of `Kind::sweep`: 1 to 40 Hz.
[[nodiscard]] LogSweep::Parameters frequency_sweep(double amplitude_Nm, double duration_s);

/// Limits of a drive, in the angle and speed of the rotor over the ratio, within which a
/// `JointController` keeps a loop.
struct DriveLimits {
  double lowest_rad = -std::numeric_limits<double>::infinity();
  double highest_rad = std::numeric_limits<double>::infinity();
  double speed_rad_s =
      std::numeric_limits<double>::infinity();  ///< at most that of the rating; none: that
};

/// Range of a drive in a run: the true angle and speed of the rotor over the ratio.
struct DriveRange {
  double lowest_rad = 0.0;
  double highest_rad = 0.0;
  double fastest_rad_s = 0.0;
  double largest_spring_Nm = 0.0;  ///< K times the true deflection
  double allowed_spring_Nm = 0.0;  ///< up to which the limits are guaranteed
  double limited_s = 0.0;          ///< time with an active limit of position, speed or current
};

/// A torque loop on the simulated bench of a series-elastic actuator.
struct TrackingSpec {
  JointOutput output = JointOutput::locked;
  double lever_m = 0.8;  ///< free: where the 9 kg hang; gravity acts (specification 4.2)
  TorqueReference reference = {};
  double bandwidth_rad_s = 50.0;
  double damping = 0.9;
  std::optional<FrictionCompensation> friction = std::nullopt;
  std::optional<double> observer_cutoff_Hz = std::nullopt;
  bool feeds_rate_forward = false;
  /// With `velocity` or with limits the loop is that of a `JointController`. Of the torque at rated
  /// current, the limits allow for 5 % that no sensor measures and for 60 % in the spring.
  DeflectionController::Actuation actuation = DeflectionController::Actuation::current;
  /// Bandwidth of the velocity loop; none: four times that of the deflection controller, at most
  /// `kMaxVelocity_rad_s`.
  std::optional<double> velocity_rad_s = std::nullopt;
  static constexpr double kMaxVelocity_rad_s = 200.0;  ///< a fifth of the sample rate
  std::optional<DriveLimits> limits = std::nullopt;
  bool measures_bandwidth = true;  ///< by a run of its own with `frequency_sweep`
  OperatingConditions conditions = {};
  FaultSchedule faults = {};
};

/// The torque loop of a run, cut open at the current, in its linear range.
/// @throws UsageError if the deflection controller acts on the speed; Error as `check_tracking`.
[[nodiscard]] LinearSystem open_torque_loop(const DataSheet& nominal, const TrackingSpec& spec);

/// Checks a run. @throws UsageError if the actuator is not series-elastic, the reference exceeds
/// its rating, the lever would tip over, or as `FaultInjector`; Error if the loop would be
/// unstable, or the limits contradict each other. UsageError for a limit of the speed above the
/// rating, or a velocity loop that is too fast.
void check_tracking(const DataSheet& nominal, const TrackingSpec& spec, std::uint64_t seed);

struct TrackingRun {
  TrackingScore score;  ///< valid if the run has not diverged
  /// Where the response to `frequency_sweep` has fallen to -3 dB: 0 below the sweep, infinite above
  /// it; none if not asked for, or if it diverged
  std::optional<double> bandwidth_Hz = {};
  bool has_diverged =
      false;  ///< stopped: the joint made a full turn, or the torque exceeded every bound
  DriveRange drive = {};
  /// If faults are scheduled: one entry for each, compared with a run without them.
  std::vector<FaultDetection> faults = {};
  /// Sensor signals, each term of the command, and the `truth_` channels.
  ///
  ///     command = proportional + integral + derivative + feed_forward + rate_feed_forward +
  ///               friction + observer + transfer + rest,   all `..._current_A`
  ///
  /// where rest is the part that a limit removed, or the rest of the command while a fault fades it
  /// to 0. With `Actuation::velocity`, proportional, integral, derivative and feed_forward are those of
  /// the velocity loop, and `wanted_speed_rad_s` is the command of the deflection controller;
  /// `limit_1` is a `JointCascade::Limit`. Both are missing where the loop has neither limits nor a
  /// velocity loop.
  Recording record;
};

/// Follows the reference for its whole length, at 1 kHz, with the gains that the bandwidth gives on
/// the actuator's data sheet. Equal calls give equal runs.
/// @param seed of the sensors' noise, and of a random walk
/// @throws as `check_tracking` before the first step; Error if the plant refuses; Cancelled.
[[nodiscard]] TrackingRun track(const DataSheet& nominal, const TrackingSpec& spec,
                                const AnyInverse& inverse, std::uint64_t seed,
                                const Progress& progress = {});

/// The inverse that a model file's model gives a loop at 1 kHz. Zeros that the model requires are 0:
/// simulated encoders have no other.
/// @throws Error as `AnyInverse::of`, or if the model cannot run at that rate.
[[nodiscard]] AnyInverse inverse_of(const ModelFile& model);

/// What `track` calls the line of `sweep_line` where others are model files: a documented keyword
/// (docs/simulation/tracking.md), the name of its rows too.
inline constexpr std::string_view kSweepLineName = "linear";

/// The line that the sweeps of `sweep_dataset` give: what a loop has without a learned model.
[[nodiscard]] LinearInverse sweep_line(const DataSheet& sheet, std::uint64_t seed,
                                       const Progress& progress = {});

struct NamedInverse {
  std::string name;
  AnyInverse inverse;
};

/// One model, one run.
struct TrackingRow {
  std::string actuator;
  std::string variant;  ///< variant of the spring
  JointOutput output = JointOutput::locked;
  std::string reference;
  double amplitude_Nm = 0.0;
  std::string model;
  std::uint64_t seed = 1;
  TrackingScore score = {};
  std::optional<double> mad_to_linear = {};  ///< MAD over that of the linear inverse, same seed
  std::optional<double> bandwidth_Hz = {};   ///< as `TrackingRun`'s
  std::optional<DriveRange> drive = {};      ///< as `TrackingRun`'s; none without limits
  /// As in `TrackingSpec`.
  DeflectionController::Actuation actuation = DeflectionController::Actuation::current;
  double bandwidth_rad_s = 0.0;
  std::optional<double> velocity_rad_s = {};  ///< with `Actuation::velocity`
  std::optional<DriveLimits> limits = {};
  std::vector<FaultDetection> faults = {};  ///< as `TrackingRun`'s
  std::string status = "ok";                ///< "diverged", "failed"
  std::string reason = {};
};

/// `linear` and each of the models under every seed, in this order; a run that fails is a row with
/// the reason.
/// @throws as `check_tracking`, before the first run; Cancelled.
[[nodiscard]] std::vector<TrackingRow> track_models(const DataSheet& sheet,
                                                    const TrackingSpec& spec,
                                                    const LinearInverse& linear,
                                                    std::span<const NamedInverse> models,
                                                    std::span<const std::uint64_t> seeds,
                                                    const Progress& progress = {});

}  // namespace torsio

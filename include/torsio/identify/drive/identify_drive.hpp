#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "torsio/core/estimate.hpp"
#include "torsio/core/progress.hpp"
#include "torsio/data/recording.hpp"
#include "torsio/identify/drive/drive_model.hpp"
#include "torsio/identify/drive/drive_sheet.hpp"
#include "torsio/joint_load/known_load.hpp"

namespace torsio {

/// What an identification found in its recordings.
struct DriveFinding {
  bool is_failure = false;
  std::string subject;  ///< "passive run"
  std::string text;     ///< what was found and what to do, in sentences
};

struct IdentifyOptions {
  /// Terms of the model; empty: chosen by leaving out groups of recordings.
  std::optional<DriveTerms> terms = {};
  /// Terms that a choice begins with, the base among them; empty: all but those of a spring.
  std::optional<DriveTerms> largest = {};
  /// Condition by which recordings are left out together; empty: each recording alone if there are at most six, else by
  /// the condition with the fewest values, 3 at least.
  std::string group_by = {};
  std::size_t starts = 3;
  double step_s = 0.0;  ///< step of the integrator; 0: 2.5 ms with one mass, 1 ms with two
  bool has_standard_errors = true;
  bool has_nested_score =
      true;  ///< with a choice: it is made again without each group, which is then scored
  std::uint64_t seed = 1;
  std::size_t threads = 0;  ///< 0: as many as the machine has
  Progress progress = {};
};

/// One number that was searched for.
struct IdentifiedDriveParameter {
  DriveParameter parameter{};
  double value = 0.0;
  /// Delete-one-recording jackknife, the load's errors and that of a measured error gain, in quadrature; NaN: fewer than
  /// three recordings.
  double standard_error = kNotMeasured;
  double lowest =
      kNotMeasured;  ///< end of the 95 % interval: Student's t, on the logarithm of a positive parameter
  double highest = kNotMeasured;
  double from_load = 0.0;  ///< the part of the standard error that the load's errors cause
  std::optional<bool> is_determined = {};  ///< by the interval; empty: not known, without one
  bool is_at_bound = false;
};

/// A structure that was compared.
struct StructureTrial {
  DriveTerms terms;
  std::string change;    ///< "without delay"
  double mae_rad = 0.0;  ///< mean over the recordings, each left out with its group
  double gain_error_rad =
      kNotMeasured;  ///< standard error of its difference from the structure before
  bool is_taken = false;
};

struct DriveRecordingScore {
  std::string recording;
  std::string group;
  double mae_rad = 0.0;  ///< mean |error of the angle| of the free run
  double held_out_mae_rad =
      kNotMeasured;                      ///< the same by a model that was fitted without its group
  double nested_mae_rad = kNotMeasured;  ///< and whose structure was chosen without it
};

/// Duty over gain and error where it is not limited, by least squares.
struct MeasuredErrorGain {
  double value_1_rad = 0.0;
  double standard_error_1_rad = kNotMeasured;  ///< delete-one-recording jackknife; NaN: of one
  double delay_s = 0.0;                        ///< after which the drive follows a goal
  double residual_duty_1 = 0.0;                ///< RMS
  std::size_t samples = 0;
};

struct DriveIdentification {
  DriveTerms terms;
  DriveValues values{};
  DriveSheet drive;
  LoadSheet load;
  std::vector<IdentifiedDriveParameter> parameters;
  double mae_rad = 0.0;  ///< means over the recordings
  double rmse_rad = 0.0;
  double held_out_mae_rad =
      kNotMeasured;  ///< error of this structure; too good if it was chosen by it
  double nested_mae_rad = kNotMeasured;
  std::vector<DriveRecordingScore> recordings;
  /// The values of the fit without its group, for each recording; empty with one group.
  std::vector<DriveValues> held_out_values;
  std::vector<StructureTrial> trials;
  std::optional<MeasuredErrorGain> error_gain;
  std::vector<DriveFinding> findings;
  double step_s = 0.0;
  std::size_t groups = 0;  ///< 0: of a drive that was only evaluated
};

/// The parameters of a drive by Levenberg-Marquardt on free runs from the commands alone, against the angle of one
/// encoder; a torque sensor is not used. The mass of the load gives the torque's scale.
/// @throws Error naming recording, channel and what is expected if a recording cannot be used, or with the failed
/// findings if the recordings do not determine the model; Cancelled.
[[nodiscard]] DriveIdentification identify_drive(const std::vector<Recording>& recordings,
                                                 const LoadSheet& load, const DriveSheet& drive,
                                                 const IdentifyOptions& options = {});

/// The same drive with the errors of its free runs through other recordings, in place of those of its fit: `recordings`,
/// `mae_rad` and `rmse_rad` are theirs. Nothing is fitted; held-out errors, structures and findings are empty.
/// @param group_by as in `IdentifyOptions`, for a later `write_drive`
/// @throws Error naming recording and channel if one is missing or not finite.
[[nodiscard]] DriveIdentification evaluate_drive(const DriveIdentification& identified,
                                                 const std::vector<Recording>& recordings,
                                                 const std::string& group_by = {});

/// A recording to make next, and the parameter whose standard error it lowers most.
struct DriveAdvice {
  std::string recording;  ///< "the mass released with the power off, 3 s"
  DriveParameter parameter{};
  double standard_error = kNotMeasured;  ///< before; NaN: not known
  double standard_error_ratio = 1.0;     ///< after it over before
};

/// Candidates by how much they lower one standard error: a passive release, where no recording has a motion without power,
/// a second mass, a gain between those that were used, a repeat. Each is simulated with the identified drive; its
/// derivatives are added to those of the recordings.
/// @throws Error if there are no recordings, or one cannot be used.
[[nodiscard]] std::vector<DriveAdvice> advise_drive(const DriveIdentification& identified,
                                                    const std::vector<Recording>& recordings);

/// The identified drive through a recording, from its command alone.
struct DriveTrace {
  double sample_rate_Hz = 0.0;
  std::vector<double> measured_rad = {};
  std::vector<double> angle_rad = {};  ///< angle of the encoder that was fitted
  std::vector<double> joint_angle_rad = {};
  std::vector<double> joint_torque_Nm = {};
};
[[nodiscard]] DriveTrace simulate_drive(const DriveIdentification& identified,
                                        const Recording& recording);

}  // namespace torsio

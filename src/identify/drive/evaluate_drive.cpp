#include "identify/drive/drive_fit.hpp"
#include "identify/drive/drive_logs.hpp"
#include "torsio/core/error.hpp"
#include "torsio/identify/drive/identify_drive.hpp"

namespace torsio {

DriveIdentification evaluate_drive(const DriveIdentification& identified,
                                   const std::vector<Recording>& recordings,
                                   const std::string& group_by) {
  if (recordings.empty())
    throw UsageError({.place = "evaluate_drive", .expected = "recordings", .found = "none"});
  const std::vector<std::string> groups = drive_groups(recordings, group_by);
  const std::vector<DriveLog> logs = drive_logs(recordings, identified.load, identified.drive);
  const DriveFitOptions options{.step_s = identified.step_s};
  const DriveScore score =
      score_drive(drive_problem(pointers_to(logs), identified.terms, options), identified.values);
  DriveIdentification evaluated = identified;
  evaluated.mae_rad = score.mae_rad;
  evaluated.rmse_rad = score.rmse_rad;
  evaluated.held_out_mae_rad = kNotMeasured;
  evaluated.nested_mae_rad = kNotMeasured;
  evaluated.groups = 0;
  evaluated.recordings.clear();
  for (std::size_t k = 0; k < logs.size(); ++k)
    evaluated.recordings.push_back(
        {.recording = logs[k].name, .group = groups[k], .mae_rad = score.mae_of_log_rad[k]});
  evaluated.held_out_values.clear();
  evaluated.trials.clear();
  evaluated.findings.clear();
  return evaluated;
}

}  // namespace torsio

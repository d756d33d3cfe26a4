#include "torsio/identify/drive/identify_drive.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <utility>

#include "core/report_progress.hpp"
#include "identify/drive/choose_structure.hpp"
#include "identify/drive/drive_checks.hpp"
#include "identify/drive/drive_errors.hpp"
#include "identify/drive/drive_fit.hpp"
#include "identify/drive/drive_logs.hpp"
#include "identify/drive/error_gain.hpp"
#include "identify/drive/free_run.hpp"
#include "numerics/parallel.hpp"
#include "torsio/core/error.hpp"

namespace torsio {
namespace {

std::vector<DriveLog> logs_of(const std::vector<Recording>& recordings, const LoadSheet& load,
                              const DriveSheet& drive, const std::string& group_by) {
  const std::vector<std::string> groups = drive_groups(recordings, group_by);
  std::vector<DriveLog> logs = drive_logs(recordings, load, drive);
  for (std::size_t k = 0; k < logs.size(); ++k) logs[k].group = groups[k];
  return logs;
}

DriveTerms largest_terms(const IdentifyOptions& options, const LoadSheet& load, CommandKind kind) {
  const DriveTerms wanted =
      options.terms.value_or(options.largest.value_or(possible_terms(kind, false, false)));
  const bool has_spring = has(wanted, DriveTerm::spring);
  const DriveTerms possible = possible_terms(kind, has_spring, load.fits_joint_inertia);
  const DriveTerms terms = (wanted | drive_terms({DriveTerm::base})) & possible;
  const DriveTerms impossible = options.terms.value_or(DriveTerms()) & ~possible;
  for (std::size_t k = 0; k < kDriveTerms; ++k)
    if (impossible.test(k))
      throw UsageError({.place = "the terms (--terms)",
                        .expected = "terms that the drive's law can have",
                        .found = std::string(name(static_cast<DriveTerm>(k))),
                        .advice = "resistance_rise and duty_exponent need a law of position or "
                                  "voltage, hysteresis, backlash, "
                                  "bearing and presliding need spring, joint_inertia needs spring "
                                  "and 'joint_inertia: fit' in "
                                  "the load file; direction is for a drive without spring."});
  return terms;
}

void require_usable(const std::vector<DriveFinding>& findings) {
  std::string text;
  for (const DriveFinding& finding : findings)
    if (finding.is_failure)
      text += fmt::format("{}{}: {}", text.empty() ? "" : "\n  ", finding.subject, finding.text);
  if (!text.empty())
    throw Error({.place = "torsio identify",
                 .problem = "the recordings do not determine a model\n  " + text});
}

void set_nested(const GroupedLogs& all, const DriveTerms& largest, const DriveFitOptions& options,
                std::size_t threads, DriveIdentification& identified) {
  // The groups that remain choose the structure among themselves, so that there must be two of them.
  if (all.groups < 3) return;
  std::vector<std::vector<double>> scores(all.groups);
  for_each_chunk(all.groups, threads, [&](std::size_t left_out) {
    const GroupedLogs rest = all.subset_without(left_out);
    const ChosenStructure chosen = choose_structure(rest, largest, options, 1);
    const DriveSolution fit = fit_drive(rest.logs, chosen.held_out.terms, options);
    for (std::size_t k = 0; k < all.logs.size(); ++k)
      if (all.group[k] == left_out)
        scores[left_out].push_back(
            score_drive(drive_problem({all.logs[k]}, chosen.held_out.terms, options), fit.values)
                .mae_rad);
  });
  identified.nested_mae_rad = 0.0;
  std::vector<std::size_t> next(all.groups, 0);
  for (std::size_t k = 0; k < all.logs.size(); ++k) {
    const std::size_t group = all.group[k];
    identified.recordings[k].nested_mae_rad = scores[group][next[group]++];
    identified.nested_mae_rad +=
        identified.recordings[k].nested_mae_rad / static_cast<double>(all.logs.size());
  }
}

void set_held_out(const GroupedLogs& all, const HeldOutStructure& held_out,
                  DriveIdentification& identified) {
  identified.held_out_mae_rad = held_out.mae_rad;
  identified.held_out_values.clear();
  for (std::size_t k = 0; k < identified.recordings.size(); ++k) {
    identified.recordings[k].held_out_mae_rad = held_out.mae_of_log_rad[k];
    identified.held_out_values.push_back(held_out.fits[all.group[k]].values);
  }
}

/// The fits without a group are further starts of a rigid drive, since three do not always reach the least loss. A spring
/// has starts of its own.
DriveSolution best_of_starts(const GroupedLogs& all, const DriveIdentification& identified,
                             const DriveFitOptions& options, std::size_t threads) {
  const std::size_t more =
      has(identified.terms, DriveTerm::spring) || all.groups < 2 ? 0 : all.groups;
  std::vector<DriveSolution> solutions(1 + more);
  for_each_chunk(solutions.size(), threads, [&](std::size_t k) {
    if (k == 0) {
      solutions[0] = fit_drive(all.logs, identified.terms, options);
      return;
    }
    const auto member = std::ranges::find(all.group, k - 1) - all.group.begin();
    solutions[k] =
        refit_drive(all.logs, identified.terms,
                    identified.held_out_values[static_cast<std::size_t>(member)], options);
  });
  return *std::ranges::min_element(solutions, {}, &DriveSolution::cost);
}

/// Sets the terms and the errors of recordings that were left out.
void set_structure(const GroupedLogs& all, const DriveTerms& largest, const DriveFitOptions& fit,
                   const IdentifyOptions& options, DriveIdentification& identified) {
  identified.groups = all.groups;
  identified.terms = largest;
  if (all.groups < 2) return;
  report_progress(options.progress, 0.0, "structure");
  if (options.terms) {
    set_held_out(all, hold_out(all, largest, fit, options.threads), identified);
    return;
  }
  ChosenStructure chosen = choose_structure(all, largest, fit, options.threads);
  identified.terms = chosen.held_out.terms;
  identified.trials = std::move(chosen.trials);
  set_held_out(all, chosen.held_out, identified);
  if (options.has_nested_score) set_nested(all, largest, fit, options.threads, identified);
}

void set_errors_of_fit(const std::vector<DriveLog>& logs, const DriveFitOptions& fit,
                       DriveIdentification& identified) {
  const DriveProblem problem = drive_problem(pointers_to(logs), identified.terms, fit);
  const DriveScore score = score_drive(problem, identified.values);
  identified.mae_rad = score.mae_rad;
  identified.rmse_rad = score.rmse_rad;
  for (std::size_t k = 0; k < logs.size(); ++k) {
    identified.recordings[k].recording = logs[k].name;
    identified.recordings[k].group = logs[k].group;
    identified.recordings[k].mae_rad = score.mae_of_log_rad[k];
  }
}

double relative_error(const std::optional<MeasuredErrorGain>& gain) {
  return gain ? gain->standard_error_1_rad / gain->value_1_rad : 0.0;
}

}  // namespace

DriveIdentification identify_drive(const std::vector<Recording>& recordings, const LoadSheet& load,
                                   const DriveSheet& drive, const IdentifyOptions& options) {
  if (recordings.empty())
    throw UsageError({.place = "torsio identify", .expected = "recordings", .found = "none"});
  const MeasuredDrive measured = measured_drive(recordings, drive);
  const std::vector<DriveLog> logs = logs_of(recordings, load, measured.sheet, options.group_by);
  DriveIdentification identified;
  identified.drive = measured.sheet;
  identified.load = load;
  identified.error_gain = measured.error_gain;
  identified.findings = check_drive_logs(recordings, logs);
  std::ranges::copy(measured.findings, std::back_inserter(identified.findings));
  require_usable(identified.findings);
  identified.recordings.resize(logs.size());
  const DriveFitOptions fit{.starts = options.starts,
                            .seed = options.seed,
                            .step_s = options.step_s,
                            .progress = options.progress};
  const GroupedLogs all = grouped(pointers_to(logs));
  set_structure(all, largest_terms(options, load, logs.front().kind), fit, options, identified);
  identified.step_s = drive_step_s(identified.terms, fit);
  identified.values = best_of_starts(all, identified, fit, options.threads).values;
  set_errors_of_fit(logs, fit, identified);
  require_usable(check_free_runs(logs, identified, fit, options.threads));
  report_progress(options.progress, 0.5, "standard errors");
  identified.parameters =
      parameters_with_errors(logs, identified.terms, identified.values, options.has_standard_errors,
                             relative_error(identified.error_gain), fit, options.threads);
  for (DriveFinding& finding : check_identified(recordings, logs, identified))
    identified.findings.push_back(std::move(finding));
  return identified;
}

DriveTrace simulate_drive(const DriveIdentification& identified, const Recording& recording) {
  const DriveLog log = drive_log(recording, identified.load, identified.drive);
  FreeRun run = free_run(log, identified);
  return {.sample_rate_Hz = recording.sample_rate_Hz(),
          .measured_rad = log.angle_rad,
          .angle_rad = std::move(run.angle_rad),
          .joint_angle_rad = std::move(run.joint_angle_rad),
          .joint_torque_Nm = std::move(run.joint_torque_Nm)};
}

}  // namespace torsio

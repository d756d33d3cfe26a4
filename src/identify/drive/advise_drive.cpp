#include <fmt/format.h>

#include <Eigen/Core>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "identify/drive/drive_course.hpp"
#include "identify/drive/drive_fit.hpp"
#include "identify/drive/drive_logs.hpp"
#include "identify/drive/free_run.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/units.hpp"
#include "torsio/identify/drive/identify_drive.hpp"

namespace torsio {
namespace {

struct CandidateLog {
  std::string text;
  DriveLog log;
};

/// The identified drive's angle becomes that of the log, from `start` on.
DriveLog simulated(DriveLog log, const DriveIdentification& identified, const DriveRun& start) {
  log.angle_rad = free_run(log, start, identified).angle_rad;
  return log;
}

CandidateLog release(const DriveLog& like, const DriveIdentification& identified) {
  constexpr double kDuration_s = 3.0;
  constexpr double kFrom_rad = 1.5;
  DriveLog log = like;
  // A recording at a low rate is longer, so that it has the samples that a log needs.
  const auto samples =
      std::max(static_cast<std::size_t>(kDuration_s / log.sample_period_s), kFewestDriveSamples);
  log.command.assign(samples, 0.0);
  log.command_end.clear();  // the recording may be shorter
  log.angle_rad.assign(samples, 0.0);
  log.enabled.assign(samples, 0.0);
  return {fmt::format("the mass released at {:.0f} deg from hanging, power off, {:.3g} s",
                      deg_from_rad(kFrom_rad), static_cast<double>(samples) * log.sample_period_s),
          simulated(log, identified, {0, samples, kFrom_rad - log.load.load.zero_rad, 0.0})};
}

DriveRun start_of(const DriveLog& log) { return run_from(log, 0, log.size()); }

CandidateLog second_mass(const DriveLog& like, const DriveIdentification& identified) {
  DriveLog log = like;
  log.load.load.gravity_Nm *= 2.0;
  log.load.load.inertia_kg_m2 *= 2.0;
  return {fmt::format("the motion of {} with twice the mass", like.name),
          simulated(log, identified, start_of(log))};
}

std::optional<CandidateLog> gain_between(const std::vector<DriveLog>& logs,
                                         const DriveIdentification& identified) {
  std::vector<double> gains;
  gains.reserve(logs.size());
  for (const DriveLog& log : logs) gains.push_back(log.gain);
  std::ranges::sort(gains);
  double widest = 1.2;
  double gain = 0.0;
  for (std::size_t k = 0; k + 1 < gains.size(); ++k)
    if (gains[k] > 0.0 && gains[k + 1] / gains[k] > widest) {
      widest = gains[k + 1] / gains[k];
      gain = std::sqrt(gains[k] * gains[k + 1]);
    }
  if (gain == 0.0) return std::nullopt;
  const auto nearest = std::ranges::min_element(
      logs, {}, [&](const DriveLog& log) { return std::abs(log.gain - gain); });
  DriveLog log = *nearest;
  const double factor = gain / log.gain;
  log.gain = gain;
  return CandidateLog{
      fmt::format("the motion of {} with {:.2f} times its gain", nearest->name, factor),
      simulated(log, identified, start_of(log))};
}

/// The searched parameters of a set of logs and how sharply these determine them.
struct DriveInformation {
  std::vector<SearchedDriveParameter> searched;
  Eigen::MatrixXd matrix;
};

DriveInformation information_of(const DriveLogs& logs, const DriveIdentification& identified) {
  const DriveProblem problem = drive_problem(logs, identified.terms, {.step_s = identified.step_s});
  const std::vector<double> rows = drive_information(problem, identified.values);
  const auto count = static_cast<Eigen::Index>(problem.searched.size());
  return {problem.searched,
          Eigen::Map<const Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>>(
              rows.data(), count, count)};
}

/// A recording that could be made next.
struct Candidate {
  std::string text;
  Eigen::MatrixXd information;
};

/// A recording and how sharply it determines the parameters.
struct InformativeLog {
  const DriveLog* log;
  Eigen::MatrixXd information;
};

/// The recording that moves the parameters most is the one to vary.
InformativeLog strongest_of(const std::vector<DriveLog>& logs, const Eigen::MatrixXd& covariance,
                            const DriveIdentification& identified) {
  InformativeLog strongest{nullptr, {}};
  double most = 0.0;
  for (const DriveLog& log : logs) {
    Eigen::MatrixXd information = information_of({&log}, identified).matrix;
    const double gain = (covariance * information).trace();
    if (strongest.log != nullptr && !(gain > most)) continue;
    most = std::max(gain, 0.0);
    strongest = {&log, std::move(information)};
  }
  return strongest;
}

std::vector<Candidate> candidates_of(const std::vector<DriveLog>& logs, const InformativeLog& most,
                                     const DriveIdentification& identified) {
  const DriveLog& strongest = *most.log;
  std::vector<Candidate> candidates{{strongest.name + " once more", most.information}};
  const auto add = [&](const CandidateLog& candidate) {
    candidates.push_back({candidate.text, information_of({&candidate.log}, identified).matrix});
  };
  if (strongest.load.load.gravity_Nm > 0.0 && std::ranges::none_of(logs, [](const DriveLog& log) {
        return drive_course(log).has_passive_motion;
      }))
    add(release(strongest, identified));
  add(second_mass(strongest, identified));
  if (const auto between = gain_between(logs, identified)) add(*between);
  return candidates;
}

double standard_error_of(const DriveIdentification& identified, DriveParameter parameter) {
  const auto found =
      std::ranges::find(identified.parameters, parameter, &IdentifiedDriveParameter::parameter);
  return found == identified.parameters.end() ? kNotMeasured : found->standard_error;
}

}  // namespace

std::vector<DriveAdvice> advise_drive(const DriveIdentification& identified,
                                      const std::vector<Recording>& recordings) {
  if (recordings.empty())
    throw UsageError({.place = "advise_drive", .expected = "recordings", .found = "none"});
  const std::vector<DriveLog> logs = drive_logs(recordings, identified.load, identified.drive);
  DriveInformation before = information_of(pointers_to(logs), identified);
  // What no recording moves has a finite variance all the same.
  before.matrix.diagonal().array() += 1e-9 * std::max(before.matrix.diagonal().maxCoeff(), 1e-300);
  const Eigen::MatrixXd covariance = before.matrix.inverse();
  const Eigen::VectorXd variance = covariance.diagonal();
  const InformativeLog strongest = strongest_of(logs, covariance, identified);
  std::vector<DriveAdvice> advice;
  for (const Candidate& candidate : candidates_of(logs, strongest, identified)) {
    if (!candidate.information.allFinite()) continue;
    const Eigen::VectorXd after = (before.matrix + candidate.information).inverse().diagonal();
    Eigen::Index best = 0;
    const double ratio = (after.array() / variance.array()).minCoeff(&best);
    const auto parameter =
        static_cast<DriveParameter>(before.searched[static_cast<std::size_t>(best)].index);
    advice.push_back({candidate.text, parameter, standard_error_of(identified, parameter),
                      std::sqrt(std::max(ratio, 0.0))});
  }
  std::ranges::stable_sort(advice, {}, &DriveAdvice::standard_error_ratio);
  return advice;
}

}  // namespace torsio

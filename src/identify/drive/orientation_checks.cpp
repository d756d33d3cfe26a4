#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <string>

#include "identify/drive/drive_checks.hpp"
#include "identify/drive/drive_findings.hpp"
#include "numerics/parallel.hpp"
#include "torsio/core/units.hpp"

namespace torsio {
namespace {

/// Mean over the logs of the mean distance from where the angle began.
double error_of_standing_still_rad(const std::vector<DriveLog>& logs) {
  double sum = 0.0;
  for (const DriveLog& log : logs)
    for (const double angle : log.angle_rad)
      sum +=
          std::abs(angle - log.angle_rad.front()) / static_cast<double>(log.size() * logs.size());
  return sum;
}

/// How the angle could count instead.
struct Orientation {
  bool is_mirrored = false;  ///< in the other direction than the command
  double zero_rad = 0.0;     ///< further zero of the load
};

constexpr std::array<Orientation, 8> kOrientations{{{},
                                                    {.is_mirrored = true},
                                                    {.zero_rad = std::numbers::pi},
                                                    {true, std::numbers::pi},
                                                    {.zero_rad = 0.5 * std::numbers::pi},
                                                    {.zero_rad = -0.5 * std::numbers::pi},
                                                    {true, 0.5 * std::numbers::pi},
                                                    {true, -0.5 * std::numbers::pi}}};

std::vector<DriveLog> oriented(std::vector<DriveLog> logs, const Orientation& orientation) {
  for (DriveLog& log : logs) {
    if (orientation.is_mirrored)
      for (double& angle : log.angle_rad) angle = -angle;
    log.load.load.zero_rad += orientation.zero_rad;
  }
  return logs;
}

/// A part of the recordings is enough to see a direction.
std::vector<DriveLog> some_of(const std::vector<DriveLog>& logs) {
  constexpr std::size_t kMost = 6;
  const std::size_t stride = (logs.size() + kMost - 1) / kMost;
  std::vector<DriveLog> some;
  for (std::size_t k = 0; k < logs.size(); k += stride) some.push_back(logs[k]);
  return some;
}

/// The error of each orientation, by the base of the model.
std::array<double, kOrientations.size()> errors_of_orientations(const std::vector<DriveLog>& logs,
                                                                const DriveFitOptions& options,
                                                                std::size_t threads) {
  const std::vector<DriveLog> some = some_of(logs);
  DriveFitOptions quick = options;
  quick.starts = 1;
  const DriveTerms terms = drive_terms({DriveTerm::base});
  std::array<double, kOrientations.size()> errors_rad{};
  for_each_chunk(kOrientations.size(), threads, [&](std::size_t k) {
    const std::vector<DriveLog> turned = oriented(some, kOrientations[k]);
    const DriveLogs all = pointers_to(turned);
    const double error =
        score_drive(drive_problem(all, terms, quick), fit_drive(all, terms, quick).values).mae_rad;
    errors_rad[k] = std::isfinite(error) ? error : HUGE_VAL;
  });
  return errors_rad;
}

/// @param stated_rad zero of the load that is stated
std::string what_to_turn(const Orientation& orientation, double stated_rad) {
  std::string sign =
      "the angle counts in the other direction than the command: reverse its sign ('sign: -1' of "
      "its channel in a mapping)";
  std::string zero = fmt::format(
      "the angle is not 0 where the load hangs: state 'zero: {:.0f}deg' in the load file, or "
      "shift goal and angle",
      deg_from_rad(stated_rad + orientation.zero_rad));
  if (orientation.zero_rad == 0.0) return sign;
  return orientation.is_mirrored ? sign + ", and " + zero : zero;
}

/// @param before what the recordings showed before the fit
std::string likely_causes(const std::vector<DriveFinding>& before) {
  std::string causes =
      "The likely causes are an angle that counts in the other direction than the command, a zero "
      "that is not where the load hangs, and a wrong unit, gain or load.";
  for (const DriveFinding& finding : before)
    if (finding.subject == "angle") causes += " " + finding.text;
  return causes;
}

}  // namespace

std::vector<DriveFinding> check_free_runs(const std::vector<DriveLog>& logs,
                                          const DriveIdentification& identified,
                                          const DriveFitOptions& options, std::size_t threads) {
  // A fit that follows the motion is not doubted; another orientation explains a motion if it halves the error.
  constexpr double kFollows = 0.5;
  constexpr double kExplains = 0.5;
  const double still_rad = error_of_standing_still_rad(logs);
  if (identified.mae_rad < kFollows * still_rad) return {};
  const auto errors_rad = errors_of_orientations(logs, options, threads);
  const auto* const best = std::ranges::min_element(errors_rad);
  const bool is_explained = best != errors_rad.begin() && *best < kExplains * errors_rad.front() &&
                            *best < kExplains * still_rad;
  DriveFindings findings;
  if (!is_explained && identified.mae_rad < still_rad) return {};
  const std::string found = fmt::format(
      "The simulated angle is wrong by {:.3g} rad, an angle that stays where it began by {:.3g} "
      "rad: the model does not explain the motion. ",
      identified.mae_rad, still_rad);
  if (is_explained)
    findings.fail(
        "direction and zero",
        found + fmt::format(
                    "With the base of the model the error falls from {:.3g} to "
                    "{:.3g} rad if {}.",
                    errors_rad.front(), *best,
                    what_to_turn(kOrientations[static_cast<std::size_t>(best - errors_rad.begin())],
                                 logs.front().load.load.zero_rad)));
  else
    findings.fail("direction and zero", found + likely_causes(identified.findings));
  return findings.take();
}

}  // namespace torsio

#include "studies/study.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <limits>

#include "torsio/core/error.hpp"

namespace torsio {

Study run_study(const StudyInfo& study, const StudyOptions& options, const Progress& progress) {
  constexpr std::size_t kMaxRepeats = 100;
  if (options.repeats < 1 || options.repeats > kMaxRepeats)
    throw UsageError({.place = "repeats",
                      .expected = fmt::format("1 to {}", kMaxRepeats),
                      .found = fmt::format("{}", options.repeats)});
  return study.run(options, progress);
}

std::vector<StudyVerdict> verdicts(const ComparisonTable& table) {
  std::vector<StudyVerdict> all;
  for (const ComparisonRow& row : table.rows) {
    auto found = std::ranges::find(all, row.condition, &StudyVerdict::condition);
    if (found == all.end())
      found = all.insert(found, {.condition = row.condition,
                                 .best_rmse = std::numeric_limits<double>::infinity()});
    if (!row.is_ranked()) continue;
    if (row.model == table.subject) found->rmse = row.rmse;
    if (row.rmse < found->best_rmse) {
      found->best = row.model;
      found->best_rmse = row.rmse;
    }
  }
  for (const StudyVerdict& verdict : all)
    if (verdict.best.empty())
      throw Error({.place = verdict.condition, .problem = "no model could be fitted"});
  return all;
}

}  // namespace torsio

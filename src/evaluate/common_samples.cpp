#include "evaluate/common_samples.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "evaluate/measured_samples.hpp"
#include "numerics/metrics_accumulator.hpp"
#include "torsio/core/estimate.hpp"

namespace torsio {
namespace {

/// A model's rows on one role, all recordings together first, with its estimates on each recording.
struct Candidate {
  std::span<ResultRow> rows;
  std::span<const MeasuredEstimates> recordings;
};

/// What happened to one measured sample in any of the models.
enum class Use : std::uint8_t { not_scored, common, guarded };
using Uses = std::vector<std::vector<Use>>;  // by recording of the role and sample

bool is_mostly_guarded(const Score& score) {
  return 2 * score.guarded_samples > score.metrics.samples;
}

std::vector<Candidate> candidates_of(Role role, std::span<ScoredModel> models) {
  std::vector<Candidate> candidates;
  for (ScoredModel& model : models) {
    const auto estimates = std::ranges::find(model.estimates, role, &ScoredModel::OfRole::role);
    if (estimates == model.estimates.end()) continue;
    const auto total = std::ranges::find(model.rows, role, &ResultRow::split);
    if (total->status == "ok")
      candidates.push_back({{total, estimates->recordings.size() + 1}, estimates->recordings});
  }
  // If none could be ranked, all of them show how few samples there are.
  if (std::ranges::any_of(candidates, [](const Candidate& candidate) {
        return !is_mostly_guarded(candidate.rows.front().score);
      }))
    std::erase_if(candidates, [](const Candidate& candidate) {
      return is_mostly_guarded(candidate.rows.front().score);
    });
  return candidates;
}

Uses uses_of(const std::vector<Candidate>& candidates) {
  Uses uses;
  for (const MeasuredEstimates& recording : candidates.front().recordings)
    uses.emplace_back(recording.values.size(), Use::not_scored);
  for (const Candidate& candidate : candidates)
    for (std::size_t r = 0; r < uses.size(); ++r)
      for (std::size_t n = 0; n < uses[r].size(); ++n)
        if (const MeasuredEstimates& own = candidate.recordings[r]; std::isfinite(own.values[n]))
          uses[r][n] = std::max(uses[r][n], own.guarded[n] ? Use::guarded : Use::common);
  return uses;
}

/// The target at the measured samples of each recording of a role.
std::vector<std::vector<double>> targets_of(const Dataset& dataset, Role role) {
  std::vector<std::vector<double>> targets;
  for (const DatasetRecord& record : dataset.records) {
    if (!record.has_role(role)) continue;
    targets.emplace_back();
    const Channel& target = record.recording.channel(dataset.target);
    for (const Segment& segment : record.segments)
      for (std::size_t i = segment.begin; segment.role == role && i < segment.end; ++i)
        if (is_measured(target, i)) targets.back().push_back(target.values[i]);
  }
  return targets;
}

void score(const Candidate& candidate, const Uses& uses,
           const std::vector<std::vector<double>>& targets) {
  MetricsAccumulator together;
  for (std::size_t r = 0; r < uses.size(); ++r) {
    const std::vector<double>& estimates = candidate.recordings[r].values;
    MetricsAccumulator own;
    for (std::size_t n = 0; n < estimates.size(); ++n) {
      if (uses[r][n] != Use::common || !std::isfinite(estimates[n])) continue;
      own.add(estimates[n], targets[r][n]);
      together.add(estimates[n], targets[r][n]);
    }
    candidate.rows[r + 1].score.common = own.metrics();
  }
  candidate.rows.front().score.common = together.metrics();
}

}  // namespace

Ranking rank_on_common_samples(const Dataset& dataset, Role role, std::span<ScoredModel> models) {
  Ranking ranking{.split = role};
  const std::vector<Candidate> candidates = candidates_of(role, models);
  if (candidates.empty()) return ranking;
  const Uses uses = uses_of(candidates);
  for (const std::vector<Use>& of_recording : uses) {
    const auto common = static_cast<std::size_t>(std::ranges::count(of_recording, Use::common));
    ranking.common_samples += common;
    ranking.scored_samples +=
        common + static_cast<std::size_t>(std::ranges::count(of_recording, Use::guarded));
  }
  if (!ranking.is_possible()) return ranking;
  const auto targets = targets_of(dataset, role);
  for (const Candidate& candidate : candidates) {
    score(candidate, uses, targets);
    ranking.best_fit_percent =
        std::fmax(ranking.best_fit_percent, candidate.rows.front().score.common.fit_percent);
  }
  return ranking;
}

}  // namespace torsio

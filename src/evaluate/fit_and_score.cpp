#include "evaluate/fit_and_score.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <set>

#include "torsio/core/error.hpp"
#include "torsio/core/units.hpp"
#include "torsio/evaluate/comparison.hpp"
#include "torsio/evaluate/evaluate.hpp"
#include "torsio/fit/common/inputs.hpp"

namespace torsio {
namespace {

ResultRow row_for(const ModelFile& file, Role split, const Score& score) {
  ResultRow row;
  row.family = file.card.fitted_as;
  row.split = split;
  row.score = score;
  row.parameter_count = AnyModel(file.parameters).parameter_count();
  constexpr double kDiverged =
      0.01;  // share of the samples; a smaller one is a short excursion at the end of the range
  const auto share = [&](std::size_t samples) {
    return static_cast<double>(samples) / static_cast<double>(row.score.metrics.samples);
  };
  if (!std::isfinite(row.score.metrics.rmse)) {
    row.status = "failed";
    row.reason = "no sample of this split could be scored";
  } else if (share(row.score.diverged_samples) > kDiverged) {
    row.status = "diverged";
    row.reason = fmt::format("free run left the output's range in {:.1f} % of the samples",
                             100.0 * share(row.score.diverged_samples));
  } else if (row.score.guarded_samples > 0) {
    row.reason = fmt::format("{:.1f} % of the samples are the fallback of a guard",
                             100.0 * share(row.score.guarded_samples));
  }
  return row;
}

ResultRow failed_row(const ModelChoice& choice, const Error& error) {
  ResultRow row;
  row.family = choice.family;
  row.status = "failed";
  row.reason = error.what();
  return row;
}

}  // namespace

InputSets::InputSets(const Dataset& dataset, bool allow_leak)
    : dataset_(dataset), allow_leak_(allow_leak) {}

InputSets::InputSets(const Dataset& dataset, InputSets& examined)
    : dataset_(dataset), allow_leak_(examined.allow_leak_) {
  const std::scoped_lock lock(examined.guard_);
  leaks_ = examined.leaks_;
}

std::string InputSets::leak_of(const FeatureSpec& features) {
  const std::scoped_lock lock(guard_);
  for (const auto& [known, leak] : leaks_)
    if (known == features) return leak;
  leaks_.emplace_back(features, refuse_leak(dataset_, features, allow_leak_));
  return leaks_.back().second;
}

std::shared_ptr<const LearningData> InputSets::data_of(const FeatureSpec& features) {
  constexpr std::size_t kKept = 3;
  const std::scoped_lock lock(guard_);
  for (auto known = data_.begin(); known != data_.end(); ++known) {
    if (known->first != features) continue;
    std::rotate(known, known + 1, data_.end());
    return data_.back().second;
  }
  if (data_.size() == kKept) data_.erase(data_.begin());
  data_.emplace_back(features,
                     std::make_shared<const LearningData>(learning_data(dataset_, features)));
  return data_.back().second;
}

void InputSets::forget_data() {
  const std::scoped_lock lock(guard_);
  data_.clear();
}

ScoredModel fit_and_score(const Dataset& dataset, InputSets& input_sets, const ModelChoice& choice,
                          std::uint64_t seed, std::span<const Role> roles,
                          const Progress& progress) {
  const std::string leak = input_sets.leak_of(choice.features);
  ScoredModel scored;
  try {
    const auto data = input_sets.data_of(choice.features);
    scored.trained = train_model(dataset, *data, choice, seed, progress);
    const Estimator estimator = make_estimator(scored.trained->file);
    std::vector<SplitScore> of_roles = evaluate(estimator, dataset, roles, progress);
    for (std::size_t i = 0; i < roles.size(); ++i) {
      const Role role = roles[i];
      if (!dataset.has_role(role)) continue;
      SplitScore& scores = of_roles[i];
      std::ranges::move(rows_of(scored.trained->file, role, scores),
                        std::back_inserter(scored.rows));
      if (role == Role::train) continue;
      scored.estimates.push_back({.role = role, .recordings = {}});
      for (SplitScore::OfRecording& of_recording : scores.recordings)
        scored.estimates.back().recordings.push_back(std::move(of_recording.estimates));
    }
    mark_divergence_in_training(scored.rows);
    for (ResultRow& row : scored.rows) row.fit_seconds = scored.trained->fit_seconds;
  } catch (const Cancelled&) {
    throw;
  } catch (const UsageError&) {
    throw;  // a wrong setting; a fit that fails on these data throws another Error
  } catch (const Error& error) {
    scored = {.trained = {}, .rows = {failed_row(choice, error)}, .estimates = {}};
  }
  for (ResultRow& row : scored.rows) {
    row.variant = choice.variant();
    row.input_set = choice.input_set;
    row.leak = !leak.empty();
  }
  return scored;
}

std::vector<ResultRow> rows_of(const ModelFile& file, Role role, const SplitScore& scores) {
  std::vector<ResultRow> rows{row_for(file, role, scores.together)};
  for (const SplitScore::OfRecording& of_recording : scores.recordings) {
    rows.push_back(row_for(file, role, of_recording.score));
    rows.back().recording = of_recording.recording;
  }
  return rows;
}

Results empty_results(const Dataset& dataset) {
  Results results;
  results.target = dataset.target;
  results.unit = unit_label(dataset.target);
  results.label = dataset.label;
  for (const DatasetRecord& record : dataset.records)
    for (const ZeroRule& zero : record.recording.zeros) results.non_causal_zero |= zero.mid_range;
  return results;
}

void note_inputs(Results& results, const ModelChoice& choice) {
  if (results.inputs.empty()) results.inputs = choice.features.inputs;
  if (results.input_sets.empty() || results.input_sets.back().first != choice.input_set)
    results.input_sets.emplace_back(choice.input_set, choice.features.inputs);
}

void forget_only_set(Results& results) {
  if (results.input_sets.size() == 1 && results.input_sets.front().first.empty())
    results.input_sets.clear();
}

void refuse_seen_test_records(const Dataset& dataset) {
  std::set<std::string> trained;
  for (const DatasetRecord& record : dataset.records)
    if (record.has_role(Role::train)) trained.insert(record.recording.source.sha256);
  for (const DatasetRecord& record : dataset.records) {
    const bool is_held_out = !record.has_role(Role::train);
    if (is_held_out && !record.recording.source.sha256.empty() &&
        trained.contains(record.recording.source.sha256))
      throw UsageError(
          {.place = record.recording.name(),
           .problem = "this file is used for training and for the scores",
           .advice = "Hold another recording out, or split one with `split:` in a manifest."});
  }
}

Progress part_of(const Progress& progress, std::size_t index, std::size_t count,
                 const std::string& doing) {
  if (!progress) return {};
  return [&progress, index, count, doing](double fraction, std::string_view) {
    return progress((static_cast<double>(index) + fraction) / static_cast<double>(count), doing);
  };
}

}  // namespace torsio

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <map>
#include <numeric>

#include "core/did_you_mean.hpp"
#include "evaluate/role_samples.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/random.hpp"
#include "torsio/evaluate/cross_validation.hpp"

namespace torsio {
namespace {

/// Samples [begin, end) of a record; empty: the record is not touched.
struct HeldOut {
  std::size_t begin = 0;
  std::size_t end = 0;
};

std::vector<std::size_t> train_records(const Dataset& dataset) {
  std::vector<std::size_t> records;
  for (std::size_t i = 0; i < dataset.records.size(); ++i)
    if (dataset.records[i].has_role(Role::train)) records.push_back(i);
  return records;
}

/// The record's segments in a fold.
std::vector<Segment> cut(const DatasetRecord& record, HeldOut hole, std::size_t embargo) {
  std::vector<Segment> segments;
  const auto add = [&](std::size_t begin, std::size_t end, Role role) {
    if (begin < end) segments.push_back({.begin = begin, .end = end, .role = role});
  };
  const std::size_t before = hole.begin - std::min(hole.begin, embargo);
  const std::size_t after = hole.end + std::min(record.recording.size() - hole.end, embargo);
  for (const Segment& segment : record.segments) {
    if (segment.role == Role::test) continue;
    if (hole.begin == hole.end) {
      segments.push_back(segment);
      continue;
    }
    add(segment.begin, std::min(segment.end, before), segment.role);
    if (segment.role == Role::train)
      add(std::max(segment.begin, hole.begin), std::min(segment.end, hole.end), Role::test);
    add(std::max(segment.begin, after), segment.end, segment.role);
  }
  return segments;
}

Fold make_fold(const Dataset& dataset, std::string name, const std::vector<HeldOut>& holes,
               std::size_t embargo = 0) {
  Fold fold{.name = std::move(name), .recordings = {}, .segments = {}};
  for (std::size_t i = 0; i < dataset.records.size(); ++i) {
    const DatasetRecord& record = dataset.records[i];
    fold.segments.push_back(cut(record, holes[i], embargo));
    const std::size_t held_out = samples_with_role(fold.segments.back(), Role::test);
    if (held_out > 0) fold.recordings.push_back(record.recording.name());
    fold.held_out_samples += held_out;
  }
  return fold;
}

HeldOut whole(const DatasetRecord& record) { return {.begin = 0, .end = record.recording.size()}; }

/// Each record in shuffled order to the fold that has the fewest samples so far.
FoldPlan record_folds(const Dataset& dataset, const std::vector<std::size_t>& records,
                      std::size_t folds, std::uint64_t seed) {
  std::vector<std::size_t> order = records;
  Random random(seed);
  for (std::size_t i = order.size(); i > 1; --i) std::swap(order[i - 1], order[random.below(i)]);
  std::vector<std::size_t> samples(folds, 0);
  std::vector<std::vector<HeldOut>> holes(folds, std::vector<HeldOut>(dataset.records.size()));
  for (const std::size_t i : order) {
    const auto fold = static_cast<std::size_t>(std::ranges::min_element(samples) - samples.begin());
    samples[fold] += samples_with_role(dataset.records[i].segments, Role::train);
    holes[fold][i] = whole(dataset.records[i]);
  }
  FoldPlan plan{.label = fmt::format("{}-fold cross-validation over {} recordings, seed {}", folds,
                                     records.size(), seed),
                .folds = {}};
  for (std::size_t k = 0; k < folds; ++k)
    plan.folds.push_back(make_fold(dataset, fmt::format("fold {}", k + 1), holes[k]));
  return plan;
}

/// The sample number of the recording's `index`-th training sample.
std::size_t train_sample_at(const DatasetRecord& record, std::size_t index) {
  for (const Segment& segment : record.segments) {
    if (segment.role != Role::train) continue;
    if (index < segment.end - segment.begin) return segment.begin + index;
    index -= segment.end - segment.begin;
  }
  return record.recording.size();
}

FoldPlan block_folds(const Dataset& dataset, const std::vector<std::size_t>& records,
                     std::size_t folds, double embargo_s) {
  const auto embargo = static_cast<std::size_t>(std::ceil(embargo_s * dataset.sample_rate_Hz()));
  FoldPlan plan{.label = fmt::format("{} contiguous blocks within {} (fewer than folds), embargo "
                                     "{:g} s; a new recording may be harder",
                                     folds,
                                     records.size() == 1
                                         ? "one recording"
                                         : fmt::format("each of {} recordings", records.size()),
                                     embargo_s),
                .folds = {}};
  for (std::size_t k = 0; k < folds; ++k) {
    std::vector<HeldOut> holes(dataset.records.size());
    for (const std::size_t i : records) {
      const DatasetRecord& record = dataset.records[i];
      const std::size_t samples = samples_with_role(record.segments, Role::train);
      if (samples < folds)
        throw UsageError({.place = "--folds",
                          .expected = fmt::format("at most {}, the samples of {}", samples,
                                                  record.recording.name()),
                          .found = std::to_string(folds)});
      holes[i] = {.begin = train_sample_at(record, k * samples / folds),
                  .end = train_sample_at(record, (k + 1) * samples / folds)};
    }
    plan.folds.push_back(make_fold(dataset, fmt::format("fold {}", k + 1), holes, embargo));
  }
  return plan;
}

FoldPlan leave_one_record_out(const Dataset& dataset, const std::vector<std::size_t>& records) {
  if (records.size() < 2)
    throw UsageError({.place = "--by record",
                      .expected = "at least two recordings to train on",
                      .found = std::to_string(records.size()),
                      .advice = "--folds cuts a single recording into blocks."});
  FoldPlan plan{.label = fmt::format("leave one recording out, {} recordings", records.size()),
                .folds = {}};
  for (const std::size_t i : records) {
    std::vector<HeldOut> holes(dataset.records.size());
    holes[i] = whole(dataset.records[i]);
    plan.folds.push_back(make_fold(dataset, dataset.records[i].recording.name(), holes));
  }
  return plan;
}

bool is_constant(const Recording& recording, std::string_view channel) {
  if (!recording.has(channel)) return false;
  const std::vector<double>& values = recording.channel(channel).values;
  return !values.empty() && std::isfinite(values.front()) &&
         std::ranges::all_of(values, [&](double value) { return value == values.front(); });
}

/// The channels that are constant in every recording, by which folds can be made.
std::vector<std::string> conditions_of(const Dataset& dataset) {
  std::vector<std::string> names;
  for (const Channel& channel : dataset.records.front().recording.channels())
    if (channel.name != dataset.target &&
        std::ranges::all_of(dataset.records, [&](const DatasetRecord& record) {
          return is_constant(record.recording, channel.name);
        }))
      names.push_back(channel.name);
  return names;
}

FoldPlan leave_one_condition_out(const Dataset& dataset, const std::vector<std::size_t>& records,
                                 const std::string& condition) {
  const std::vector<std::string> known = conditions_of(dataset);
  if (std::ranges::find(known, condition) == known.end()) {
    std::vector<std::string> names = known;
    names.emplace_back(kByRecord);
    const std::string nearest = did_you_mean(condition, names);
    throw UsageError(
        {.place = "--by",
         .expected = known.empty()
                         ? "record; no channel is constant in every recording"
                         : fmt::format("record, or a condition: {}", fmt::join(known, ", ")),
         .found = '"' + condition + '"',
         .advice = nearest.empty()
                       ? "A manifest gives recordings conditions: conditions: {support_mm: 20}."
                       : nearest});
  }
  const auto value_of = [&](const DatasetRecord& record) {
    return record.recording.channel(condition).values.front();
  };
  std::map<double, std::size_t> values;  // value: recordings to train on
  for (const std::size_t i : records) ++values[value_of(dataset.records[i])];
  if (values.size() < 2)
    throw UsageError({.place = "--by " + condition,
                      .expected = "at least two values among the recordings to train on",
                      .found = fmt::format("{:g} in all of them", values.begin()->first),
                      .advice = "Use --by record or --folds."});
  FoldPlan plan{.label = fmt::format("leave one {} out, {} values over {} recordings", condition,
                                     values.size(), records.size()),
                .folds = {}};
  for (const auto& [value, count] : values) {
    std::vector<HeldOut> holes;
    for (const DatasetRecord& record : dataset.records)
      holes.push_back(value_of(record) == value ? whole(record) : HeldOut{});
    plan.folds.push_back(make_fold(dataset, fmt::format("{} = {:g}", condition, value), holes));
  }
  return plan;
}

/// A recording that is in two folds would be used for training and for scoring.
void refuse_duplicates(const Dataset& dataset, const std::vector<std::size_t>& records) {
  const auto is_same = [](double a, double b) {
    return std::bit_cast<std::uint64_t>(a) == std::bit_cast<std::uint64_t>(b);
  };
  for (std::size_t i = 0; i < records.size(); ++i)
    for (std::size_t j = 0; j < i; ++j) {
      const Recording& a = dataset.records[records[j]].recording;
      const Recording& b = dataset.records[records[i]].recording;
      // One file may hold several records.
      if (!a.source.sha256.empty() && a.source.sha256 == b.source.sha256 &&
          std::ranges::equal(a.channel(dataset.target).values, b.channel(dataset.target).values,
                             is_same))
        throw UsageError({.place = b.name(),
                          .problem =
                              "this recording is given twice: one fold would be trained on samples "
                              "that another is scored on",
                          .advice = "Name each recording once."});
    }
}

void refuse_empty_folds(const FoldPlan& plan, const FoldScheme& scheme) {
  const auto has_train = [](const std::vector<Segment>& segments) {
    return std::ranges::find(segments, Role::train, &Segment::role) != segments.end();
  };
  for (const Fold& fold : plan.folds)
    if (std::ranges::none_of(fold.segments, has_train))
      throw UsageError(
          {.place = fold.name,
           .problem = "no sample is left to train on",
           .expected = fmt::format("blocks longer than the embargo of {:g} s", scheme.embargo_s),
           .advice = "Use a shorter --embargo, or more or longer recordings."});
}

}  // namespace

FoldPlan plan_folds(const Dataset& dataset, const FoldScheme& scheme, std::uint64_t seed) {
  dataset.check();
  const std::vector<std::size_t> records = train_records(dataset);
  if (records.empty())
    throw UsageError({.problem = "nothing to make folds of: no recording has the role train"});
  if (!(scheme.embargo_s >= 0.0) || !std::isfinite(scheme.embargo_s))
    throw UsageError({.place = "--embargo",
                      .expected = "a time of at least 0 s",
                      .found = fmt::format("{} s", scheme.embargo_s)});
  refuse_duplicates(dataset, records);
  if (scheme.by == kByRecord) return leave_one_record_out(dataset, records);
  if (!scheme.by.empty()) return leave_one_condition_out(dataset, records, scheme.by);
  if (scheme.folds < 2)
    throw UsageError(
        {.place = "--folds", .expected = "at least 2", .found = std::to_string(scheme.folds)});
  if (records.size() >= scheme.folds) return record_folds(dataset, records, scheme.folds, seed);
  FoldPlan plan = block_folds(dataset, records, scheme.folds, scheme.embargo_s);
  refuse_empty_folds(plan, scheme);
  return plan;
}

}  // namespace torsio

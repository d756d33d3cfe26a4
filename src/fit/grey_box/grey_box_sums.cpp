#include "fit/grey_box/grey_box_sums.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "fit/common/folds.hpp"
#include "fit/common/least_samples.hpp"
#include "fit/common/usable_table.hpp"
#include "fit/grey_box/sample_range.hpp"
#include "torsio/core/error.hpp"

namespace torsio {
namespace {

constexpr std::size_t kMaxSummed = 100000;  // rows; of more every n-th is taken
constexpr std::size_t kLevelsToLeaveOut = 3;

/// [lowest, highest] first input. @throws Error if that range is empty, or has few samples.
std::pair<double, double> range_of(const TrainingData& data) {
  double low = std::numeric_limits<double>::infinity();
  double high = -std::numeric_limits<double>::infinity();
  std::size_t samples = 0;
  for_each_usable(data, [&](Features features, double) {
    low = std::min(low, features[0]);
    high = std::max(high, features[0]);
    ++samples;
  });
  if (!(high > low))
    throw Error({.problem = "a grey box needs a first input that varies",
                 .found = data.inputs[0].expression + " is constant in the training data"});
  if (samples < kLeastGreyBoxSamples)
    throw Error({.problem = "too few training samples for a grey box",
                 .expected = fmt::format("at least {}", kLeastGreyBoxSamples),
                 .found = fmt::format("{}", samples)});
  return {low, high};
}

/// From four samples to a quarter of the longest record.
std::vector<double> time_constants(const TrainingData& data) {
  std::size_t longest = 0;
  for (const Sequence& sequence : data.sequences)
    longest = std::max(longest, sequence.target.size());
  const double period_s = 1.0 / data.sample_rate_Hz;
  const double fastest_s = 4.0 * period_s;
  const double slowest_s =
      std::max(0.25 * static_cast<double>(longest) * period_s, 2.0 * fastest_s);
  std::vector<double> all_s;
  for (std::size_t i = 0; i < GreyBoxSums::kTimeConstants; ++i)
    all_s.push_back(fastest_s * std::pow(slowest_s / fastest_s,
                                         static_cast<double>(i) /
                                             static_cast<double>(GreyBoxSums::kTimeConstants - 1)));
  return all_s;
}

/// Rates at which dry friction is taken to have turned: a share of their root mean square.
std::vector<double> rate_scales(const TrainingData& data, double share) {
  std::vector<double> squares(data.input_count(), 0.0);
  std::size_t samples = 0;
  for_each_usable(data, [&](Features features, double) {
    for (std::size_t j = 0; j < squares.size(); ++j) squares[j] += features[j] * features[j];
    ++samples;
  });
  std::vector<double> scales(data.input_count(), 0.0);
  for (std::size_t j = 0; j < scales.size(); ++j)
    if (data.inputs[j].is_rate)
      scales[j] = share * std::sqrt(squares[j] / static_cast<double>(samples));
  return scales;
}

GreyBoxTerms::Structure finest(const TrainingData& data, double rate_share) {
  GreyBoxTerms::Structure all;
  const auto [low, high] = range_of(data);
  all.sample_period_s = 1.0 / data.sample_rate_Hz;
  all.curve_knots = all.friction_knots = evenly(low, high, GreyBoxSums::kKnots);
  const double half = 0.5 * (high - low);
  for (std::size_t i = GreyBoxSums::kThresholds; i-- > 0;)
    all.thresholds.push_back(half * std::exp2(-static_cast<double>(i + 1)));
  all.time_constants_s = time_constants(data);
  all.rate_scales = rate_scales(data, rate_share);
  return all;
}

std::size_t usable_samples(const Sequence& sequence) {
  return static_cast<std::size_t>(std::ranges::count(sequence.use, 1));
}

/// Records in turn, blocks, or the schedule's inner knots.
void choose_folds(GreyBoxSums& sums, const TrainingData& data) {
  for (const Sequence& sequence : data.sequences)
    if (usable_samples(sequence) > 0) ++sums.records;
  sums.is_by_record = sums.levels == 1 && sums.records > 1;
  sums.folds = sums.levels >= kLevelsToLeaveOut ? 1
               : sums.is_by_record              ? std::min(sums.records, 2 * kFolds)
                                                : kFolds;
}

/// Adds one row of terms to their products.
class RowSum {
 public:
  void add(NormalEquations& sums, const GreyBoxTerms& terms, Features features, double target) {
    row_.clear();
    terms.visit(features, [&](std::size_t column, double value) {
      if (value != 0.0) row_.emplace_back(column, value);
    });
    for (const auto& [i, a] : row_) {
      for (const auto& [j, b] : row_) sums.product(i, j) += a * b;
      sums.projection[i] += a * target;
    }
    sums.square += target * target;
    ++sums.rows;
  }

 private:
  std::vector<std::pair<std::size_t, double>> row_;  ///< what is not 0
};

/// A sample in use.
struct Place {
  std::size_t sequence = 0;
  std::size_t sample = 0;  ///< its place in the sequence
  std::size_t record = 0;  ///< among those that are used
  std::size_t used = 0;    ///< place among the `usable` samples of its record
  std::size_t usable = 0;
};

std::size_t fold_of(const GreyBoxSums& sums, const Place& place) {
  if (sums.folds == 1) return 0;
  if (!sums.kinds.empty()) return sums.kinds[place.sequence][place.sample];
  if (sums.is_by_record) return place.record % sums.folds;
  return sums.is_by_span ? place.used * sums.folds / place.usable
                         : interleaved_fold(place.used, place.usable);
}

/// Range of the first input in all samples but those of each fold.
std::vector<SampleRange> ranges_of_others(const GreyBoxSums& sums, const TrainingData& data) {
  std::vector<SampleRange> ranges(sums.folds);
  std::size_t record = 0;
  for (std::size_t s = 0; s < data.sequences.size(); ++s) {
    const Sequence& sequence = data.sequences[s];
    const std::size_t usable = usable_samples(sequence);
    if (usable == 0) continue;
    for (std::size_t n = 0, used = 0; n < sequence.use.size(); ++n) {
      if (sequence.use[n] == 0) continue;
      const std::size_t own = fold_of(sums, {s, n, record, used++, usable});
      for (std::size_t fold = 0; fold < sums.folds; ++fold)
        if (fold != own) ranges[fold].take(sequence.features(n, 0));
    }
    ++record;
  }
  return ranges;
}

void add_data(GreyBoxSums& sums, const TrainingData& data) {
  const std::vector<SampleRange> others =
      sums.beyond.empty() ? std::vector<SampleRange>{} : ranges_of_others(sums, data);
  const std::size_t stride = (sums.samples + kMaxSummed - 1) / kMaxSummed;
  RowSum row;
  std::size_t record = 0;
  std::size_t used = 0;
  for (std::size_t s = 0; s < data.sequences.size(); ++s) {
    const Sequence& sequence = data.sequences[s];
    GreyBoxTerms terms(sums.all);
    std::size_t own = 0;
    const std::size_t usable = usable_samples(sequence);
    for (std::size_t n = 0; n < sequence.target.size(); ++n) {
      if (!sequence.has_features(n)) continue;
      const Features features = sequence.features.row(n);
      terms.move(features);
      if (sequence.use[n] == 0) continue;
      const bool is_in_gap = !sums.gap.empty() && is_next_to_border(own, usable);
      const std::size_t fold = fold_of(sums, {s, n, record, own, usable});
      ++own;
      if (used++ % stride != 0) continue;
      const std::size_t level = knot_at(sums.frame, features);
      row.add(is_in_gap ? sums.gap[level] : sums.cells[level * sums.folds + fold], terms, features,
              sequence.target[n]);
      if (!others.empty() && !others[fold].holds(features[0]))
        row.add(sums.beyond[fold], terms, features, sequence.target[n]);
    }
    if (usable > 0) ++record;
  }
}

}  // namespace

void add(NormalEquations& sum, const NormalEquations& part, double sign) {
  for (std::size_t i = 0; i < sum.product.values.size(); ++i)
    sum.product.values[i] += sign * part.product.values[i];
  for (std::size_t i = 0; i < sum.projection.size(); ++i)
    sum.projection[i] += sign * part.projection[i];
  sum.square += sign * part.square;
  sum.rows = sign > 0.0 ? sum.rows + part.rows : sum.rows - part.rows;
}

namespace {

GreyBoxSums sums_of(const TrainingData& data, CoefficientSchedule frame,
                    GreyBoxTerms::Structure all, bool with_gap, bool is_by_span = false,
                    const StrokeKinds* strokes = nullptr) {
  const std::size_t levels = std::max<std::size_t>(frame.knots.size(), 1);
  GreyBoxSums sums{.all = std::move(all),
                   .is_rate = {},
                   .frame = std::move(frame),
                   .levels = levels,
                   .cells = {},
                   .beyond = {},
                   .gap = {},
                   .samples = data.usable_samples()};
  for (const auto& input : data.inputs) sums.is_rate.push_back(input.is_rate ? 1 : 0);
  choose_folds(sums, data);
  sums.is_by_span = is_by_span && sums.levels == 1 && !sums.is_by_record;
  if (strokes != nullptr) {
    sums.folds = strokes->count;
    sums.kinds = strokes->kinds;
  }
  const NormalEquations none(sums.all.columns());
  sums.cells.assign(sums.levels * sums.folds, none);
  if (sums.is_by_record || sums.is_by_span || strokes != nullptr) sums.beyond = sums.cells;
  if (with_gap && !sums.is_by_record && sums.folds > 1) sums.gap.assign(sums.levels, none);
  add_data(sums, data);
  return sums;
}

}  // namespace

GreyBoxSums gather(const TrainingData& data, const std::string& schedule, double rate_share) {
  return sums_of(data, schedule_frame(schedule, data), finest(data, rate_share), false);
}

GreyBoxSums gather_banks(const TrainingData& data, const std::string& schedule,
                         const GreyBoxTerms::Structure& chosen) {
  CoefficientSchedule frame = schedule_frame(schedule, data);
  GreyBoxTerms::Structure all = chosen;
  all.banks = finest_banks(data, frame.scheduled ? frame.feature : 0);
  GreyBoxSums sums = sums_of(data, std::move(frame), std::move(all), true);
  sums.is_main_chosen = true;
  return sums;
}

std::size_t strokes_of(const TrainingData& data) {
  const auto [low, high] = range_of(data);
  const double lower = low + (high - low) / 3.0;
  const double upper = high - (high - low) / 3.0;
  std::size_t strokes = 0;
  int side = 0;
  for_each_usable(data, [&](Features features, double) {
    const int now = features[0] < lower ? -1 : features[0] > upper ? 1 : 0;
    if (now == 0 || now == side) return;
    if (side != 0) ++strokes;
    side = now;
  });
  return strokes;
}

GreyBoxSums gather_spans(const TrainingData& data, const GreyBoxTerms::Structure& chosen) {
  GreyBoxSums sums = sums_of(data, {}, chosen, false, true);
  sums.is_main_chosen = true;
  return sums;
}

GreyBoxSums gather_strokes(const TrainingData& data, const GreyBoxTerms::Structure& chosen,
                           const StrokeKinds& strokes) {
  GreyBoxSums sums = sums_of(data, {}, chosen, false, false, &strokes);
  sums.is_main_chosen = sums.are_banks_chosen = true;
  return sums;
}

GreyBoxSums gather_strokes(const TrainingData& data, double rate_share,
                           const StrokeKinds& strokes) {
  return sums_of(data, {}, finest(data, rate_share), false, false, &strokes);
}

GreyBoxSums gather_beside(const TrainingData& data, const std::string& schedule, double rate_share,
                          const std::vector<InputBank>& banks) {
  GreyBoxTerms::Structure all = finest(data, rate_share);
  all.banks = banks;
  GreyBoxSums sums = sums_of(data, schedule_frame(schedule, data), std::move(all), true);
  sums.are_banks_chosen = true;
  return sums;
}

}  // namespace torsio

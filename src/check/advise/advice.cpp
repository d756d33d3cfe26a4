#include "torsio/check/advise/advice.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <set>
#include <utility>

#include "check/advise/adviser.hpp"
#include "check/signal_pair.hpp"
#include "core/report_progress.hpp"
#include "data/finest_step.hpp"
#include "torsio/fit/train_model.hpp"

namespace torsio {
namespace {

constexpr double kDeadBandShare = 0.03;  // share of the first input's range
constexpr double kDeadBandCodes = 2.5;
constexpr std::size_t kLeastStrokes = 10;
constexpr std::size_t kMaxBlocks = 1000;
constexpr int kSmallerByDefault = 2;  // levels of amplitude below the largest
constexpr double kFasterThanRecorded = 1.3;
constexpr double kSideWeight = 0.5;  // the weight of a region off the centre

/// The standard deviation of the target's noise, from second differences of successive new samples;
/// the median leaves out fast motion.
double noise_of(const TrainingData& data) {
  std::vector<double> bends;
  for (const Sequence& sequence : data.sequences) {
    double before = kNotMeasured;
    double last = kNotMeasured;
    for (std::size_t n = 0; n < sequence.target.size(); ++n) {
      if (sequence.use[n] == 0) continue;
      const double value = sequence.target[n];
      if (std::isfinite(before)) bends.push_back(std::abs(value - 2.0 * last + before));
      before = std::exchange(last, value);
    }
  }
  if (bends.size() < 10) return kNotMeasured;
  const auto middle = bends.begin() + static_cast<std::ptrdiff_t>(bends.size() / 2);
  std::ranges::nth_element(bends, middle);
  constexpr double kMedianOfNormal = 0.6745;
  return *middle / (kMedianOfNormal * std::sqrt(6.0));
}

}  // namespace

Advice Adviser::run() {
  data_ = learning_data(dataset_, spec_).training;
  advice_.target_noise = noise_of(data_);
  conditions_ = conditions_of(dataset_);
  find_strokes();
  choose_range();
  if (total_strokes() < kLeastStrokes) {
    undetermined(fmt::format(
        "all errors: the recordings have {} strokes of {} from one reversal to the next with an "
        "amplitude of at least {:.2g} {}, and at least {} are needed. Record {} first",
        total_strokes(), advice_.input, grid_.smallest_amplitude(), x_unit_, kLeastStrokes,
        motion_text({.amplitude = rounded(0.5 * (advice_.highest - advice_.lowest)),
                     .centre = 0.5 * (advice_.highest + advice_.lowest),
                     .frequency_Hz = 0.2},
                    60.0)));
    return std::move(advice_);
  }
  const QuickModel model(data_, conditions_, grid_.middle - grid_.half_range,
                         grid_.middle + grid_.half_range);
  const RegionErrors errors(model, blocks(model), progress_);
  slope_ = errors.linear_slope() / grid_.half_range;
  list_regions(errors);
  const ExpectedError expected(errors);
  choose_use(expected.covered());
  propose_motions(errors, expected);
  propose_conditions(errors);
  learning_curve(errors);
  find_limits(errors);
  report_undetermined();
  rank();
  return std::move(advice_);
}

std::size_t Adviser::total_strokes() const {
  std::size_t count = 0;
  for (const auto& strokes : strokes_)
    count += static_cast<std::size_t>(std::ranges::count_if(
        strokes, [&](const Stroke& stroke) { return !grid_.is_rest(stroke); }));
  return count;
}

// Reversals by noise or by single codes of an encoder are not strokes.
void Adviser::find_strokes() {
  Extent range;
  std::vector<std::vector<double>> inputs;
  for (const Sequence& sequence : data_.sequences) {
    std::vector<double> input(sequence.target.size());
    for (std::size_t n = 0; n < input.size(); ++n) {
      input[n] = sequence.features(n, 0);
      if (sequence.use[n] != 0) range.include(input[n]);
    }
    inputs.push_back(std::move(input));
  }
  recorded_ = {.quantity = "input", .lowest = range.lowest, .highest = range.highest};
  for (const std::vector<double>& input : inputs)
    strokes_.push_back(strokes_of(
        input, std::max(kDeadBandShare * range.width(), kDeadBandCodes * finest_step(input)),
        data_.sample_rate_Hz));
}

void Adviser::choose_range() {
  const WantedRange* range = wanted("input");
  advice_.lowest = range != nullptr ? range->lowest : recorded_.lowest;
  advice_.highest = range != nullptr ? range->highest : recorded_.highest;
  const double lowest = std::min(advice_.lowest, recorded_.lowest);
  const double highest = std::max(advice_.highest, recorded_.highest);
  grid_ = {.middle = 0.5 * (lowest + highest), .half_range = 0.5 * (highest - lowest)};
}

std::vector<Block> Adviser::blocks(const QuickModel& model) {
  std::size_t samples = 0;
  for (const Sequence& sequence : data_.sequences) samples += sequence.target.size();
  const std::size_t shortest = samples / kMaxBlocks;
  std::vector<Block> all;
  for (std::size_t r = 0; r < strokes_.size(); ++r) {
    std::vector<std::size_t> ends;
    std::vector<Block> of_recording;
    std::size_t begin = 0;
    for (const Stroke& stroke : strokes_[r]) {
      const bool is_motion = !grid_.is_rest(stroke);
      const RegionKey key = is_motion ? grid_.key_of(stroke) : RegionKey{};
      const bool is_merged = !of_recording.empty() && ends.back() - begin < shortest &&
                             of_recording.back().is_motion == is_motion &&
                             of_recording.back().region == key;
      if (!is_merged) {
        begin = stroke.begin;
        ends.push_back(stroke.end);
        of_recording.push_back({.recording = r,
                                .is_motion = is_motion,
                                .region = key,
                                .strokes = 0,
                                .sums = BlockSums(model.columns())});
      }
      ends.back() = stroke.end;
      of_recording.back().strokes += is_motion ? 1 : 0;
    }
    report_progress(progress_, 0.0, "which recording is missing");
    std::vector<BlockSums> sums = model.blocks(data_, r, ends);
    for (std::size_t b = 0; b < of_recording.size(); ++b) {
      of_recording[b].sums = std::move(sums[b]);
      if (of_recording[b].sums.samples() > 0) all.push_back(std::move(of_recording[b]));
    }
  }
  return all;
}

void Adviser::list_regions(const RegionErrors& errors) {
  std::map<RegionKey, double> durations;
  for (const auto& strokes : strokes_)
    for (const Stroke& stroke : strokes) {
      if (grid_.is_rest(stroke)) continue;
      durations[grid_.key_of(stroke)] +=
          static_cast<double>(stroke.end - stroke.begin) / data_.sample_rate_Hz;
      fastest_ = std::max(fastest_, stroke.speed());
    }
  const RegionErrors::Errors all = errors.all_held_out();
  std::vector<std::pair<double, RegionKey>> order;
  for (const auto& [key, region] : errors.held_out()) order.emplace_back(-region.square_sum, key);
  std::ranges::sort(order);
  for (const auto& [negative, key] : order) {
    const RegionErrors::Errors& region = errors.held_out().at(key);
    region_index_[key] = advice_.regions.size();
    advice_.regions.push_back(
        {.motion = grid_.motion(key),
         .strokes = region.strokes,
         .duration_s = durations[key],
         .sample_share = static_cast<double>(region.samples) / static_cast<double>(all.samples),
         .error_share = all.square_sum > 0.0 ? region.square_sum / all.square_sum : 0.0,
         .held_out_rmse = region.blocks > 1 ? std::sqrt(region.mean_square()) : kNotMeasured});
  }
}

void Adviser::choose_use(const ExpectedError::Covered& covered) {
  const int first = grid_.amplitude_level(0.5 * (advice_.highest - advice_.lowest));
  int last = first + kSmallerByDefault;
  int slowest = std::numeric_limits<int>::max();
  int fastest = std::numeric_limits<int>::min();
  for (const auto& [key, error] : covered) {
    last = std::max(last, key.amplitude);
    slowest = std::min(slowest, key.frequency);
    fastest = std::max(fastest, key.frequency);
  }
  last = std::min(last, kSmallestAmplitude);
  if (const WantedRange* range = wanted("frequency")) {
    slowest = RegionGrid::frequency_level(range->lowest);
    fastest = RegionGrid::frequency_level(range->highest * (1.0 - 1e-9));
    lowest_Hz_ = range->lowest;
    highest_Hz_ = range->highest;
  } else {
    lowest_Hz_ = RegionGrid::lowest_frequency_Hz(slowest);
    highest_Hz_ = RegionGrid::lowest_frequency_Hz(fastest + 1);
  }
  if (const WantedRange* speed = wanted("speed"))
    speed_limit_ = speed->highest;
  else if (wanted("frequency") == nullptr)
    speed_limit_ =
        kFasterThanRecorded * fastest_ *
        std::max(1.0, (advice_.highest - advice_.lowest) / (recorded_.highest - recorded_.lowest));
  for (int amplitude = first; amplitude <= last; ++amplitude)
    for (int frequency = slowest; frequency <= fastest; ++frequency)
      for (int centre = amplitude > 0 ? -1 : 0; centre <= (amplitude > 0 ? 1 : 0); ++centre) {
        const RegionKey key{amplitude, frequency, centre};
        const TriangleMotion motion = realisable(key);
        const bool is_inside = motion.centre - motion.amplitude >= advice_.lowest - slack() &&
                               motion.centre + motion.amplitude <= advice_.highest + slack();
        if (!is_inside || (motion.speed() > speed_limit_ && !covered.contains(key))) continue;
        use_[key] = centre == 0 ? 1.0 : kSideWeight;
      }
  advice_.lowest_Hz = lowest_Hz_;
  advice_.highest_Hz = highest_Hz_;
  advice_.highest_speed = speed_limit_;
  for (const auto& [key, index] : region_index_)
    advice_.regions[index].is_wanted = use_.contains(key);
}

TriangleMotion Adviser::realisable(const RegionKey& key) const {
  TriangleMotion motion = grid_.motion(key);
  motion.frequency_Hz = std::clamp(motion.frequency_Hz, lowest_Hz_, highest_Hz_);
  const double slowest = std::max(RegionGrid::lowest_frequency_Hz(key.frequency), lowest_Hz_);
  const double limit = speed_limit_ / (4.0 * motion.amplitude);
  if (motion.frequency_Hz > limit) motion.frequency_Hz = std::max(limit, slowest);
  return motion;
}

double Adviser::mean_square_of_use(const ExpectedError& expected,
                                   const ExpectedError::Covered& covered,
                                   const std::set<RegionKey>* known) const {
  double sum = 0.0;
  double weights = 0.0;
  for (const auto& [key, weight] : use_) {
    if (known != nullptr && !known->contains(key)) continue;
    sum += weight * expected.at(key, covered).mean_square;
    weights += weight;
  }
  return weights > 0.0 ? sum / weights : kNotMeasured;
}

Advice advise(const Dataset& dataset, const FeatureSpec& spec,
              const std::vector<WantedRange>& wanted, const Progress& progress) {
  return Adviser(dataset, spec, wanted, progress).run();
}

}  // namespace torsio

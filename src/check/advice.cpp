#include "torsio/check/advice.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <optional>
#include <set>
#include <utility>

#include "check/condition_advice.hpp"
#include "check/expected_error.hpp"
#include "check/quick_model.hpp"
#include "check/region_errors.hpp"
#include "check/signal_pair.hpp"
#include "check/strokes.hpp"
#include "core/report_progress.hpp"
#include "data/finest_step.hpp"
#include "torsio/core/units.hpp"
#include "torsio/fit/common/training_data.hpp"
#include "torsio/fit/train_model.hpp"

namespace torsio {
namespace {

constexpr double kDeadBandShare = 0.03;  // share of the first input's range
constexpr double kDeadBandCodes = 2.5;
constexpr std::size_t kLeastStrokes = 10;
constexpr std::size_t kMaxBlocks = 1000;
constexpr std::size_t kMaxHalved = 12;  // regions with a learning curve of their own
constexpr int kSmallerByDefault = 2;    // levels of amplitude below the largest
constexpr double kFasterThanRecorded = 1.3;
constexpr double kSideWeight = 0.5;        // the weight of a region off the centre
constexpr double kWorthMentioning = 0.01;  // share of the RMSE
constexpr double kClearGain = 0.05;
constexpr std::size_t kMaxMotions = 4;
constexpr std::size_t kMaxProposals = 5;
constexpr double kCycles = 12.0;
constexpr double kShortest_s = 20.0;
constexpr double kLongest_s = 300.0;
constexpr double kLongHold_s = 5.0;
constexpr double kManyTimes = 3.0;
constexpr double kRecordingsDiffer = 2.0;  // ratio of squared errors

/// Two significant digits.
double rounded(double value) {
  if (value == 0.0 || !std::isfinite(value)) return value;
  const double scale = std::pow(10.0, 1.0 - std::floor(std::log10(std::abs(value))));
  return std::round(value * scale) / scale;
}

std::string percent(double share) { return fmt::format("{:.0f} %", 100.0 * share); }

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

/// The strokes of every recording, in its order.
using AllStrokes = std::vector<std::vector<Stroke>>;

class Adviser {
 public:
  Adviser(const Dataset& dataset, const FeatureSpec& spec, const std::vector<WantedRange>& wanted,
          const Progress& progress)
      : dataset_(dataset), spec_(spec), wanted_(wanted), progress_(progress) {
    advice_.input = spec.inputs.front();
    advice_.target = dataset.target;
    x_unit_ = unit_label(spec.inputs.front());
    y_unit_ = unit_label(dataset.target);
  }

  Advice run() {
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

 private:
  void undetermined(std::string text) { advice_.undetermined.push_back(std::move(text)); }

  [[nodiscard]] const WantedRange* wanted(std::string_view quantity) const {
    const auto at = std::ranges::find(wanted_, quantity, &WantedRange::quantity);
    return at == wanted_.end() ? nullptr : &*at;
  }

  [[nodiscard]] std::size_t total_strokes() const {
    std::size_t count = 0;
    for (const auto& strokes : strokes_)
      count += static_cast<std::size_t>(std::ranges::count_if(
          strokes, [&](const Stroke& stroke) { return !grid_.is_rest(stroke); }));
    return count;
  }

  // Reversals by noise or by single codes of an encoder are not strokes.
  void find_strokes() {
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

  void choose_range() {
    const WantedRange* range = wanted("input");
    advice_.lowest = range != nullptr ? range->lowest : recorded_.lowest;
    advice_.highest = range != nullptr ? range->highest : recorded_.highest;
    const double lowest = std::min(advice_.lowest, recorded_.lowest);
    const double highest = std::max(advice_.highest, recorded_.highest);
    grid_ = {.middle = 0.5 * (lowest + highest), .half_range = 0.5 * (highest - lowest)};
  }

  std::vector<Block> blocks(const QuickModel& model) {
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

  void list_regions(const RegionErrors& errors) {
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

  /// The regions of the intended use with their weights.
  void choose_use(const ExpectedError::Covered& covered) {
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
      speed_limit_ = kFasterThanRecorded * fastest_ *
                     std::max(1.0, (advice_.highest - advice_.lowest) /
                                       (recorded_.highest - recorded_.lowest));
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

  [[nodiscard]] double slack() const { return 0.1 * grid_.half_range; }

  /// The region's motion within the wanted frequencies and, where its slow half suffices, speeds.
  [[nodiscard]] TriangleMotion realisable(const RegionKey& key) const {
    TriangleMotion motion = grid_.motion(key);
    motion.frequency_Hz = std::clamp(motion.frequency_Hz, lowest_Hz_, highest_Hz_);
    const double slowest = std::max(RegionGrid::lowest_frequency_Hz(key.frequency), lowest_Hz_);
    const double limit = speed_limit_ / (4.0 * motion.amplitude);
    if (motion.frequency_Hz > limit) motion.frequency_Hz = std::max(limit, slowest);
    return motion;
  }

  /// Mean over the intended use. @param known the regions that count; null: all
  [[nodiscard]] double mean_square_of_use(const ExpectedError& expected,
                                          const ExpectedError::Covered& covered,
                                          const std::set<RegionKey>* known = nullptr) const {
    double sum = 0.0;
    double weights = 0.0;
    for (const auto& [key, weight] : use_) {
      if (known != nullptr && !known->contains(key)) continue;
      sum += weight * expected.at(key, covered).mean_square;
      weights += weight;
    }
    return weights > 0.0 ? sum / weights : kNotMeasured;
  }

  [[nodiscard]] static double duration_of(const TriangleMotion& motion) {
    return rounded(std::clamp(kCycles / motion.frequency_Hz, kShortest_s, kLongest_s));
  }

  void propose_motions(const RegionErrors& errors, const ExpectedError& expected) {
    if (use_.empty()) {
      undetermined(
          fmt::format("the missing motion: every motion of the intended use is faster than "
                      "{:.2g} {}/s, or too small. State another --want speed, frequency "
                      "or input",
                      speed_limit_, x_unit_));
      return;
    }
    std::map<RegionKey, double> decreases;
    for (const auto& [key, index] : region_index_)  // the first ones have most of the error
      if (index < kMaxHalved && expected.covered().contains(key) && use_.contains(key))
        decreases[key] = errors.decrease(key);
    ExpectedError::Covered covered = expected.covered();
    std::set<RegionKey> known;
    for (const auto& [key, weight] : use_)
      if (expected.at(key, covered).is_known) known.insert(key);
    advice_.wanted_rmse = std::sqrt(mean_square_of_use(expected, covered, &known));
    std::set<RegionKey> proposed;
    for (std::size_t count = 0; count < kMaxMotions; ++count) {
      const double before = mean_square_of_use(expected, covered);
      double least = before;
      std::optional<RegionKey> best;
      ExpectedError::Covered best_covered;
      for (const auto& [key, weight] : use_) {
        if (proposed.contains(key)) continue;
        ExpectedError::Covered after = covered;
        after[key] = expected.at(key, covered).afterwards - gain_of_more(key, decreases);
        if (const double then = mean_square_of_use(expected, after); then < least)
          least = then, best = key, best_covered = std::move(after);
      }
      const double reduction = best ? 1.0 - std::sqrt(least / before) : 0.0;
      if (reduction < kWorthMentioning) break;
      add_motion(errors, expected, *best, covered);
      Proposal& proposal = advice_.proposals.back();
      proposal.assumed_reduction = reduction;
      if (known.contains(*best))
        proposal.expected_reduction =
            1.0 - std::sqrt(mean_square_of_use(expected, best_covered, &known) /
                            mean_square_of_use(expected, covered, &known));
      proposed.insert(*best);
      covered = std::move(best_covered);
    }
  }

  /// By how much the squared error in a covered region falls with a recording of the usual length.
  [[nodiscard]] double gain_of_more(const RegionKey& key,
                                    const std::map<RegionKey, double>& decreases) const {
    const auto at = decreases.find(key);
    if (at == decreases.end()) return 0.0;
    const TriangleMotion motion = realisable(key);
    const double more = 2.0 * motion.frequency_Hz * duration_of(motion);
    return at->second * more / (more + static_cast<double>(region_of(key).strokes));
  }

  [[nodiscard]] const Region& region_of(const RegionKey& key) const {
    return advice_.regions[region_index_.at(key)];
  }

  [[nodiscard]] std::string motion_text(const TriangleMotion& motion, double duration_s) const {
    std::string text = fmt::format("triangles of +-{:.2g} {}", motion.amplitude, x_unit_);
    if (std::abs(motion.centre) > 0.05 * motion.amplitude)
      text += fmt::format(" about {:.2g} {}", motion.centre, x_unit_);
    if (slope_ != 0.0)
      text += fmt::format(" (about +-{:.2g} {})", std::abs(slope_) * motion.amplitude, y_unit_);
    text += fmt::format(" at {:.2g} Hz, that is {:.2g} {}/s, for {:.0f} s", motion.frequency_Hz,
                        motion.speed(), x_unit_, duration_s);
    return text;
  }

  /// The motion of a region with numbers that are easy to set.
  [[nodiscard]] TriangleMotion settable(const RegionKey& key) const {
    TriangleMotion motion = realisable(key);
    if (key.amplitude > 0) motion.amplitude = rounded(motion.amplitude);
    motion.centre = rounded(motion.centre);
    if (std::abs(motion.centre) < 0.05 * grid_.half_range) motion.centre = 0.0;
    motion.frequency_Hz = rounded(motion.frequency_Hz);
    return motion;
  }

  void add_motion(const RegionErrors& errors, const ExpectedError& expected, const RegionKey& key,
                  const ExpectedError::Covered& covered) {
    const TriangleMotion motion = settable(key);
    const double duration_s = duration_of(motion);
    std::string reason;
    if (expected.covered().contains(key)) {
      const Region& region = region_of(key);
      reason = fmt::format(
          "this region has {} of the samples and {} of the squared error of the held-out folds "
          "({:.3g} {} over {} strokes), and the error rises when half of its strokes are left out",
          percent(region.sample_share), percent(region.error_share), region.held_out_rmse, y_unit_,
          region.strokes);
    } else {
      const ExpectedError::Value now = expected.at(key, covered);
      const auto found = errors.held_out().find(key);
      const std::size_t strokes = found == errors.held_out().end() ? 0 : found->second.strokes;
      reason = fmt::format("{} of the recorded strokes are of this kind; ",
                           strokes == 0 ? "none" : std::to_string(strokes));
      reason += fmt::format("{}", fmt::join(expected.growth_texts(now.nearest, key), "; "));
    }
    advice_.proposals.push_back({.recording = motion_text(motion, duration_s),
                                 .reason = std::move(reason),
                                 .motion = motion,
                                 .duration_s = duration_s});
  }

  void propose_conditions(const RegionErrors& errors) {
    for (const ConditionValues& condition : conditions_) {
      ConditionAdvice found = advise_on_condition(condition, wanted(condition.name), errors);
      for (Proposal& proposal : found.proposals) {
        proposal.duration_s = rounded(recorded_s() / static_cast<double>(data_.sequences.size()));
        advice_.proposals.push_back(std::move(proposal));
      }
      for (std::string& text : found.undetermined) undetermined(std::move(text));
    }
    for (const WantedRange& range : wanted_) {
      const bool is_motion =
          range.quantity == "input" || range.quantity == "frequency" || range.quantity == "speed";
      if (!is_motion && std::ranges::find(conditions_, range.quantity, &ConditionValues::name) ==
                            conditions_.end())
        undetermined(
            fmt::format("{}: not every training recording has it. List it under "
                        "conditions: in a manifest",
                        range.quantity));
    }
  }

  [[nodiscard]] double recorded_s() const {
    double seconds = 0.0;
    for (const Sequence& sequence : data_.sequences)
      seconds += static_cast<double>(sequence.target.size()) / data_.sample_rate_Hz;
    return seconds;
  }

  void learning_curve(const RegionErrors& errors) {
    advice_.learning_curve = errors.learning_curve();
    const double share = errors.decrease_of_all();  // b over E(n)
    if (!std::isfinite(share)) {
      undetermined(
          "whether more of the same motion helps: a learning curve needs at least 16 "
          "strokes");
      return;
    }
    advice_.same_again_reduction = 1.0 - std::sqrt(1.0 - 0.5 * share);
    // As long as the first proposal, for a fair comparison.
    const double first_s =
        advice_.proposals.empty() ? recorded_s() : advice_.proposals.front().duration_s;
    const double reduction = 1.0 - std::sqrt(1.0 - share * first_s / (first_s + recorded_s()));
    if (reduction >= kWorthMentioning)
      advice_.proposals.push_back(
          {.recording = fmt::format("the same motions again, for {:.0f} s", rounded(first_s)),
           .reason = fmt::format("with half of every region in the training the RMSE is larger, "
                                 "so that the amount of data limits it: twice as much lowers it "
                                 "by {}",
                                 percent(advice_.same_again_reduction)),
           .motion = std::nullopt,
           .duration_s = rounded(first_s),
           .expected_reduction = reduction,
           .assumed_reduction = reduction});
  }

  void find_limits(const RegionErrors& errors) {
    const ErrorRatio between = errors.between_recordings();
    if (between.strokes > 0) advice_.between_recordings = between.ratio;
    if (between.is_clear && between.ratio > kRecordingsDiffer)
      advice_.limits.push_back(fmt::format(
          "the recordings differ at equal motion: on a recording that is left out the RMSE is "
          "{:.2g} times that with a part of it in the training. A quantity that is not among the "
          "inputs changes between them (temperature, mounting, a zero): record the same motion "
          "several times, note what differs as a condition, and take the zero of each",
          std::sqrt(between.ratio)));
    const double rmse = std::sqrt(errors.all_held_out().mean_square());
    if (!std::isfinite(advice_.same_again_reduction) || !std::isfinite(advice_.target_noise))
      return;
    if (advice_.same_again_reduction >= kClearGain) return;
    if (rmse > kManyTimes * advice_.target_noise)
      advice_.limits.push_back(fmt::format(
          "the held-out error in the recorded regions ({:.3g} {}) is {:.2g} times the noise of {} "
          "and does not fall with more data: there the model or a missing input limits it, not "
          "the amount of data. Try a family with more structure (torsio compare)",
          rmse, y_unit_, rmse / advice_.target_noise, advice_.target));
    else
      advice_.limits.push_back(fmt::format(
          "the held-out error in the recorded regions ({:.3g} {}) is near the noise of {} ({:.3g} "
          "{}): a better sensor would lower it, more data would not",
          rmse, y_unit_, advice_.target, advice_.target_noise, y_unit_));
  }

  void report_undetermined() {
    if (data_.sequences.size() < 2)
      undetermined(
          "differences between recordings (mounting, day, temperature): there is only "
          "one. Record the same motion once more on another day");
    else if (!std::isfinite(advice_.between_recordings))
      undetermined(
          "differences between recordings: no two of them have the same motion. Repeat "
          "one of them");
    if (wanted("frequency") == nullptr && lowest_Hz_ > 0.0 &&
        RegionGrid::frequency_level(lowest_Hz_ * 1.01) ==
            RegionGrid::frequency_level(highest_Hz_ * 0.99))
      undetermined(fmt::format(
          "the effect of the frequency: all strokes are of {:.2g} to {:.2g} Hz. Record the same "
          "amplitude three times as fast or as slow; --want frequency=... states what is needed",
          lowest_Hz_, highest_Hz_));
    double longest = 0.0;
    for (const auto& strokes : strokes_)
      for (const Stroke& stroke : strokes) longest = std::max(longest, stroke.hold_s);
    if (longest < kLongHold_s)
      undetermined(
          fmt::format("creep and relaxation: the longest rest is {:.2g} s. Hold +-{:.2g} "
                      "{} for a minute each",
                      longest, 0.8 * grid_.half_range, x_unit_));
    for (std::size_t j = 1; j < data_.input_count(); ++j) {
      Extent range;
      for (const Sequence& sequence : data_.sequences)
        for (std::size_t n = 0; n < sequence.target.size(); ++n)
          if (sequence.use[n] != 0) range.include(sequence.features(n, j));
      if (!(range.width() > 0.0))
        undetermined(fmt::format("the effect of {}: it is {:g} in every recording",
                                 data_.inputs[j].expression, range.lowest));
    }
    if (conditions_.empty())
      undetermined(
          "the effect of temperature, load or any other condition: the recordings state "
          "none. A manifest gives them (conditions:)");
  }

  void rank() {
    std::ranges::stable_sort(advice_.proposals, std::greater(), &Proposal::assumed_reduction);
    if (advice_.proposals.size() > kMaxProposals)
      advice_.proposals.erase(
          advice_.proposals.begin() + static_cast<std::ptrdiff_t>(kMaxProposals),
          advice_.proposals.end());
  }

  const Dataset& dataset_;
  const FeatureSpec& spec_;
  const std::vector<WantedRange>& wanted_;
  const Progress& progress_;
  std::string x_unit_;
  std::string y_unit_;
  TrainingData data_;
  std::vector<ConditionValues> conditions_;
  AllStrokes strokes_;
  WantedRange recorded_;
  RegionGrid grid_;
  double fastest_ = 0.0;
  double speed_limit_ = std::numeric_limits<double>::infinity();
  double lowest_Hz_ = 0.0;
  double highest_Hz_ = std::numeric_limits<double>::infinity();
  double slope_ = 0.0;
  std::map<RegionKey, std::size_t> region_index_;  ///< in `Advice::regions`
  std::map<RegionKey, double> use_;                ///< weights of the intended use
  Advice advice_;
};

}  // namespace

Advice advise(const Dataset& dataset, const FeatureSpec& spec,
              const std::vector<WantedRange>& wanted, const Progress& progress) {
  return Adviser(dataset, spec, wanted, progress).run();
}

}  // namespace torsio

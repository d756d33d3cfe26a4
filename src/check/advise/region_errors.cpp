#include "check/advise/region_errors.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "core/report_progress.hpp"
#include "torsio/core/estimate.hpp"

namespace torsio {
namespace {

constexpr double kFrequencyStep = 3.0;
// Edges of the frequencies; 0.05, 0.1, 0.2, 0.5, 1, 2 and 5 Hz are not near one.
constexpr double kEdge_Hz = 0.08;
// A region of amplitudes contains those that are up to 10 % above its largest.
constexpr double kAmplitudeSlack = 0.15;  // log2
constexpr double kCentreShare = 0.25;
constexpr std::size_t kFewTrained = 8;  // strokes
constexpr std::size_t kFewTested = 4;
constexpr double kClear = 2.0;  // standard errors
constexpr double kExpectedFits = 150.0;

}  // namespace

bool RegionGrid::is_rest(const Stroke& stroke) const {
  return !(stroke.frequency_Hz > 0.0) || stroke.amplitude() < smallest_amplitude();
}

double RegionGrid::smallest_amplitude() const {
  return half_range * std::exp2(-kSmallestAmplitude - 1.0 + kAmplitudeSlack);
}

int RegionGrid::amplitude_level(double amplitude) const {
  const double level = std::floor(std::log2(half_range / amplitude) + kAmplitudeSlack);
  return static_cast<int>(std::clamp(level, 0.0, static_cast<double>(kSmallestAmplitude)));
}

int RegionGrid::frequency_level(double frequency_Hz) {
  return static_cast<int>(std::floor(std::log(frequency_Hz / kEdge_Hz) / std::log(kFrequencyStep)));
}

double RegionGrid::lowest_frequency_Hz(int level) {
  return kEdge_Hz * std::pow(kFrequencyStep, level);
}

RegionKey RegionGrid::key_of(const Stroke& stroke) const {
  const double off = (stroke.centre() - middle) / half_range;
  RegionKey key{.amplitude = amplitude_level(stroke.amplitude()),
                .frequency = frequency_level(stroke.frequency_Hz)};
  if (key.amplitude > 0 && std::abs(off) > kCentreShare) key.centre = off > 0.0 ? 1 : -1;
  return key;
}

TriangleMotion RegionGrid::motion(const RegionKey& key) const {
  const double share = key.amplitude == 0 ? 1.0 : 0.8 * std::exp2(-key.amplitude);
  return {.amplitude = half_range * share,
          .centre = middle + 0.5 * half_range * key.centre,
          .frequency_Hz = lowest_frequency_Hz(key.frequency) * std::sqrt(kFrequencyStep)};
}

double RegionErrors::Errors::mean_square() const {
  return samples > 0 ? square_sum / static_cast<double>(samples) : kNotMeasured;
}

RegionErrors::RegionErrors(const QuickModel& model, std::vector<Block> blocks, Progress progress)
    : model_(model), blocks_(std::move(blocks)), progress_(std::move(progress)) {
  std::map<std::pair<bool, RegionKey>, std::size_t> met;
  for (const Block& block : blocks_) rank_.push_back(met[{block.is_motion, block.region}]++);
  with_ = fold_errors(false);
  held_out_ = by_region(with_);
  held_out_linear_ = by_region(fold_errors(true));
}

QuickModel::Coefficients RegionErrors::fit(const Mask& trained, bool is_linear) const {
  done_ += (1.0 - done_) / kExpectedFits;
  report_progress(progress_, done_, "which recording is missing");
  NormalEquations sums(model_.columns());
  for (std::size_t b = 0; b < blocks_.size(); ++b)
    if (trained[b] != 0) add_sums(sums, blocks_[b].sums.sums);
  return is_linear ? model_.fit_linear(sums) : model_.fit(sums);
}

std::vector<double> RegionErrors::errors(const Mask& trained, const Mask& tested,
                                         bool is_linear) const {
  const QuickModel::Coefficients coefficients = fit(trained, is_linear);
  std::vector<double> result(blocks_.size(), 0.0);
  for (std::size_t b = 0; b < blocks_.size(); ++b)
    if (tested[b] != 0) result[b] = blocks_[b].sums.sums.error(coefficients);
  return result;
}

std::vector<double> RegionErrors::fold_errors(bool is_linear) const {
  std::vector<double> result(blocks_.size(), 0.0);
  for (std::size_t fold = 0; fold < kFolds; ++fold) {
    Mask tested(blocks_.size());
    Mask trained(blocks_.size());
    for (std::size_t b = 0; b < blocks_.size(); ++b) {
      tested[b] = rank_[b] % kFolds == fold ? 1 : 0;
      trained[b] = tested[b] == 0 ? 1 : 0;
    }
    if (strokes_of(trained) == 0) continue;
    const std::vector<double> part = errors(trained, tested, is_linear);
    for (std::size_t b = 0; b < blocks_.size(); ++b) result[b] += part[b];
  }
  return result;
}

std::map<RegionKey, RegionErrors::Errors> RegionErrors::by_region(
    const std::vector<double>& errors) const {
  std::map<RegionKey, Errors> regions;
  for (std::size_t b = 0; b < blocks_.size(); ++b) {
    if (!blocks_[b].is_motion || blocks_[b].sums.samples() == 0) continue;
    Errors& region = regions[blocks_[b].region];
    region.square_sum += errors[b];
    region.samples += blocks_[b].sums.samples();
    region.strokes += blocks_[b].strokes;
    ++region.blocks;
  }
  return regions;
}

RegionErrors::Errors RegionErrors::all_held_out() const {
  Errors all;
  for (const auto& [key, region] : held_out_) {
    all.square_sum += region.square_sum;
    all.samples += region.samples;
    all.strokes += region.strokes;
    all.blocks += region.blocks;
  }
  return all;
}

std::size_t RegionErrors::strokes_of(const Mask& mask) const {
  std::size_t strokes = 0;
  for (std::size_t b = 0; b < blocks_.size(); ++b)
    if (mask[b] != 0 && blocks_[b].is_motion) strokes += blocks_[b].strokes;
  return strokes;
}

/// The blocks are the independent units: errors within a stroke are correlated.
ErrorRatio RegionErrors::compare(const Mask& tested, const std::vector<double>& without) const {
  ErrorRatio result{.ratio = 1.0, .is_clear = false, .strokes = strokes_of(tested)};
  double with_sum = 0.0;
  double without_sum = 0.0;
  std::vector<double> differences;
  for (std::size_t b = 0; b < blocks_.size(); ++b) {
    if (tested[b] == 0) continue;
    with_sum += with_[b];
    without_sum += without[b];
    differences.push_back(without[b] - with_[b]);
  }
  if (!(with_sum > 0.0) || differences.size() < 3) return {};
  result.ratio = without_sum / with_sum;
  const auto count = static_cast<double>(differences.size());
  const double mean = (without_sum - with_sum) / count;
  double square = 0.0;
  for (const double difference : differences) square += (difference - mean) * (difference - mean);
  result.is_clear = mean > kClear * std::sqrt(square / (count - 1.0) / count);
  return result;
}

Growth RegionErrors::growth(Direction direction) const {
  // The coordinate that increases in the direction.
  const auto level = [direction](const RegionKey& key) {
    switch (direction) {
      case Direction::larger: return -key.amplitude;
      case Direction::smaller: return key.amplitude;
      case Direction::faster: return key.frequency;
      case Direction::slower: return -key.frequency;
      case Direction::off_centre: return std::abs(key.centre);
    }
    return 0;
  };
  // A guard replaces a model by the linear one where an input leaves its range.
  const bool is_linear = direction == Direction::larger || direction == Direction::faster;
  int lowest = std::numeric_limits<int>::max();
  int highest = std::numeric_limits<int>::min();
  for (const auto& [key, region] : held_out_) {
    lowest = std::min(lowest, level(key));
    highest = std::max(highest, level(key));
  }
  Growth growth;
  double weights = 0.0;
  for (int last = lowest; last < highest; ++last) {
    Mask trained(blocks_.size());
    for (std::size_t b = 0; b < blocks_.size(); ++b)
      trained[b] = !blocks_[b].is_motion || level(blocks_[b].region) <= last ? 1 : 0;
    if (strokes_of(trained) < kFewTrained) continue;
    Mask tested(blocks_.size());
    const Block* example = nullptr;
    for (std::size_t b = 0; b < blocks_.size(); ++b) {
      tested[b] = blocks_[b].is_motion && level(blocks_[b].region) == last + 1 ? 1 : 0;
      if (tested[b] != 0) example = &blocks_[b];
    }
    if (strokes_of(tested) < kFewTested) continue;
    const ErrorRatio ratio = compare(tested, errors(trained, tested, is_linear));
    if (ratio.strokes == 0) continue;
    const auto weight = static_cast<double>(ratio.strokes);
    growth.per_step += ratio.is_clear ? weight * std::log(std::max(ratio.ratio, 1.0)) : 0.0;
    weights += weight;
    if (ratio.strokes > growth.largest.strokes) {
      growth.largest = ratio;
      growth.at = example->region;
    }
  }
  growth.is_known = weights > 0.0;
  if (growth.is_known) growth.per_step /= weights;
  return growth;
}

double RegionErrors::decrease(const RegionKey& region) const {
  std::vector<double> halved(blocks_.size(), 0.0);
  Mask tested(blocks_.size());
  std::size_t of_region = 0;
  for (std::size_t b = 0; b < blocks_.size(); ++b) {
    tested[b] = blocks_[b].is_motion && blocks_[b].region == region ? 1 : 0;
    of_region += tested[b];
  }
  if (of_region < kFewTrained) return 0.0;
  for (std::size_t fold = 0; fold < kFolds; ++fold) {
    Mask trained(blocks_.size());
    Mask left_out(blocks_.size());
    for (std::size_t b = 0; b < blocks_.size(); ++b) {
      const bool is_held_out = rank_[b] % kFolds == fold;
      trained[b] = !is_held_out && (tested[b] == 0 || rank_[b] / kFolds % 2 == 0) ? 1 : 0;
      left_out[b] = is_held_out ? tested[b] : 0;
    }
    const std::vector<double> part = errors(trained, left_out, false);
    for (std::size_t b = 0; b < blocks_.size(); ++b) halved[b] += part[b];
  }
  const ErrorRatio ratio = compare(tested, halved);
  if (!ratio.is_clear) return 0.0;
  // Trained on 0.4 and 0.8 of the region: (1 / 0.4 - 1 / 0.8) b.
  const double mean_square = held_out_.at(region).mean_square();
  return std::min((ratio.ratio - 1.0) / 1.25, 1.0) * mean_square;
}

std::vector<double> RegionErrors::errors_of_share(std::size_t parts) const {
  constexpr std::size_t kRepeats = 4;
  const std::size_t repeats = std::min(parts, kRepeats);
  std::vector<double> sums(blocks_.size(), 0.0);
  std::vector<double> counts(blocks_.size(), 0.0);
  for (std::size_t part = 0; part < repeats; ++part) {
    Mask trained(blocks_.size());
    Mask tested(blocks_.size());
    for (std::size_t b = 0; b < blocks_.size(); ++b) {
      // In pairs: every second stroke is a rising one.
      trained[b] = rank_[b] / 2 % parts == part ? 1 : 0;
      tested[b] = trained[b] == 0 ? 1 : 0;
    }
    const std::vector<double> each = errors(trained, tested, false);
    for (std::size_t b = 0; b < blocks_.size(); ++b) {
      sums[b] += each[b];
      counts[b] += tested[b];
    }
  }
  for (std::size_t b = 0; b < blocks_.size(); ++b)
    sums[b] = counts[b] > 0.0 ? sums[b] / counts[b] : kNotMeasured;
  return sums;
}

std::vector<LearningPoint> RegionErrors::learning_curve() const {
  const Errors all = all_held_out();
  if (all.strokes < 2 * kFewTrained || all.blocks < 2 * kFewTrained) return {};
  // Effective samples from the spread of the means of blocks, whose errors are independent.
  const QuickModel::Coefficients coefficients = fit(Mask(blocks_.size(), 1), false);
  double sum = 0.0;
  double square_sum = 0.0;
  double count = 0.0;
  std::vector<std::pair<double, double>> of_blocks;  // samples, sum of errors
  for (const Block& block : blocks_) {
    const auto samples = static_cast<double>(block.sums.samples());
    if (!(samples > 0.0)) continue;
    double errors_sum = -block.sums.target_sum;
    for (std::size_t j = 0; j < coefficients.size(); ++j)
      errors_sum += coefficients[j] * block.sums.sums.product(0, j);
    of_blocks.emplace_back(samples, errors_sum);
    sum += errors_sum;
    count += samples;
    square_sum += block.sums.sums.error(coefficients);
  }
  const double mean = sum / count;
  double variance_of_mean = 0.0;
  for (const auto& [samples, errors_sum] : of_blocks)
    variance_of_mean += std::pow((errors_sum - samples * mean) / count, 2);
  const double effective = std::min(count, (square_sum / count - mean * mean) / variance_of_mean);
  std::vector<LearningPoint> curve;
  for (const std::size_t parts : {8U, 4U, 2U}) {
    if (all.blocks < parts * kFewTested) continue;
    const std::vector<double> each = errors_of_share(parts);
    double squares = 0.0;
    double samples = 0.0;
    for (std::size_t b = 0; b < blocks_.size(); ++b) {
      if (!blocks_[b].is_motion || !std::isfinite(each[b])) continue;
      squares += each[b];
      samples += static_cast<double>(blocks_[b].sums.samples());
    }
    const double share = 1.0 / static_cast<double>(parts);
    curve.push_back({share, share * effective, std::sqrt(squares / samples)});
  }
  const double share = 1.0 - 1.0 / static_cast<double>(kFolds);
  curve.push_back({share, share * effective, std::sqrt(all.mean_square())});
  return curve;
}

double RegionErrors::decrease_of_all() const {
  const Errors all = all_held_out();
  if (all.strokes < 2 * kFewTrained || all.blocks < 2 * kFewTrained) return kNotMeasured;
  std::vector<double> half = errors_of_share(2);
  Mask tested(blocks_.size());
  for (std::size_t b = 0; b < blocks_.size(); ++b)
    tested[b] = blocks_[b].is_motion && std::isfinite(half[b]) ? 1 : 0;
  const ErrorRatio ratio = compare(tested, half);
  // Trained on 0.5 and 0.8: (1 / 0.5 - 1 / 0.8) b.
  return ratio.is_clear ? std::min((ratio.ratio - 1.0) / 0.75, 1.0) : 0.0;
}

ErrorRatio RegionErrors::between_recordings() const {
  std::map<RegionKey, std::map<std::size_t, std::size_t>> strokes;
  std::size_t recordings = 0;
  for (const Block& block : blocks_) {
    recordings = std::max(recordings, block.recording + 1);
    if (block.is_motion) strokes[block.region][block.recording] += block.strokes;
  }
  if (recordings < 2) return {};
  std::vector<double> without(blocks_.size(), 0.0);
  Mask all_tested(blocks_.size());
  for (std::size_t r = 0; r < recordings; ++r) {
    Mask trained(blocks_.size());
    Mask tested(blocks_.size());
    for (std::size_t b = 0; b < blocks_.size(); ++b) {
      trained[b] = blocks_[b].recording != r ? 1 : 0;
      if (trained[b] != 0 || !blocks_[b].is_motion) continue;
      std::size_t elsewhere = 0;
      for (const auto& [other, count] : strokes[blocks_[b].region])
        if (other != r) elsewhere += count;
      tested[b] = elsewhere >= kFewTested ? 1 : 0;
    }
    if (strokes_of(tested) == 0 || strokes_of(trained) < kFewTrained) continue;
    const std::vector<double> part = errors(trained, tested, false);
    for (std::size_t b = 0; b < blocks_.size(); ++b) {
      without[b] += part[b];
      if (tested[b] != 0) all_tested[b] = 1;
    }
  }
  return strokes_of(all_tested) >= kFewTrained ? compare(all_tested, without) : ErrorRatio{};
}

ErrorRatio RegionErrors::without_recordings(const std::vector<std::uint8_t>& is_left_out) const {
  Mask trained(blocks_.size());
  Mask tested(blocks_.size());
  for (std::size_t b = 0; b < blocks_.size(); ++b) {
    trained[b] = is_left_out[blocks_[b].recording] == 0 ? 1 : 0;
    tested[b] = trained[b] == 0 && blocks_[b].is_motion ? 1 : 0;
  }
  if (strokes_of(trained) < kFewTrained || strokes_of(tested) < kFewTested) return {};
  return compare(tested, errors(trained, tested, false));
}

double RegionErrors::linear_slope() const { return fit(Mask(blocks_.size(), 1), true)[1]; }

}  // namespace torsio

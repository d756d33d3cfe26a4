#include "torsio/evaluate/attribution.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <numeric>
#include <utility>

#include "evaluate/permutation_importance.hpp"
#include "evaluate/shapley.hpp"
#include "fit/common/model_run.hpp"
#include "numerics/parallel.hpp"
#include "numerics/shared_progress.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/random.hpp"
#include "torsio/core/realtime.hpp"

namespace torsio {
namespace {

constexpr std::size_t kLongestMemory = 1024;

/// The last sample of a window.
struct End {
  std::size_t sequence = 0;
  std::size_t sample = 0;
};

/// Every end of a window of `length` samples whose features are finite and whose end may be used.
std::vector<End> window_ends(const TrainingData& data, std::size_t length) {
  std::vector<End> ends;
  for (std::size_t k = 0; k < data.sequences.size(); ++k) {
    const Sequence& sequence = data.sequences[k];
    std::size_t finite = 0;  // samples up to here
    for (std::size_t n = 0; n < sequence.target.size(); ++n) {
      finite = sequence.has_features(n) ? finite + 1 : 0;
      if (sequence.use[n] != 0 && finite >= length) ends.push_back({.sequence = k, .sample = n});
    }
  }
  return ends;
}

/// `count` of the candidates, or all of them, in the order of recording.
std::vector<End> drawn(std::vector<End> candidates, std::size_t count, Random& random) {
  const std::size_t taken = std::min(count, candidates.size());
  for (std::size_t i = 0; i < taken; ++i)
    std::swap(candidates[i], candidates[i + random.below(candidates.size() - i)]);
  candidates.resize(taken);
  std::ranges::sort(candidates, {},
                    [](const End& end) { return std::pair(end.sequence, end.sample); });
  return candidates;
}

/// Windows of one length, as rows of features.
class Windows {
 public:
  Windows(const TrainingData& data, std::size_t length) : data_(data), length_(length) {}

  [[nodiscard]] std::span<const double> row(const End& end, std::size_t n) const {
    return data_.sequences[end.sequence].features.row(end.sample + 1 - length_ + n);
  }

  /// The estimate at the end of a window whose inputs come from `present` where their bit in
  /// the coalition is set, and from `absent` otherwise.
  [[nodiscard]] Estimate estimate(AnyModel& model, const End& present, const End& absent,
                                  std::size_t coalition, std::vector<double>& scratch) const {
    Estimate estimate;
    model.reset();
    for (std::size_t n = 0; n < length_; ++n) {
      const std::span<const double> here = row(present, n);
      const std::span<const double> there = row(absent, n);
      for (std::size_t j = 0; j < scratch.size(); ++j)
        scratch[j] = (coalition >> j & 1U) != 0 ? here[j] : there[j];
      estimate = model.step(scratch);
    }
    return estimate;
  }

 private:
  const TrainingData& data_;
  std::size_t length_;
};

std::vector<std::vector<Estimate>> run_all(const AnyModel& model, const TrainingData& data,
                                           std::size_t threads, const Progress& progress) {
  std::vector<std::vector<Estimate>> estimates(data.sequences.size());
  SharedProgress shared(progress, 0.0, 0.05, estimates.size(), "running the model");
  for_each_chunk(estimates.size(), threads, [&](std::size_t k) {
    const DenormalsOff denormals_off;
    AnyModel own = model;
    estimates[k] = run(own, data.sequences[k]);
    shared.tick();
  });
  return estimates;
}

/// Standard deviation of the estimates.
double spread_of(const TrainingData& data, const std::vector<std::vector<Estimate>>& estimates) {
  double count = 0.0;
  double mean = 0.0;
  double square_sum = 0.0;
  for (std::size_t k = 0; k < estimates.size(); ++k)
    for (std::size_t n = 0; n < estimates[k].size(); ++n) {
      if (data.sequences[k].use[n] == 0) continue;
      count += 1.0;
      const double deviation = estimates[k][n].value - mean;
      mean += deviation / count;
      square_sum += deviation * (estimates[k][n].value - mean);
    }
  return count > 0.0 ? std::sqrt(square_sum / count) : 0.0;
}

Memory memory_of(AnyModel model, const TrainingData& data,
                 const std::vector<std::vector<Estimate>>& estimates, std::uint64_t seed) {
  constexpr std::size_t kAsked = 100;
  constexpr double kTolerance = 1e-3;
  constexpr double kShare = 0.95;
  const double tolerance = kTolerance * spread_of(data, estimates);
  std::vector<double> scratch(data.input_count());
  Memory memory{.samples = 1, .is_longer = true};
  for (std::size_t length = 1; length <= kLongestMemory; length *= 2) {
    Random random(seed);
    const std::vector<End> ends = drawn(window_ends(data, length), kAsked, random);
    if (ends.empty()) return memory;
    memory.samples = length;
    const Windows windows(data, length);
    std::size_t asked = 0;
    std::size_t agreed = 0;
    for (const End& end : ends) {
      const Estimate& course = estimates[end.sequence][end.sample];
      if (course.fault != Fault::none) continue;
      const Estimate start = windows.estimate(model, end, end, 0, scratch);
      ++asked;
      if (start.fault == Fault::none && std::abs(start.value - course.value) <= tolerance) ++agreed;
    }
    if (static_cast<double>(agreed) >= kShare * static_cast<double>(asked)) {
      memory.is_longer = false;
      return memory;
    }
  }
  return memory;
}

/// Mean value of the model over the background, for every coalition. Gathered as distances from
/// the explained value, so that coalitions of equal values have equal means to the last bit.
std::vector<double> coalition_values(AnyModel& model, const Windows& windows, const End& explained,
                                     const std::vector<End>& background,
                                     const std::vector<double>& background_values,
                                     std::size_t inputs, SharedProgress& progress) {
  const std::size_t all = (std::size_t{1} << inputs) - 1;
  const auto count = static_cast<double>(background.size());
  std::vector<double> scratch(inputs);
  const double value = windows.estimate(model, explained, explained, all, scratch).value;
  std::vector<double> values(all + 1, value);
  for (std::size_t coalition = 0; coalition < all; ++coalition) {
    double distance = 0.0;
    for (std::size_t b = 0; b < background.size(); ++b)
      distance +=
          (coalition == 0
               ? background_values[b]
               : windows.estimate(model, explained, background[b], coalition, scratch).value) -
          value;
    values[coalition] += distance / count;
    progress.tick();
  }
  return values;
}

std::vector<ExplainedWindow> explain(const AnyModel& model, const TrainingData& data,
                                     const Windows& windows, const std::vector<End>& explained,
                                     const std::vector<End>& background,
                                     const std::vector<double>& background_values,
                                     std::size_t threads, const Progress& progress) {
  std::vector<ExplainedWindow> result(explained.size());
  const std::size_t inputs = model.input_count();
  const std::size_t coalitions = (std::size_t{1} << inputs) - 1;
  SharedProgress shared(progress, 0.05, 0.5, explained.size() * coalitions, "Shapley values");
  for_each_chunk(explained.size(), threads, [&](std::size_t k) {
    const DenormalsOff denormals_off;
    AnyModel own = model;
    const std::vector<double> values =
        coalition_values(own, windows, explained[k], background, background_values, inputs, shared);
    result[k] = {.recording = data.sequences[explained[k].sequence].recording,
                 .sample = explained[k].sample,
                 .value = values.back(),
                 .shapley = shapley_values(values)};
  });
  return result;
}

void refuse_bad_calls(const AnyModel& model, const TrainingData& data,
                      const AttributionOptions& options) {
  if (options.windows == 0 || options.background == 0 || options.repeats == 0)
    throw UsageError({.problem = "windows, background and repeats must be at least 1"});
  if (model.input_count() != data.input_count())
    throw Error({.expected = fmt::format("{} inputs, as the model has", model.input_count()),
                 .found = std::to_string(data.input_count())});
  if (model.input_count() > kMaxAttributedInputs)
    throw Error({.problem = "this model has too many inputs for exact Shapley values",
                 .expected = fmt::format("at most {}: each further input doubles the work",
                                         kMaxAttributedInputs),
                 .found = std::to_string(model.input_count()),
                 .advice = "Use fewer inputs; torsio crossvalidate shows the loss of accuracy."});
}

void enter_shapley(Attribution& attribution) {
  const auto count = static_cast<double>(attribution.explained.size());
  double total = 0.0;
  for (std::size_t j = 0; j < attribution.inputs.size(); ++j) {
    double sum = 0.0;
    for (const ExplainedWindow& window : attribution.explained) sum += std::abs(window.shapley[j]);
    attribution.inputs[j].mean_abs_shapley = sum / count;
    total += sum / count;
  }
  for (InputAttribution& input : attribution.inputs)
    input.share = total > 0.0 ? input.mean_abs_shapley / total : kNotMeasured;
  for (const ExplainedWindow& window : attribution.explained) {
    const double sum = std::accumulate(window.shapley.begin(), window.shapley.end(), 0.0);
    attribution.additivity_error = std::max(
        attribution.additivity_error, std::abs(sum - (window.value - attribution.expected_value)));
  }
}

void enter_permutation(Attribution& attribution, const PermutationImportance& importance) {
  attribution.rmse = importance.rmse;
  attribution.samples = importance.samples;
  attribution.block_samples = importance.block_samples;
  for (std::size_t j = 0; j < attribution.inputs.size(); ++j) {
    const std::vector<double>& increase = importance.increase[j];
    const auto count = static_cast<double>(increase.size());
    const double mean = std::accumulate(increase.begin(), increase.end(), 0.0) / count;
    double square_sum = 0.0;
    for (const double value : increase) square_sum += (value - mean) * (value - mean);
    attribution.inputs[j].rmse_increase = mean;
    if (increase.size() > 1)
      attribution.inputs[j].rmse_increase_std = std::sqrt(square_sum / (count - 1.0));
  }
}

}  // namespace

std::vector<double> shapley_values(std::span<const double> values) {
  if (!std::has_single_bit(values.size()))
    throw Error({.place = "Shapley values",
                 .expected = "the values of 2^n coalitions",
                 .found = std::to_string(values.size())});
  const auto players = static_cast<std::size_t>(std::countr_zero(values.size()));
  std::vector<double> weight(players);  // |S|! (n-|S|-1)! / n!
  double choose = 1.0;                  // binomial coefficient of |S| among n - 1
  for (std::size_t size = 0; size < players; ++size) {
    weight[size] = 1.0 / (choose * static_cast<double>(players));
    choose *= static_cast<double>(players - 1 - size) / static_cast<double>(size + 1);
  }
  std::vector<double> shapley(players, 0.0);
  for (std::size_t coalition = 0; coalition < values.size(); ++coalition)
    for (std::size_t player = 0; player < players; ++player) {
      const std::size_t with = coalition | std::size_t{1} << player;
      if (with != coalition)
        shapley[player] += weight[static_cast<std::size_t>(std::popcount(coalition))] *
                           (values[with] - values[coalition]);
    }
  return shapley;
}

Memory memory_samples(const AnyModel& model, const TrainingData& data, std::uint64_t seed) {
  return memory_of(model, data, run_all(model, data, 1, {}), seed);
}

Attribution attribute(const AnyModel& model, const TrainingData& data,
                      const AttributionOptions& options, const Progress& progress) {
  refuse_bad_calls(model, data, options);
  const auto estimates = run_all(model, data, options.threads, progress);
  const Memory memory = memory_of(model, data, estimates, options.seed);
  Attribution attribution;
  attribution.window_samples = options.window_samples > 0 ? options.window_samples : memory.samples;
  attribution.window_is_long_enough =
      !memory.is_longer && attribution.window_samples >= memory.samples;
  for (const InputInfo& input : data.inputs) attribution.inputs.push_back({input.expression});

  const std::vector<End> candidates = window_ends(data, attribution.window_samples);
  if (candidates.empty())
    throw Error({.problem = fmt::format(
                     "no recording contains a window of {} samples on which the model can be "
                     "evaluated",
                     attribution.window_samples),
                 .advice = "Use a shorter window, or longer recordings."});
  Random random(options.seed);
  const std::vector<End> explained = drawn(candidates, options.windows, random);
  const std::vector<End> background = drawn(candidates, options.background, random);
  attribution.background = background.size();

  const Windows windows(data, attribution.window_samples);
  AnyModel own = model;
  std::vector<double> scratch(data.input_count());
  std::vector<double> background_values;
  background_values.reserve(background.size());
  for (const End& end : background)
    background_values.push_back(windows.estimate(own, end, end, 0, scratch).value);
  attribution.expected_value =
      std::accumulate(background_values.begin(), background_values.end(), 0.0) /
      static_cast<double>(background.size());

  attribution.explained = explain(model, data, windows, explained, background, background_values,
                                  options.threads, progress);
  enter_shapley(attribution);
  enter_permutation(attribution, permutation_importance(model, data, estimates,
                                                        attribution.window_samples, options.repeats,
                                                        options.seed, options.threads, progress));
  return attribution;
}

}  // namespace torsio

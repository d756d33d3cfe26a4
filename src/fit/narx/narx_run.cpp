#include "fit/narx/narx_run.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "numerics/metrics_accumulator.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/random.hpp"
#include "torsio/numerics/metrics.hpp"

namespace torsio {

void check_lags(const NarxLags& lags) {
  constexpr std::size_t kMax = Narx<Linear>::kMaxLags;
  if (lags.outputs >= 1 && lags.outputs <= kMax && lags.inputs <= kMax) return;
  throw UsageError({.place = "lags",
                    .expected = fmt::format("0 to {0} of inputs, 1 to {0} of outputs", kMax),
                    .found = fmt::format("{} and {}", lags.inputs, lags.outputs)});
}

TargetSpread spread_of(const TrainingData& data) {
  double count = 0.0;
  double mean = 0.0;
  double squares = 0.0;
  TargetSpread spread;
  for (const Sequence& sequence : data.sequences) {
    for (std::size_t n = 0; n < sequence.target.size(); ++n) {
      if (sequence.use[n] == 0) continue;
      const double distance = sequence.target[n] - mean;
      mean += distance / ++count;
      squares += distance * (sequence.target[n] - mean);
      spread.largest = std::max(spread.largest, std::abs(sequence.target[n]));
    }
  }
  spread.deviation = std::sqrt(squares / std::max(count, 1.0));
  return spread;
}

Narx<Linear>::Parameters narx_frame(const TrainingData& data, const NarxLags& lags, double range,
                                    const TargetSpread& spread) {
  if (!(spread.deviation > 0.0))
    throw Error({.place = data.target, .expected = "a target that changes", .found = "a constant"});
  return {.model = {},
          .inputs = data.input_count(),
          .input_lags = lags.inputs,
          .output_lags = lags.outputs,
          .sample_period_s = 1.0 / data.sample_rate_Hz,
          .lowest = -range * spread.largest,
          .highest = range * spread.largest,
          .start = 0.0};
}

void require_free_run(const TrainingData& data) {
  std::size_t most = 0;
  for (const Sequence& sequence : data.sequences)
    most = std::max(most, static_cast<std::size_t>(std::ranges::count_if(
                              sequence.target, [](double y) { return std::isfinite(y); })));
  if (most > kCorrected) return;
  throw Error(
      {.problem = "the records are too short to evaluate a free run, which starts from "
                  "measured samples",
       .expected = fmt::format("one of more than {} samples of {}", kCorrected, data.target),
       .found = fmt::format("{} in the longest", most)});
}

double free_run_rmse(const OutputLists& outputs, const TrainingData& data) {
  MetricsAccumulator accumulator;
  for (std::size_t s = 0; s < outputs.size(); ++s) {
    const Sequence& sequence = data.sequences[s];
    std::size_t given = 0;
    for (std::size_t n = 0; n < outputs[s].size(); ++n) {
      if (given == kCorrected) {
        if (sequence.use[n] != 0) accumulator.add(outputs[s][n], sequence.target[n]);
      } else if (std::isfinite(sequence.target[n])) {
        ++given;
      }
    }
  }
  return accumulator.metrics().rmse;
}

OutputLists noisy_targets(const TrainingData& data, double deviation, std::uint64_t seed) {
  Random random(seed);
  OutputLists outputs;
  for (const Sequence& sequence : data.sequences) {
    outputs.push_back(sequence.target);
    for (double& value : outputs.back()) value += deviation * random.normal();
  }
  return outputs;
}

}  // namespace torsio

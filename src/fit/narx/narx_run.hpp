#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "fit/narx/fit_narx.hpp"
#include "model/narx/narx.hpp"
#include "torsio/core/estimate.hpp"
#include "torsio/core/progress.hpp"
#include "torsio/fit/common/training_data.hpp"

namespace torsio {

using OutputLists = std::vector<std::vector<double>>;  // one per sequence

inline constexpr std::size_t kCorrected = 50;  // measured samples that a simulation starts from

/// @throws UsageError for lags out of range.
void check_lags(const NarxLags& lags);

struct TargetSpread {
  double deviation = 0.0;
  double largest = 0.0;  ///< magnitude
};
[[nodiscard]] TargetSpread spread_of(const TrainingData& data);

/// The parameters of a NARX model except f.
/// @throws Error if the target is constant.
[[nodiscard]] Narx<Linear>::Parameters narx_frame(const TrainingData& data, const NarxLags& lags,
                                                  double range, const TargetSpread& spread);

/// Combines f with such parameters.
template <class M>
[[nodiscard]] typename Narx<M>::Parameters framed(typename M::Parameters f,
                                                  const Narx<Linear>::Parameters& frame) {
  return {.model = std::move(f),
          .inputs = frame.inputs,
          .input_lags = frame.input_lags,
          .output_lags = frame.output_lags,
          .sample_period_s = frame.sample_period_s,
          .lowest = frame.lowest,
          .highest = frame.highest,
          .start = frame.start};
}

/// The outputs of a free run from the first measured samples.
template <FeedsBack M>
[[nodiscard]] std::vector<double> simulated(M& model, const Sequence& sequence) {
  std::vector<double> outputs(sequence.target.size(), kNotMeasured);
  model.reset();
  std::size_t corrected = 0;
  for (std::size_t n = 0; n < outputs.size(); ++n) {
    if (sequence.has_features(n)) outputs[n] = model.step(sequence.features.row(n)).value;
    if (corrected == kCorrected || !std::isfinite(sequence.target[n])) continue;
    model.correct(sequence.target[n]);
    outputs[n] = sequence.target[n];
    ++corrected;
  }
  return outputs;
}

template <FeedsBack M>
[[nodiscard]] OutputLists simulated(M& model, const TrainingData& data) {
  OutputLists outputs;
  for (const Sequence& sequence : data.sequences) outputs.push_back(simulated(model, sequence));
  return outputs;
}

/// @throws Error if no record continues after the measured start.
void require_free_run(const TrainingData& data);

/// RMSE of the samples after the measured start.
[[nodiscard]] double free_run_rmse(const OutputLists& outputs, const TrainingData& data);

/// The targets with normal noise.
[[nodiscard]] OutputLists noisy_targets(const TrainingData& data, double deviation,
                                        std::uint64_t seed);

}  // namespace torsio

#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <vector>

#include "model/linear/linear.hpp"
#include "model/narx/narx.hpp"
#include "torsio/fit/common/family_info.hpp"
#include "torsio/fit/common/fit_context.hpp"
#include "torsio/fit/common/fitted.hpp"
#include "torsio/fit/common/training_data.hpp"
#include "torsio/model/any_model.hpp"

namespace torsio {

struct NarxLags {
  std::size_t inputs = 2;   ///< n_u
  std::size_t outputs = 2;  ///< n_y
};

/// What f learns from in the place of its past outputs.
enum class NarxTraining : std::uint8_t {
  one_step,  ///< the measured ones: quick, and blind to how errors grow
  noise,     ///< the measured ones with noise, so that f learns to forget errors
  free_run,  ///< its own, round after round; the round with the least error in free run is kept
};

struct NarxOptions {
  NarxLags lags = {};
  NarxTraining training = NarxTraining::free_run;
  double noise = 0.02;     ///< standard deviation, as a share of the target's
  std::size_t rounds = 5;  ///< of free_run, behind the first fit one step ahead
  double range = 1.2;      ///< of the largest |target|: where the output is clipped
};

/// The regressors of a NARX model as data to fit f on: the inputs, their lags, and past outputs. A
/// sample may be learned from if all of these lie in its record and are finite; held samples of a
/// slower sensor count as measured.
/// @param outputs what stands for the past outputs, a list a sequence; null: the target itself
[[nodiscard]] TrainingData narx_data(const TrainingData& data, const NarxLags& lags,
                                     const std::vector<std::vector<double>>* outputs = nullptr);

/// What makes one static family dynamic.
struct NarxInner {
  std::function<FittedModel(const TrainingData&, const FitContext&)> fit;
  /// f and the rest of a `Narx`'s parameters (those of its own fields) -> the model.
  std::function<AnyModel(const AnyModel& f, const Narx<Linear>::Parameters& rest)> wrap;
};

/// Trains f on `narx_data`, as `options.training` says. Deterministic for a seed. Source:
/// specification 3.3 (NARX evaluation).
/// @throws Error as f's fitter, or if no record outlasts the lags; UsageError for lags out of range.
[[nodiscard]] FittedModel fit_narx(const TrainingData& data, const NarxOptions& options,
                                   const NarxInner& inner, const FitContext& context = {});

struct ArxOptions {
  NarxLags lags = {};
  bool is_refined = true;
  double range = 1.2;
};

/// A linear NARX model (ARX) by least squares one step ahead, refined by Ceres so that its free run
/// misses least (output error):
///
///     min_θ Σ (ŷ_k(θ) − y_k)²,   dŷ_k/dθ = φ_k + Σ_i a_i dŷ_{k−i}/dθ
///
/// The refinement is dropped where it does not lower the error in free run, or leaves the output's
/// range. Source: specification 3.3.
/// @throws Error if no record outlasts the lags; UsageError for lags out of range.
[[nodiscard]] Fitted<Narx<Linear>> fit_arx(const TrainingData& data, const ArxOptions& options,
                                           const FitContext& context = {});

}  // namespace torsio

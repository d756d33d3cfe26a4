#pragma once

#include <cstddef>
#include <string>

#include "model/hysteresis/bouc_wen_model.hpp"
#include "model/hysteresis/exponential_loading.hpp"
#include "model/hysteresis/improved_prandtl_ishlinskii.hpp"
#include "model/hysteresis/nonlinear_backlash.hpp"
#include "model/hysteresis/operator_sum.hpp"
#include "torsio/core/progress.hpp"
#include "torsio/fit/common/fitted.hpp"
#include "torsio/fit/common/training_data.hpp"

// Fits of hysteresis operators. The operator runs through every sample of a record that has
// features (between two turns where that changes nothing, only those that are judged); usable samples are learned from, the search of a non-linear family using at most
// `kMostResiduals` of them, evenly spread. Other inputs get slopes as in `fit_polynomial`.
//
// All @throw Error if the first input is constant in the training data or there are too few
// samples; those that search, too, if no start converges: a search that gave up is no fit.

namespace torsio {

inline constexpr std::size_t kMostResiduals = 10000;

struct OperatorSumOptions {
  std::size_t thresholds = 8;  ///< 1 to `kMostThresholds`
  bool passive = true;         ///< weights of the sign that cannot give work; `maxwell_slip` always
  bool rates = false;          ///< give other inputs that are rates a slope too
  std::string schedule = {};   ///< expression of the input to schedule over; empty: constant
};
inline constexpr std::size_t kMostThresholds = 64;

/// Non-negative least squares for stiffnesses of elements whose thresholds are fixed: from half the
/// range of x_0 down to 1/128 of that, in equal ratios. @throws as `fit_polynomial`, too.
[[nodiscard]] Fitted<MaxwellSlipModel> fit_maxwell_slip(const TrainingData& data,
                                                        const OperatorSumOptions& options);

/// The same with thresholds at quantiles of |x_0 - mid-range|: (i - 1/2) / n, i = 1 .. n.
[[nodiscard]] Fitted<PrandtlIshlinskii> fit_prandtl_ishlinskii(const TrainingData& data,
                                                               const OperatorSumOptions& options);

struct HysteresisSearchOptions {
  std::size_t thresholds = 8;  ///< improved Prandtl-Ishlinskii: of plays
  std::size_t bends = 4;       ///< the same: of S, half of them on either side of 0
  std::size_t degree = 5;      ///< of boundaries and curves, 0 to `kHighestCurveDegree`
  std::size_t most_iterations = 200;
  bool rates = false;
};
inline constexpr std::size_t kHighestCurveDegree = 9;

/// Starts from the plain operator. @throws Error if no input tells a rate.
[[nodiscard]] Fitted<ImprovedPrandtlIshlinskii> fit_improved_prandtl_ishlinskii(
    const TrainingData& data, const HysteresisSearchOptions& options,
    const Progress& progress = {});

/// z_max, n and gamma / beta are searched from four starts; the rest is linear and solved for each
/// of their values, the hysteresis held at or above 0. Learns from a quarter of `kMostResiduals`: its
/// powers cost.
[[nodiscard]] Fitted<BoucWenModel> fit_bouc_wen(const TrainingData& data,
                                                const HysteresisSearchOptions& options,
                                                const Progress& progress = {});

/// From the curves of rising and falling samples and three stiffnesses; h >= 0 by bounds on its
/// Bernstein coefficients.
[[nodiscard]] Fitted<NonlinearBacklash> fit_nonlinear_backlash(
    const TrainingData& data, const HysteresisSearchOptions& options,
    const Progress& progress = {});

/// The same with the growth by rate. @throws Error if no input tells a rate.
[[nodiscard]] Fitted<ImprovedNonlinearBacklash> fit_improved_nonlinear_backlash(
    const TrainingData& data, const HysteresisSearchOptions& options,
    const Progress& progress = {});

/// Both decays are searched from four starts; the curves are linear and solved for each of them.
[[nodiscard]] Fitted<ExponentialLoading> fit_exponential_loading(
    const TrainingData& data, const HysteresisSearchOptions& options,
    const Progress& progress = {});

}  // namespace torsio

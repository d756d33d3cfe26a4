#pragma once

#include <cstddef>
#include <string>

#include "fit/common/fitted.hpp"
#include "fit/common/shared_options.hpp"
#include "model/hysteresis/bouc_wen_model.hpp"
#include "model/hysteresis/exponential_loading.hpp"
#include "model/hysteresis/improved_prandtl_ishlinskii.hpp"
#include "model/hysteresis/nonlinear_backlash.hpp"
#include "model/hysteresis/operator_sum.hpp"
#include "torsio/core/progress.hpp"
#include "torsio/fit/common/family_info.hpp"
#include "torsio/fit/common/options.hpp"
#include "torsio/fit/common/training_data.hpp"

// Fits of hysteresis operators. The operator is evaluated at every sample of a record that has
// features (where samples between two turning points change nothing, only at those that are
// scored); the fit uses the usable samples, the search of a non-linear family at most
// `kMaxResiduals` of them, evenly spread. Other inputs get slopes as in `fit_polynomial`.
//
// All @throw Error if the first input is constant in the training data or there are too few
// samples; those that search, also if no start converges: a search that stopped early has no
// result.

namespace torsio {

inline constexpr std::size_t kMaxResiduals = 10000;

inline constexpr std::size_t kMaxThresholds = 64;
inline constexpr std::size_t kHighestCurveDegree = 9;

/// Options that several operators share.
inline constexpr OptionInfo kThresholdsOption{.name = "thresholds",
                                              .minimum = 1,
                                              .maximum = kMaxThresholds,
                                              .help = "of the operators, by the input's range"};
inline constexpr OptionInfo kWeightScheduleOption{
    .name = "schedule",
    .help = "input over whose distinct training values all weights are interpolated"};
inline constexpr OptionInfo kSearchIterationsOption{
    .name = "iterations",
    .minimum = 1,
    .maximum = 100000,
    .help = "of the search from each start, at most"};

struct MaxwellSlipOptions {
  std::size_t thresholds = 8;
  bool rates = false;         ///< give other inputs that are rates a slope too
  std::string schedule = {};  ///< expression of the input to schedule over; empty: constant

  template <class Self, class Visit>
  static void visit_options(Self& self, const Visit& visit) {
    visit(self.thresholds, kThresholdsOption);
    visit(self.rates, kRatesOption);
    visit(self.schedule, kWeightScheduleOption);
  }
};

struct PrandtlIshlinskiiOptions {
  std::size_t thresholds = 8;
  bool passive = true;
  bool rates = false;         ///< give other inputs that are rates a slope too
  std::string schedule = {};  ///< expression of the input to schedule over; empty: constant

  template <class Self, class Visit>
  static void visit_options(Self& self, const Visit& visit) {
    visit(self.thresholds, kThresholdsOption);
    visit(self.passive, {.name = "passive",
                         .help = "keep weights to the sign with which no closed path gives work"});
    visit(self.rates, kRatesOption);
    visit(self.schedule, kWeightScheduleOption);
  }
};

/// Non-negative least squares for stiffnesses of elements whose thresholds are fixed: from half the
/// range of x_0 down to 1/128 of that, in equal ratios. @throws as `fit_polynomial`, too.
[[nodiscard]] Fitted<MaxwellSlipModel> fit_maxwell_slip(const TrainingData& data,
                                                        const MaxwellSlipOptions& options);

/// The same with thresholds at quantiles of |x_0 - mid-range|: (i - 1/2) / n, i = 1 .. n.
[[nodiscard]] Fitted<PrandtlIshlinskii> fit_prandtl_ishlinskii(
    const TrainingData& data, const PrandtlIshlinskiiOptions& options);

struct ImprovedPrandtlIshlinskiiOptions {
  std::size_t thresholds = 8;
  std::size_t bends = 4;
  bool rates = false;
  std::size_t max_iterations = 200;

  template <class Self, class Visit>
  static void visit_options(Self& self, const Visit& visit) {
    visit(self.thresholds, kThresholdsOption);
    visit(self.bends, {.name = "bends",
                       .maximum = 32,
                       .help = "of the curve after the operator, half on either side of 0"});
    visit(self.rates, kRatesOption);
    visit(self.max_iterations, kSearchIterationsOption);
  }
};

/// Starts from the plain operator. @throws Error if no input is a rate.
[[nodiscard]] Fitted<ImprovedPrandtlIshlinskii> fit_improved_prandtl_ishlinskii(
    const TrainingData& data, const ImprovedPrandtlIshlinskiiOptions& options,
    const Progress& progress = {});

struct BoucWenOptions {
  bool rates = false;
  std::size_t max_iterations = 200;

  template <class Self, class Visit>
  static void visit_options(Self& self, const Visit& visit) {
    visit(self.rates, kRatesOption);
    visit(self.max_iterations, kSearchIterationsOption);
  }
};

/// z_max, n and gamma / beta are searched from four starts; the rest is linear and solved for
/// each of their values, the hysteresis constrained to be >= 0. Uses a quarter of `kMaxResiduals`
/// samples, because powers are slow to compute.
[[nodiscard]] Fitted<BoucWenModel> fit_bouc_wen(const TrainingData& data,
                                                const BoucWenOptions& options,
                                                const Progress& progress = {});

struct BacklashOptions {
  std::size_t degree = 5;
  bool rates = false;
  std::size_t max_iterations = 200;

  template <class Self, class Visit>
  static void visit_options(Self& self, const Visit& visit) {
    visit(self.degree,
          {.name = "degree", .maximum = kHighestCurveDegree, .help = "of the boundaries"});
    visit(self.rates, kRatesOption);
    visit(self.max_iterations, kSearchIterationsOption);
  }
};

/// From the curves of rising and falling samples and three stiffnesses; h >= 0 by bounds on its
/// Bernstein coefficients.
[[nodiscard]] Fitted<NonlinearBacklash> fit_nonlinear_backlash(const TrainingData& data,
                                                               const BacklashOptions& options,
                                                               const Progress& progress = {});

/// The same with the growth by rate. @throws Error if no input is a rate.
[[nodiscard]] Fitted<ImprovedNonlinearBacklash> fit_improved_nonlinear_backlash(
    const TrainingData& data, const BacklashOptions& options, const Progress& progress = {});

struct ExponentialLoadingOptions {
  std::size_t degree = 1;
  bool rates = false;
  std::size_t max_iterations = 200;

  template <class Self, class Visit>
  static void visit_options(Self& self, const Visit& visit) {
    visit(self.degree,
          {.name = "degree", .maximum = kHighestCurveDegree, .help = "of the curves it nears"});
    visit(self.rates, kRatesOption);
    visit(self.max_iterations, kSearchIterationsOption);
  }
};

/// Both decays are searched from four starts; the curves are linear and solved for each of them.
[[nodiscard]] Fitted<ExponentialLoading> fit_exponential_loading(
    const TrainingData& data, const ExponentialLoadingOptions& options,
    const Progress& progress = {});

}  // namespace torsio

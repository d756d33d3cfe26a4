#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <string_view>
#include <vector>

#include "fit/common/fitted.hpp"
#include "model/linear/linear.hpp"
#include "model/narx/narx.hpp"
#include "torsio/fit/common/family_info.hpp"
#include "torsio/fit/common/fit_context.hpp"
#include "torsio/fit/common/options.hpp"
#include "torsio/fit/common/training_data.hpp"
#include "torsio/model/any_model.hpp"

namespace torsio {

struct NarxLags {
  std::size_t inputs = 2;   ///< n_u
  std::size_t outputs = 2;  ///< n_y

  template <class Self, class Visit>
  static void visit_options(Self& self, const Visit& visit) {
    visit(self.inputs, {.name = "input_lags",
                        .maximum = 1000,
                        .help = "past samples of each input that the model uses"});
    visit(self.outputs, {.name = "output_lags",
                         .minimum = 1,
                         .maximum = 1000,
                         .help = "its own past outputs that it uses"});
  }
};

/// What f is trained with in place of its past outputs.
enum class NarxTraining : std::uint8_t {
  one_step,  ///< the measured ones: fast, but the growth of errors is not considered
  noise,     ///< the measured ones with noise, so that errors decay
  free_run,  ///< its own, in several rounds; the round with the least error in free run is kept
};

inline constexpr std::array<std::string_view, 3> kNarxTrainings{"one_step", "noise", "free_run"};

/// Options that NARX models share.
inline constexpr OptionInfo kOutputRangeOption{
    .name = "output_range",
    .minimum = 1,
    .maximum = 1e6,
    .help = "times the largest training |target|: where the output is clipped"};
inline constexpr OptionInfo kFeedbackNoiseOption{
    .name = "feedback_noise",
    .maximum = 10,
    .help = "of training=noise, as a share of the target's standard deviation"};

struct NarxOptions {
  NarxLags lags = {};
  NarxTraining training = NarxTraining::free_run;
  double noise = 0.02;     ///< standard deviation, as a share of the target's
  std::size_t rounds = 5;  ///< free_run after the first fit one step ahead
  double range = 1.2;      ///< limit of the output over the largest |target|

  template <class Self, class Visit>
  static void visit_options(Self& self, const Visit& visit) {
    NarxLags::visit_options(self.lags, visit);
    visit(self.training,
          {.name = "training",
           .help = "what past outputs are while it learns: one_step (measured), noise (measured, "
                   "with noise), free_run (its own, in rounds)",
           .choices = kNarxTrainings});
    visit(self.noise, kFeedbackNoiseOption);
    visit(self.rounds,
          {.name = "rounds", .minimum = 1, .maximum = 1000, .help = "of training=free_run"});
    visit(self.range, kOutputRangeOption);
  }
};

/// The regressors of a NARX model as data to fit f on: the inputs, their lags, and past outputs. A
/// sample is usable if all of these lie in its record and are finite; held samples of a slower
/// sensor count as measured.
/// @param outputs used in place of the past outputs, one list per sequence; null: the target itself
[[nodiscard]] TrainingData narx_data(const TrainingData& data, const NarxLags& lags,
                                     const std::vector<std::vector<double>>* outputs = nullptr);

/// The functions that make one static family dynamic.
struct NarxInner {
  std::function<FittedModel(const TrainingData&, const FitContext&)> fit;
  /// Combines f and the rest of a `Narx`'s parameters (those of its own fields) to the model.
  std::function<AnyModel(const AnyModel& f, const Narx<Linear>::Parameters& rest)> wrap;
};

/// Trains f on `narx_data`, according to `options.training`. Deterministic for a seed. Source:
/// specification 3.3 (NARX evaluation).
/// @throws Error as f's fitter, or if no record outlasts the lags; UsageError for lags out of range.
[[nodiscard]] FittedModel fit_narx(const TrainingData& data, const NarxOptions& options,
                                   const NarxInner& inner, const FitContext& context = {});

struct ArxOptions {
  NarxLags lags = {};
  bool is_refined = true;
  double range = 1.2;

  template <class Self, class Visit>
  static void visit_options(Self& self, const Visit& visit) {
    NarxLags::visit_options(self.lags, visit);
    visit(self.is_refined,
          {.name = "refine", .help = "from one step ahead to least error in free run"});
    visit(self.range, kOutputRangeOption);
  }
};

/// A linear NARX model (ARX) by least squares one step ahead, refined for the least error
/// in free run (output error):
///
///     min_θ Σ (ŷ_k(θ) − y_k)²,   dŷ_k/dθ = φ_k + Σ_i a_i dŷ_{k−i}/dθ
///
/// The refinement is dropped where it does not lower the error in free run, or leaves the output's
/// range. Source: specification 3.3.
/// @throws Error if no record outlasts the lags; UsageError for lags out of range.
[[nodiscard]] Fitted<Narx<Linear>> fit_arx(const TrainingData& data, const ArxOptions& options,
                                           const FitContext& context = {});

}  // namespace torsio

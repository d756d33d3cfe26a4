#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <string_view>

#include "fit/common/fitted.hpp"
#include "fit/narx/fit_narx.hpp"
#include "fit/narx/frols.hpp"
#include "model/narx/multivariate_polynomial.hpp"
#include "model/narx/narx.hpp"
#include "torsio/fit/common/family_info.hpp"
#include "torsio/fit/common/fit_context.hpp"
#include "torsio/fit/common/training_data.hpp"

namespace torsio {

struct NarxPolynomialOptions {
  NarxLags lags = {};
  std::size_t degree = 3;  ///< highest degree of the candidate terms
  /// Number of terms; 0: chosen by the error in free run, up to `kMaxAutomatic`.
  std::size_t terms = 0;
  bool exchange = true;
  /// one_step, or noise: least squares. free_run: then refined, as `fit_arx`.
  NarxTraining training = NarxTraining::free_run;
  double noise = 0.02;  ///< standard deviation, as a share of the target's
  double range = 1.2;   ///< limit of the output over the largest |target|

  static constexpr std::size_t kMaxAutomatic = 20;

  template <class Self, class Visit>
  static void visit_options(Self& self, const Visit& visit) {
    NarxLags::visit_options(self.lags, visit);
    visit(self.degree, {.name = "degree",
                        .minimum = 1,
                        .maximum = MultivariatePolynomial::kHighestDegree,
                        .help = "of the terms to choose from"});
    visit(self.terms,
          {.name = "terms",
           .maximum = kMaxTerms,
           .help = "number of terms; 0: chosen by free run on held-out records, up to 20"});
    visit(self.exchange,
          {.name = "exchange", .help = "swap chosen terms for others wherever that explains more"});
    visit(self.training,
          {.name = "training",
           .help = "of the coefficients: one_step (on measured past outputs), noise (on these with "
                   "noise), free_run (then refined to least error in free run)",
           .choices = kNarxTrainings});
    visit(self.noise, kFeedbackNoiseOption);
    visit(self.range, kOutputRangeOption);
  }
};

/// A polynomial NARX model whose terms `frols` chooses from all monomials of inputs, their lags and
/// past outputs.
/// With terms = 0 the number is the least whose free run is within 2 % of the best, on the
/// validation records, else on blocks of the training records that were held out from the choice
/// (two tenths of every long one; whole ones of five and more; else on the training records
/// themselves, which a note reports). The criterion is the error in free run and not one step
/// ahead: AIC and similar criteria measure how well the last value is continued, which is not the
/// task of a sensor. The coefficients are then fitted to all training records. Source:
/// specification 3.3; Billings 2013, chapter 3.
/// @throws Error if no record outlasts the lags, or there are fewer than five samples for each term;
/// UsageError for lags, degree or terms out of range, or too many candidates.
[[nodiscard]] Fitted<Narx<MultivariatePolynomial>> fit_narx_polynomial(
    const TrainingData& data, const NarxPolynomialOptions& options, const FitContext& context = {});

/// "torque_Nm[k] = 0.31 torque_Nm[k-1] - 0.02 u_rad[k]^2 torque_Nm[k-2]", in the units of the channels.
/// Inputs that are expressions are named u1, u2, ...; their definitions follow the equation.
[[nodiscard]] std::string equation_of(const Narx<MultivariatePolynomial>::Parameters& parameters,
                                      std::span<const std::string> inputs, std::string_view target);

}  // namespace torsio

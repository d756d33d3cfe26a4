#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

#include "fit/common/fitted.hpp"
#include "fit/gaussian_process/fit_gaussian_process.hpp"
#include "model/gaussian_process/parametric_gp.hpp"
#include "torsio/fit/common/fit_context.hpp"
#include "torsio/fit/common/training_data.hpp"

namespace torsio {

/// What Algorithm 1 of paper 002 starts from at ln 0.3 and moves by plain steps, since the paper does
/// not state whether its theta are logarithms.
enum class ThetaReading : std::uint8_t {
  logarithm,  ///< the nine logarithms: every theta starts at 0.3
  plain  ///< the nine theta themselves: -1.204, also theta_8, so that the kernel ends at a distance
};
inline constexpr std::array<std::string_view, 2> kThetaReadings{"logarithm", "plain"};

/// How (20) and (21) are read.
enum class MomentReading : std::uint8_t {
  corrected,  ///< with S K^-1 q and sigma^2 (specification 1), the equations of the source of the paper
  printed  ///< with q and without sigma^2
};
inline constexpr std::array<std::string_view, 2> kMomentReadings{"corrected", "printed"};

/// The name of the row in `Fitted::table`.
inline constexpr std::string_view kSamplesTakenIn = "samples taken in";

/// The defaults are Algorithm 1; each further option is a departure from it.
struct PaperGpOptions {
  std::string kernel = "se*(linear+periodic*rq)";
  std::size_t inducing_points = 14;
  std::size_t updates = 200'000;
  ThetaReading theta = ThetaReading::logarithm;
  MomentReading moments = MomentReading::corrected;
  bool standardise = false;
  double first_noise = 1.0;
  bool adam = false;
  bool elbo = false;
  bool widen = false;
  bool refit = false;

  template <class Self, class Visit>
  static void visit_options(Self& self, const Visit& visit) {
    visit(self.kernel, kKernelOption);
    visit(self.inducing_points, {.name = "inducing_points",
                                 .minimum = 1,
                                 .maximum = ParametricGp::kMaxPoints,
                                 .help = "number of inducing points"});
    visit(self.updates,
          {.name = "updates", .maximum = 1e9, .help = "samples taken in, drawn by chance"});
    visit(self.theta, {.name = "theta",
                       .help = "what starts at ln 0.3 and moves by plain steps",
                       .choices = kThetaReadings});
    visit(self.moments,
          {.name = "moments", .help = "how (20) and (21) are read", .choices = kMomentReadings});
    visit(self.standardise,
          {.name = "standardise", .help = "inputs and target to mean 0, variance 1"});
    visit(self.first_noise,
          {.name = "first_noise",
           .minimum = 1e-9,
           .maximum = 1e3,
           .help = "variance of the noise at the start, over that of the target"});
    visit(self.adam,
          {.name = "adam", .help = "steps of Adam at a rate of 0.01, on logarithms and theta_4"});
    visit(self.elbo, {.name = "elbo", .help = "adds KL(N(m, S) | N(0, K)) / H to the objective"});
    visit(self.widen,
          {.name = "widen", .help = "S half way back to K every 1000 samples of the first 80 %"});
    visit(self.refit, {.name = "refit", .help = "try the closed form over all samples at the end"});
  }
};

/// The improved parametric Gaussian process of paper 002 by its Algorithm 1: Z by k-means, m = 0, S = K,
/// sigma^2 the sample variance of the target, plain steps of 0.1 on (16) and (17), inputs and target in
/// their own units, 2e5 samples drawn by chance, f(x) = q . K^-1 m.
///
/// Misprints that are corrected, without which nothing can be computed: exp in (12); q for q^T at the end of
/// (19); (20) and (21) for (18) and (19) in step 5; and, unless `moments=printed`, S K^-1 q for q^T and
/// Sigma + sigma^2 for Sigma in (20), (21) (specification 1). theta_1 is the amplitude of the first kernel of
/// the expression; in the default it multiplies the whole. Without `standardise`, ln sigma^2 stays above -27.8.
///
/// `table` has the number of samples that were taken in before the kernel became unusable (`kSamplesTakenIn`).
///
/// Deterministic for a seed. Cost: `updates` times M^3 / 3 for the factor of K.
/// @throws as `fit_parametric_gp`.
[[nodiscard]] Fitted<ParametricGp> fit_parametric_gp_paper(const TrainingData& data,
                                                           const PaperGpOptions& options,
                                                           const FitContext& context = {});

}  // namespace torsio

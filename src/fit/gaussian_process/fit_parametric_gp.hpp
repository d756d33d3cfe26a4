#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "fit/common/fitted.hpp"
#include "fit/gaussian_process/fit_gaussian_process.hpp"
#include "model/gaussian_process/parametric_gp.hpp"
#include "torsio/fit/common/family_info.hpp"
#include "torsio/fit/common/fit_context.hpp"
#include "torsio/fit/common/training_data.hpp"

namespace torsio {

/// What the kernel's numbers theta descend on by Adam, sample by sample, while (m, S) takes each sample in:
///
///     nlml         m . K^-1 m / 2 + ln det K / 2 (Raissi); the noise on (16)
///     elbo         (16) = ((y - mu)^2 + Sigma) / (2 sigma^2) + ln sigma^2 / 2, and KL(N(m, S) | N(0, K)) / H,
///                  H the number of samples
///     recommended  elbo; S half way back to K every 1000 samples of the first 80 %, so that learning
///                  does not freeze
///
/// Algorithm 1 of paper 002 is a family of its own: `fit_parametric_gp_paper`.
enum class ParametricGpMode : std::uint8_t { nlml, elbo, recommended };

inline constexpr std::array<std::string_view, 3> kParametricGpModes{"nlml", "elbo", "recommended"};

/// theta_1 ... theta_9 of the combined kernel (paper 002, equations 9 to 13 as corrected in
/// specification 1).
using PlainKernel = std::array<double, 9>;

struct ParametricGpOptions {
  ParametricGpMode mode = ParametricGpMode::recommended;
  std::string kernel = "se*(linear+periodic*rq)";  ///< see `parse_kernel`
  std::size_t inducing_points = 14;                ///< M
  std::size_t updates = 20000;                     ///< samples taken in, drawn by chance
  std::size_t batch = 1;        ///< samples between two steps of the kernel's numbers
  double learning_rate = 0.01;  ///< for Adam
  bool refit = true;            ///< try the closed form over all samples at the end
  std::optional<PlainKernel> kernel_plain = {};  ///< in place of `kernel`, in physical units, fixed

  template <class Self, class Visit>
  static void visit_options(Self& self, const Visit& visit) {
    visit(self.mode,
          {.name = "mode", .help = "what the kernel descends on", .choices = kParametricGpModes});
    visit(self.kernel, kKernelOption);
    visit(self.inducing_points, {.name = "inducing_points",
                                 .minimum = 1,
                                 .maximum = ParametricGp::kMaxPoints,
                                 .help = "number of inducing points"});
    visit(self.updates,
          {.name = "updates", .maximum = 1e9, .help = "samples taken in, drawn by chance"});
    visit(self.batch, {.name = "batch",
                       .minimum = 1,
                       .maximum = 1e6,
                       .help = "samples between two steps of the kernel's numbers"});
    visit(self.learning_rate,
          {.name = "learning_rate", .minimum = 1e-9, .maximum = 1e3, .help = "of Adam"});
    visit(self.refit, {.name = "refit", .help = "try the closed form over all samples at the end"});
    visit(self.kernel_plain, {.name = "kernel_plain",
                              .help = "theta 1 to 9 of paper 002 as plain numbers, joined by /, in "
                                      "place of kernel"});
  }
};

/// Learns a parametric Gaussian process sample by sample. With a = K^-1 q of a sample (x, y) and
/// g = S a:
///
///     mu = a . m,   Sigma = k(x, x) - q . a + a . g
///     m += g (y - mu) / (Sigma + sigma^2),   S -= g g^T / (Sigma + sigma^2)
///
/// (20) and (21) of paper 002 as corrected in specification 1; for a fixed kernel this is the FITC
/// posterior. Z are the centres of k-means++. In the end the FITC posterior at the kernel found is
/// computed in closed form over all samples, and kept if its error is less on the validation
/// records, or without these on every fifth of 50 blocks of the training samples, held out for
/// this.
///
/// With `kernel_plain` (Table II of the paper, read as plain numbers) inputs and target keep their
/// units, theta stays, and only (m, S) and the noise are learned. A negative theta_8 makes a kernel
/// that ends at r^2 = 2 |theta_8| theta_9^2: data beyond are refused.
///
/// Source: specification 3.3. Deterministic for a seed.
/// @throws UsageError if the kernel's text is none; Error if data lie outside the kernel's domain or
/// its matrix has no factor at the start; Cancelled.
[[nodiscard]] Fitted<ParametricGp> fit_parametric_gp(const TrainingData& data,
                                                     const ParametricGpOptions& options,
                                                     const FitContext& context = {});

/// The combined kernel with these numbers. theta_1 is folded into theta_3 and theta_5, with which
/// it occurs only as a product; signs of theta_2, 3, 5, 6, 7, 9 have no effect.
/// @throws Error if one that must not be 0 is, or is not finite.
[[nodiscard]] KernelExpression kernel_plain(const PlainKernel& theta);

struct VariationalGpOptions {
  std::string kernel = "linear_ard+matern52_ard";  ///< see `parse_kernel`
  std::size_t inducing_points = 100;               ///< M
  std::size_t samples = 5000;    ///< that the kernel's numbers are found on, at most; 0: all
  std::size_t iterations = 100;  ///< at most

  template <class Self, class Visit>
  static void visit_options(Self& self, const Visit& visit) {
    visit(self.kernel, kKernelOption);
    visit(self.inducing_points, {.name = "inducing_points",
                                 .minimum = 1,
                                 .maximum = ParametricGp::kMaxPoints,
                                 .help = "number of inducing points"});
    visit(self.samples, {.name = "samples",
                         .maximum = 1e9,
                         .help = "that the kernel's numbers are found on, at most; 0: all"});
    visit(self.iterations,
          {.name = "iterations", .maximum = 1e6, .help = "of that search, at most"});
  }
};

/// A sparse Gaussian process by the variational bound of Titsias 2009, collapsed over u:
///
///     L = ln N(y | 0, Q + sigma^2 I) - tr(k(X, X) - Q) / (2 sigma^2),   Q = K_xz K^-1 K_zx
///
/// Z are the centres of k-means++; kernel and noise maximise L over a part of the samples (L-BFGS with
/// analytic gradients), and u is the optimum in closed form over all of them. It does what
/// `fit_parametric_gp` is after, without a learning rate and without forgetting.
///
/// Deterministic for a seed. Cost: N M^2 an iteration.
/// @throws as `fit_gaussian_process`.
[[nodiscard]] Fitted<ParametricGp> fit_variational_gp(const TrainingData& data,
                                                      const VariationalGpOptions& options,
                                                      const FitContext& context = {});

}  // namespace torsio

#pragma once

#include <cstddef>
#include <string>

#include "fit/common/fitted.hpp"
#include "model/gaussian_process/gaussian_process.hpp"
#include "torsio/fit/common/family_info.hpp"
#include "torsio/fit/common/fit_context.hpp"
#include "torsio/fit/common/options.hpp"
#include "torsio/fit/common/training_data.hpp"

namespace torsio {

inline constexpr OptionInfo kKernelOption{
    .name = "kernel",
    .help =
        "se, linear, periodic, rq, matern32, matern52, each perhaps with _ard (a length scale an "
        "input), joined by +, * and brackets"};

struct GaussianProcessOptions {
  std::string kernel = "linear_ard+matern52_ard";  ///< see `parse_kernel`
  std::size_t samples = 500;     ///< at most so many training samples, drawn by chance; 0: all
  std::size_t restarts = 3;      ///< searches of the hyperparameters after the first
  std::size_t iterations = 100;  ///< limit of one search; 0: start values
  bool std_dev = true;           ///< compute the error bar in every step, at N^2 / 2 operations

  template <class Self, class Visit>
  static void visit_options(Self& self, const Visit& visit) {
    visit(self.kernel, kKernelOption);
    visit(self.samples, {.name = "samples",
                         .maximum = GaussianProcess::kMaxPoints,
                         .help = "at most so many training samples, drawn by chance; 0: all"});
    visit(self.restarts,
          {.name = "restarts",
           .maximum = 1000,
           .help = "of the search for the kernel's numbers, besides the first start"});
    visit(self.iterations,
          {.name = "iterations", .maximum = 1e6, .help = "of one search, at most"});
    visit(self.std_dev, {.name = "std_dev",
                         .help = "know an error bar in every step, at samples^2 / 2 operations"});
  }
};

/// Fits an exact Gaussian process: standardises, draws `samples` usable samples, and finds kernel and
/// noise by the largest marginal likelihood (L-BFGS with analytic gradients), from several starts on
/// at most `kSearchedSamples` of them and from the best of these on all. The notes hold the kernel
/// found, the likelihood and the scores of leaving one sample out.
///
/// Source: Rasmussen and Williams 2006, chapters 2 and 5. Deterministic for a seed. Memory
/// 16 N^2 bytes, time N^3 operations an iteration.
/// @throws UsageError if the kernel's text is none, or more samples are to have an error bar than
/// `GaussianProcess` takes; Error if N samples do not fit into the memory (with the number that
/// does) or no start gives a matrix with a factor; Cancelled.
[[nodiscard]] Fitted<GaussianProcess> fit_gaussian_process(const TrainingData& data,
                                                           const GaussianProcessOptions& options,
                                                           const FitContext& context = {});
inline constexpr std::size_t kSearchedSamples = 300;

}  // namespace torsio

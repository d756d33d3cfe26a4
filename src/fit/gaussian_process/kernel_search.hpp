#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "model/gaussian_process/kernel.hpp"
#include "numerics/lbfgs.hpp"
#include "torsio/core/random.hpp"
#include "torsio/fit/common/fit_context.hpp"

namespace torsio {

/// Bounds and starts of a kernel's numbers together with the logarithm of the noise's variance, all
/// for standardised data.
struct KernelSearch {
  std::size_t iterations = 100;
  LbfgsSettings settings;

  KernelSearch(const Kernel& kernel, std::size_t max_iterations);
};

/// ln sigma^2 to start from, and its least: the floor of specification 3.3.
inline constexpr double kFirstLogNoise = -4.605170185988091;   // ln 0.01
inline constexpr double kLeastLogNoise = -13.815510557964274;  // ln 1e-6

/// The kernel's numbers and the first noise.
[[nodiscard]] std::vector<double> first_start(const Kernel& kernel);
/// The same moved by chance, by about a factor of e.
[[nodiscard]] std::vector<double> moved_start(const std::vector<double>& start, Random& random);

/// `f`, with each evaluation reported to the context's progress as a fraction of [begin, end).
[[nodiscard]] Differentiable reported(Differentiable f, const FitContext& context, double begin,
                                      double end, std::size_t iterations, std::string doing);

/// "length_scales 0.3, 1.2" and so on for every node, for the notes.
[[nodiscard]] std::string description_of(const KernelExpression& kernel);

}  // namespace torsio

#pragma once

#include <cstddef>
#include <functional>
#include <span>
#include <vector>

namespace torsio {

struct LbfgsSettings {
  std::size_t iterations = 100;      ///< at most
  double tolerance = 1e-9;           ///< ends when an iteration gains less of |f|
  double gradient_tolerance = 1e-5;  ///< ends when no free component is larger
  double longest_step = 2.0;         ///< limit for each variable
  double first_step = 1.0;           ///< length of the first trial, at most
  std::vector<double> lowest = {};   ///< bounds, one a variable, or empty
  std::vector<double> highest = {};
};

struct LbfgsResult {
  std::vector<double> at;
  double value = 0.0;
  std::size_t iterations = 0;
  std::size_t evaluations = 0;
};

/// f at `x` and its gradient; NaN or infinity where there is none.
using Differentiable = std::function<double(std::span<const double> x, std::span<double> gradient)>;

/// A local minimum between bounds: limited-memory BFGS (Nocedal and Wright 2006, algorithm 7.5, ten
/// pairs) over the variables that are not held by a bound, with backtracking to Armijo's condition.
/// What `f` throws passes through.
[[nodiscard]] LbfgsResult minimise(const Differentiable& f, std::vector<double> start,
                                   const LbfgsSettings& settings);

}  // namespace torsio

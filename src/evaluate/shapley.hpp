#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "torsio/fit/common/training_data.hpp"
#include "torsio/model/any_model.hpp"

namespace torsio {

/// Exact Shapley values of a game:
///
///     phi_i = sum over S without i of |S|! (n-|S|-1)! / n! [v(S + i) - v(S)]
///
/// @param values v(S) for each of 2^n coalitions; bit i of the index: player i takes part.
/// @throws Error if their number is not a power of two.
[[nodiscard]] std::vector<double> shapley_values(std::span<const double> values);

/// The samples after which a model's output is independent of its start: the least power of two, up
/// to 1024, after which it differs in 95 % of the cases by at most 0.1 % of its spread from its
/// output in the course of the recording. 1 for a model without memory.
struct Memory {
  std::size_t samples = 1;
  bool is_longer = false;  ///< longer than 1024 samples, or than the recordings
};

[[nodiscard]] Memory memory_samples(const AnyModel& model, const TrainingData& data,
                                    std::uint64_t seed);

}  // namespace torsio

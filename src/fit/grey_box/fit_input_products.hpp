#pragma once

#include <cstddef>

#include "model/grey_box/input_products.hpp"
#include "torsio/fit/common/training_data.hpp"

namespace torsio {

/// Least squares of all products of up to `degree` inputs, each input about its mean in units of its standard
/// deviation:
///
///     min sum (y - c . p(z))^2 + lambda n |c|^2,   lambda = 0.01; of the constant 0
///
/// At most `kMaxProductInputs` varying inputs are used: the first ones, and a selection of the last `optional` ones of `data`
/// that is spread evenly.
/// @throws Error if no input varies, or there are fewer samples than products.
[[nodiscard]] InputProducts::Parameters fit_input_products(const TrainingData& data,
                                                           std::size_t degree,
                                                           std::size_t optional);

inline constexpr std::size_t kMaxProductInputs = 7;  ///< 120 products of degree 3

}  // namespace torsio

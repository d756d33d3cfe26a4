#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <string_view>
#include <vector>

#include "torsio/safety/redundancy.hpp"

namespace torsio::detail {

using SquareMatrix =
    std::array<std::array<double, Redundancy::kMaxSources>, Redundancy::kMaxSources>;

/// The correlation of the errors of `count` sources. @param rows row by row; empty: none
/// @throws Error unless it is symmetric, has ones on its diagonal and is positive definite.
[[nodiscard]] SquareMatrix error_correlation(const std::vector<double>& rows, std::size_t count,
                                             std::string_view place);

/// The weights x with sum 1, of either sign, for which x' C x is smallest: x = C^-1 1 / (1' C^-1 1).
/// @param index rows and columns of C, which is positive definite
/// @returns the weight of index[k] at place k
[[nodiscard]] std::array<double, Redundancy::kMaxSources> smallest_variance(
    const SquareMatrix& covariance, std::span<const std::size_t> index) noexcept;

}  // namespace torsio::detail

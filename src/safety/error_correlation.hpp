#pragma once

#include <array>
#include <cstddef>
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

/// The inverses of the correlation of each set of the sources: element [(set * count + i) * count +
/// j], bit i of `set` is source i; 0 where i or j is not in the set.
[[nodiscard]] std::vector<double> inverses(const SquareMatrix& correlation, std::size_t count);

}  // namespace torsio::detail

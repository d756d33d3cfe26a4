#pragma once

#include <cstddef>
#include <limits>

namespace torsio::nearest_kernel {

/// Points are stored in blocks of 16, a row of 16 values for each dimension.
inline constexpr std::size_t kLanes = 16;

/// Coordinate of a free slot: no point has a finite distance to it.
inline constexpr float kFarAway = std::numeric_limits<float>::infinity();

/// The slot nearest to `at` by squared distance in float32, the first of equals; 0 where no
/// distance is finite, so never a free slot. The same bits on every instruction set, so that what
/// is learned does not depend on the machine.
std::size_t nearest(const float* points, std::size_t blocks, std::size_t dimension,
                    const float* at) noexcept;

}  // namespace torsio::nearest_kernel

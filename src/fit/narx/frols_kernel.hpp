#pragma once

#include <cstddef>
#include <cstdint>

namespace torsio::frols_kernel {

/// Samples per block: a multiple of every vector's length.
inline constexpr std::size_t kBlock = 128;

/// A candidate as its parent times one more regressor.
struct Candidate {
  std::uint32_t parent;
  std::uint32_t column;
};

/// All candidates, each after its parent. The first is its own parent.
struct Candidates {
  const Candidate* list;
  std::size_t count;
  std::size_t parents;  ///< the first so many have children
};

/// Over one block of samples: dots_j += phi_j . v, and squares_j += phi_j . phi_j unless null.
/// @param columns of the regressors, the block's first sample, `stride` apart; the first is 1 where
/// a sample is, 0 after the last.
/// @param scratch `parents` x kBlock, on a cache line.
void add_products(const Candidates& candidates, const double* columns, std::size_t stride,
                  const double* v, double* scratch, double* dots, double* squares) noexcept;

}  // namespace torsio::frols_kernel

#include "fit/mixture/nearest_kernel.hpp"

#include <array>
#include <cstdint>
#include <limits>

// Highway compiles this file once for each instruction set; the order of its headers matters.
// clang-format off
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "fit/mixture/nearest_kernel.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>
// clang-format on

HWY_BEFORE_NAMESPACE();
namespace torsio::nearest_kernel::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

template <std::size_t kFixed>
std::size_t nearest_fixed(const float* HWY_RESTRICT points, std::size_t blocks,
                          std::size_t dimension, const float* HWY_RESTRICT at) {
  const hn::CappedTag<float, kLanes> d;
  const hn::RebindToSigned<decltype(d)> di;
  const std::size_t n = kFixed > 0 ? kFixed : dimension;
  std::size_t best_slot = 0;
  float best_distance = std::numeric_limits<float>::infinity();
  for (std::size_t lane = 0; lane < kLanes; lane += hn::Lanes(d)) {
    auto smallest = hn::Set(d, std::numeric_limits<float>::infinity());
    auto where = hn::Zero(di);
    for (std::size_t b = 0; b < blocks; ++b) {
      const float* HWY_RESTRICT block = points + b * n * kLanes + lane;
      auto distance = hn::Zero(d);
      for (std::size_t j = 0; j < n; ++j) {
        const auto offset = hn::Sub(hn::Set(d, at[j]), hn::Load(d, block + j * kLanes));
        distance = hn::Add(distance, hn::Mul(offset, offset));  // not fused: see the header
      }
      const auto closer = hn::Lt(distance, smallest);
      smallest = hn::IfThenElse(closer, distance, smallest);
      where = hn::IfThenElse(hn::RebindMask(di, closer), hn::Set(di, static_cast<std::int32_t>(b)),
                             where);
    }
    alignas(64) std::array<float, kLanes> distances;
    alignas(64) std::array<std::int32_t, kLanes> found;
    hn::Store(smallest, d, distances.data());
    hn::Store(where, di, found.data());
    for (std::size_t k = 0; k < hn::Lanes(d); ++k) {
      const std::size_t slot = static_cast<std::size_t>(found[k]) * kLanes + lane + k;
      if (distances[k] < best_distance || (distances[k] == best_distance && slot < best_slot)) {
        best_distance = distances[k];
        best_slot = slot;
      }
    }
  }
  return best_slot;
}

std::size_t nearest_any(const float* points, std::size_t blocks, std::size_t dimension,
                        const float* at) {
  switch (dimension) {
    case 2: return nearest_fixed<2>(points, blocks, dimension, at);
    case 3: return nearest_fixed<3>(points, blocks, dimension, at);
    case 4: return nearest_fixed<4>(points, blocks, dimension, at);
    case 5: return nearest_fixed<5>(points, blocks, dimension, at);
    default: return nearest_fixed<0>(points, blocks, dimension, at);
  }
}

}  // namespace torsio::nearest_kernel::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace torsio::nearest_kernel {

HWY_EXPORT(nearest_any);

std::size_t nearest(const float* points, std::size_t blocks, std::size_t dimension,
                    const float* at) noexcept {
  return HWY_DYNAMIC_DISPATCH(nearest_any)(points, blocks, dimension, at);
}

}  // namespace torsio::nearest_kernel
#endif

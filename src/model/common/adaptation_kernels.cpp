#include "model/common/adaptation_kernels.hpp"

#include <algorithm>

// Highway compiles this file once for each instruction set; the order of its headers matters.
// clang-format off
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "model/common/adaptation_kernels.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>
// clang-format on

HWY_BEFORE_NAMESPACE();
namespace torsio::adaptation_kernels::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

using Lanes = hn::ScalableTag<double>;
using Vector = hn::Vec<Lanes>;
constexpr Lanes kTag;
constexpr std::size_t kLanes = hn::MaxLanes(kTag);

std::size_t lane_count() { return kLanes; }

Sums extend_by_one(const float* HWY_RESTRICT features, std::size_t count,
                   const double* HWY_RESTRICT weights, double* HWY_RESTRICT extended) {
  const hn::Rebind<float, Lanes> narrow;
  Vector dot = hn::Zero(kTag);
  Vector square = hn::Zero(kTag);
  const auto take = [&](Vector x, std::size_t at) HWY_ATTR {
    hn::Store(x, kTag, extended + at);
    dot = hn::MulAdd(hn::Load(kTag, weights + at), x, dot);
    square = hn::MulAdd(x, x, square);
  };
  std::size_t at = 0;
  for (; at + kLanes <= count; at += kLanes)
    take(hn::PromoteTo(kTag, hn::LoadU(narrow, features + at)), at);
  for (std::size_t lane = 0; lane < kLanes; ++lane)
    extended[at + lane] = at + lane < count    ? static_cast<double>(features[at + lane])
                          : at + lane == count ? 1.0
                                               : 0.0;
  take(hn::Load(kTag, extended + at), at);
  return {hn::GetLane(hn::SumOfLanes(kTag, dot)), hn::GetLane(hn::SumOfLanes(kTag, square))};
}

double blend_into(double* HWY_RESTRICT target, double keep, double gain,
                  const double* HWY_RESTRICT direction, std::size_t padded) {
  const Vector kept = hn::Set(kTag, keep);
  const Vector gained = hn::Set(kTag, gain);
  Vector square = hn::Zero(kTag);
  for (std::size_t at = 0; at < padded; at += kLanes) {
    const Vector moved = hn::Mul(gained, hn::Load(kTag, direction + at));
    const Vector now = hn::MulAdd(kept, hn::Load(kTag, target + at), moved);
    hn::Store(now, kTag, target + at);
    square = hn::MulAdd(now, now, square);
  }
  return hn::GetLane(hn::SumOfLanes(kTag, square));
}

double dot_product(const double* HWY_RESTRICT a, const double* HWY_RESTRICT b, std::size_t padded) {
  Vector sum = hn::Zero(kTag);
  for (std::size_t at = 0; at < padded; at += kLanes)
    sum = hn::MulAdd(hn::Load(kTag, a + at), hn::Load(kTag, b + at), sum);
  return hn::GetLane(hn::SumOfLanes(kTag, sum));
}

double rank_one_and_multiply(double* HWY_RESTRICT triangle, std::size_t padded, double scale,
                             const double* HWY_RESTRICT g, const double* HWY_RESTRICT x,
                             double* HWY_RESTRICT product) {
  const Vector scaling = hn::Set(kTag, scale);
  double trace = 0.0;
  for (std::size_t first = 0; first < padded; first += kLanes) {
    // NOLINTBEGIN(modernize-avoid-c-arrays)
    Vector row_g[kLanes];
    Vector row_x[kLanes];
    Vector sums[kLanes];
    // NOLINTEND(modernize-avoid-c-arrays)
    for (std::size_t row = 0; row < kLanes; ++row) {
      row_g[row] = hn::Set(kTag, g[first + row]);
      row_x[row] = hn::Set(kTag, x[first + row]);
      sums[row] = hn::Zero(kTag);
    }
    for (std::size_t column = 0; column < first; column += kLanes, triangle += kLanes * kLanes) {
      const Vector column_g = hn::Load(kTag, g + column);
      const Vector column_x = hn::Load(kTag, x + column);
      Vector mirrored = hn::Load(kTag, product + column);
      for (std::size_t row = 0; row < kLanes; ++row) {
        double* const at = triangle + row * kLanes;
        const Vector p = hn::Mul(scaling, hn::NegMulAdd(row_g[row], column_g, hn::Load(kTag, at)));
        hn::Store(p, kTag, at);
        sums[row] = hn::MulAdd(p, column_x, sums[row]);
        mirrored = hn::MulAdd(p, row_x[row], mirrored);
      }
      hn::Store(mirrored, kTag, product + column);
    }
    const Vector column_g = hn::Load(kTag, g + first);
    const Vector column_x = hn::Load(kTag, x + first);
    for (std::size_t row = 0; row < kLanes; ++row) {
      double* const at = triangle + row * kLanes;
      const Vector p = hn::Mul(scaling, hn::NegMulAdd(row_g[row], column_g, hn::Load(kTag, at)));
      hn::Store(p, kTag, at);
      sums[row] = hn::MulAdd(p, column_x, sums[row]);
      trace += at[row];
    }
    triangle += kLanes * kLanes;
    for (std::size_t row = 0; row < kLanes; ++row)
      product[first + row] = hn::GetLane(hn::SumOfLanes(kTag, sums[row]));
  }
  return trace;
}

}  // namespace torsio::adaptation_kernels::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace torsio::adaptation_kernels {

HWY_EXPORT(lane_count);
HWY_EXPORT(extend_by_one);
HWY_EXPORT(blend_into);
HWY_EXPORT(dot_product);
HWY_EXPORT(rank_one_and_multiply);

std::size_t lanes() noexcept { return HWY_DYNAMIC_DISPATCH(lane_count)(); }

std::size_t triangle_size(std::size_t padded) noexcept { return padded * (padded + lanes()) / 2; }

std::size_t diagonal_index(std::size_t row) noexcept {
  const std::size_t n = lanes();
  const std::size_t block = row / n;
  return (block * (block + 1) / 2 + block) * n * n + row % n * (n + 1);
}

Sums extend(const float* features, std::size_t count, const double* weights,
            double* extended) noexcept {
  return HWY_DYNAMIC_DISPATCH(extend_by_one)(features, count, weights, extended);
}

double blend(double* target, double keep, double gain, const double* direction,
             std::size_t padded) noexcept {
  return HWY_DYNAMIC_DISPATCH(blend_into)(target, keep, gain, direction, padded);
}

double update_and_multiply(double* triangle, std::size_t padded, double scale, const double* g,
                           const double* x, double* product) noexcept {
  return HWY_DYNAMIC_DISPATCH(rank_one_and_multiply)(triangle, padded, scale, g, x, product);
}

double dot(const double* a, const double* b, std::size_t padded) noexcept {
  return HWY_DYNAMIC_DISPATCH(dot_product)(a, b, padded);
}

}  // namespace torsio::adaptation_kernels
#endif

#include "fit/hammerstein_wiener/section_kernel.hpp"

// Highway compiles this file once for each instruction set; the order of its headers matters.
// clang-format off
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "fit/hammerstein_wiener/section_kernel.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>
// clang-format on

HWY_BEFORE_NAMESPACE();
namespace torsio::section_kernel::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

using D = hn::CappedTag<double, kLanes>;
using V = hn::Vec<D>;

// Each step waits for the state of the one before, so that several vectors at once take as long as one.
template <std::size_t kVectors>
HWY_INLINE void run_vectors(const Section& section, std::size_t first, double* HWY_RESTRICT values,
                            std::size_t samples, std::size_t stride) {
  const D d;
  const std::size_t lanes = hn::Lanes(d);
  const V a1 = hn::Set(d, section.a1);
  const V a2 = hn::Set(d, section.a2);
  // Registers: functions of std::array have no target attribute.
  V b0[kVectors], b1[kVectors], b2[kVectors];  // NOLINT(modernize-avoid-c-arrays)
  V s1[kVectors], s2[kVectors];                // NOLINT(modernize-avoid-c-arrays)
  for (std::size_t v = 0; v < kVectors; ++v) {
    const std::size_t at = first + v * lanes;
    b0[v] = hn::Load(d, section.b0 + at);
    b1[v] = hn::Load(d, section.b1 + at);
    b2[v] = hn::Load(d, section.b2 + at);
    s1[v] = hn::Load(d, section.s1 + at);
    s2[v] = hn::Load(d, section.s2 + at);
  }
  double* row = values + first;
  for (std::size_t n = 0; n < samples; ++n, row += stride)
    for (std::size_t v = 0; v < kVectors; ++v) {
      const V x = hn::Load(d, row + v * lanes);
      const V y = hn::MulAdd(b0[v], x, s1[v]);
      s1[v] = hn::NegMulAdd(a1, y, hn::MulAdd(b1[v], x, s2[v]));
      s2[v] = hn::NegMulAdd(a2, y, hn::Mul(b2[v], x));
      hn::Store(y, d, row + v * lanes);
    }
  for (std::size_t v = 0; v < kVectors; ++v) {
    const std::size_t at = first + v * lanes;
    hn::Store(s1[v], d, section.s1 + at);
    hn::Store(s2[v], d, section.s2 + at);
  }
}

void run_any(const Section& section, double* values, std::size_t samples, std::size_t stride) {
  const std::size_t lanes = hn::Lanes(D());
  std::size_t first = 0;
  for (; first + 3 * lanes <= stride; first += 3 * lanes)
    run_vectors<3>(section, first, values, samples, stride);
  for (; first + 2 * lanes <= stride; first += 2 * lanes)
    run_vectors<2>(section, first, values, samples, stride);
  for (; first < stride; first += lanes) run_vectors<1>(section, first, values, samples, stride);
}

// Two columns with four others: each value that is loaded is used in more than one product.
HWY_INLINE void add_tile(const double* HWY_RESTRICT rows, const double* HWY_RESTRICT columns,
                         double* HWY_RESTRICT sums, std::size_t stride) {
  constexpr std::size_t kRows = 2;
  const hn::CappedTag<double, 8> d;
  const std::size_t lanes = hn::Lanes(d);
  hn::Vec<decltype(d)> sum[kRows][kLanes];  // NOLINT(modernize-avoid-c-arrays)
  for (auto& row : sum)
    for (auto& each : row) each = hn::Zero(d);
  for (std::size_t n = 0; n < kColumnValues; n += lanes) {
    const auto a = hn::Load(d, rows + n);
    const auto b = hn::Load(d, rows + kColumnValues + n);
    for (std::size_t j = 0; j < kLanes; ++j) {
      const auto c = hn::Load(d, columns + j * kColumnValues + n);
      sum[0][j] = hn::MulAdd(a, c, sum[0][j]);
      sum[1][j] = hn::MulAdd(b, c, sum[1][j]);
    }
  }
  for (std::size_t i = 0; i < kRows; ++i)
    for (std::size_t j = 0; j < kLanes; ++j)
      sums[i * stride + j] += hn::GetLane(hn::SumOfLanes(d, sum[i][j]));
}

void add_products_any(const double* values, std::size_t columns, double* sums) {
  for (std::size_t i = 0; i < columns; i += 2)
    for (std::size_t j = 0; j <= i; j += kLanes)
      add_tile(values + i * kColumnValues, values + j * kColumnValues, sums + i * columns + j,
               columns);
}

}  // namespace torsio::section_kernel::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace torsio::section_kernel {

HWY_EXPORT(run_any);
HWY_EXPORT(add_products_any);

void run(const Section& section, double* values, std::size_t samples, std::size_t stride) noexcept {
  HWY_DYNAMIC_DISPATCH(run_any)(section, values, samples, stride);
}

void add_products(const double* values, std::size_t columns, double* sums) noexcept {
  HWY_DYNAMIC_DISPATCH(add_products_any)(values, columns, sums);
}

}  // namespace torsio::section_kernel
#endif

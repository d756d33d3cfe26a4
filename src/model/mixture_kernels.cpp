#include "model/mixture_kernels.hpp"

#include <cmath>
#include <limits>

// Highway compiles this file once for each instruction set; the order of its headers matters.
// clang-format off
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "model/mixture_kernels.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>
#include <hwy/contrib/math/math-inl.h>
// clang-format on

HWY_BEFORE_NAMESPACE();
namespace torsio::mixture_kernels::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

// Every kernel exists with the number of inputs fixed, so that its loops unroll, and once for any
// number (kFixed = 0).
template <std::size_t kFixed>
constexpr std::size_t count_of(std::size_t inputs) {
  return kFixed > 0 ? kFixed : inputs;
}

// offset - |whitening (z - mean)|^2 of the components at `lane` of a block. The mean is subtracted
// before anything is scaled: a narrow component would otherwise drown in rounding.
template <std::size_t kFixed, class D, class T = hn::TFromD<D>>
HWY_INLINE hn::Vec<D> log_weight(D d, const T* HWY_RESTRICT block, std::size_t lanes,
                                 std::size_t inputs, const T* HWY_RESTRICT z) {
  const std::size_t n = count_of<kFixed>(inputs);
  const T* HWY_RESTRICT whitening = block + n * lanes;
  auto result = hn::Load(d, block + (n + n * (n + 1) / 2) * lanes);
  for (std::size_t row = 0; row < n; ++row) {
    auto white = hn::Zero(d);
    for (std::size_t column = 0; column <= row; ++column, whitening += lanes) {
      const auto centred = hn::Sub(hn::Set(d, z[column]), hn::Load(d, block + column * lanes));
      white = hn::MulAdd(hn::Load(d, whitening), centred, white);
    }
    result = hn::NegMulAdd(white, white, result);
  }
  return result;
}

template <std::size_t kFixed>
float scan_fixed(const float* HWY_RESTRICT packed, std::size_t blocks, std::size_t inputs,
                 const float* HWY_RESTRICT z, float* HWY_RESTRICT log_weights) {
  const hn::CappedTag<float, kScanLanes> d;
  const std::size_t block_size = scan_rows(count_of<kFixed>(inputs)) * kScanLanes;
  auto largest = hn::Set(d, -std::numeric_limits<float>::infinity());
  for (std::size_t b = 0; b < blocks; ++b, packed += block_size, log_weights += kScanLanes) {
    for (std::size_t lane = 0; lane < kScanLanes; lane += hn::Lanes(d)) {
      const auto value = log_weight<kFixed>(d, packed + lane, kScanLanes, inputs, z);
      largest = hn::Max(value, largest);
      hn::Store(value, d, log_weights + lane);
    }
  }
  return hn::GetLane(hn::MaxOfLanes(d, largest));
}

std::size_t select_blocks(const float* HWY_RESTRICT log_weights, std::size_t exact_blocks,
                          float threshold, std::size_t* HWY_RESTRICT candidates) {
  const hn::CappedTag<float, kExactLanes> d;
  const auto limit = hn::Set(d, threshold);
  std::size_t count = 0;
  for (std::size_t b = 0; b < exact_blocks; ++b) {
    bool below = true;  // NaN, which float32 may make of a far input, is never below
    for (std::size_t lane = 0; lane < kExactLanes; lane += hn::Lanes(d))
      below &= hn::AllTrue(d, hn::Lt(hn::Load(d, log_weights + b * kExactLanes + lane), limit));
    candidates[count] = b;
    count += below ? 0 : 1;
  }
  return count;
}

template <std::size_t kFixed, class D>
HWY_INLINE hn::Vec<D> output_mean(D d, const double* HWY_RESTRICT block, std::size_t inputs,
                                  const double* HWY_RESTRICT z) {
  const std::size_t n = count_of<kFixed>(inputs);
  const double* HWY_RESTRICT output = block + scan_rows(n) * kExactLanes;
  auto mean = hn::Load(d, output);
  for (std::size_t column = 0; column < n; ++column) {
    const auto centred = hn::Sub(hn::Set(d, z[column]), hn::Load(d, block + column * kExactLanes));
    mean = hn::MulAdd(hn::Load(d, output + (column + 1) * kExactLanes), centred, mean);
  }
  return mean;
}

template <std::size_t kFixed>
Conditional finish_fixed(const double* HWY_RESTRICT packed, std::size_t inputs,
                         const double* HWY_RESTRICT z, const std::size_t* HWY_RESTRICT candidates,
                         std::size_t count, double* HWY_RESTRICT log_weights) {
  const hn::CappedTag<double, kExactLanes> d;
  const std::size_t n = count_of<kFixed>(inputs);
  const std::size_t block_size = exact_rows(n) * kExactLanes;
  double largest = -std::numeric_limits<double>::infinity();
  std::size_t best = 0;
  for (std::size_t k = 0; k < count; ++k) {
    const double* HWY_RESTRICT block = packed + candidates[k] * block_size;
    auto block_largest = hn::Set(d, -std::numeric_limits<double>::infinity());
    for (std::size_t lane = 0; lane < kExactLanes; lane += hn::Lanes(d)) {
      const auto value = log_weight<kFixed>(d, block + lane, kExactLanes, inputs, z);
      block_largest = hn::Max(value, block_largest);
      hn::Store(value, d, log_weights + k * kExactLanes + lane);
    }
    const double top = hn::GetLane(hn::MaxOfLanes(d, block_largest));
    if (top > largest) {
      largest = top;
      best = k;
    }
  }
  if (count == 0 || !std::isfinite(largest)) {
    constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
    return {kNaN, kNaN, largest};
  }
  // Moments about a component mean that carries weight: the variance then keeps its digits.
  double anchor = 0.0;
  for (std::size_t lane = 0; lane < kExactLanes; lane += hn::Lanes(d)) {
    const auto value = hn::Load(d, log_weights + best * kExactLanes + lane);
    const auto mask = hn::Eq(value, hn::Set(d, largest));
    if (hn::AllFalse(d, mask)) continue;
    const auto mean =
        output_mean<kFixed>(d, packed + candidates[best] * block_size + lane, inputs, z);
    const double lowest = std::numeric_limits<double>::lowest();
    anchor = hn::GetLane(hn::MaxOfLanes(d, hn::IfThenElse(mask, mean, hn::Set(d, lowest))));
  }
  auto weight_sum = hn::Zero(d);
  auto first = hn::Zero(d);
  auto second = hn::Zero(d);
  const auto shift = hn::Set(d, anchor);
  const auto top = hn::Set(d, largest);
  for (std::size_t k = 0; k < count; ++k) {
    const double* HWY_RESTRICT block = packed + candidates[k] * block_size;
    for (std::size_t lane = 0; lane < kExactLanes; lane += hn::Lanes(d)) {
      const auto value = hn::Load(d, log_weights + k * kExactLanes + lane);
      const auto weight = hn::Exp(d, hn::Sub(value, top));
      const auto mean = hn::Sub(output_mean<kFixed>(d, block + lane, inputs, z), shift);
      const auto variance = hn::Load(d, block + lane + (exact_rows(n) - 1) * kExactLanes);
      weight_sum = hn::Add(weight_sum, weight);
      first = hn::MulAdd(weight, mean, first);
      second = hn::MulAdd(weight, hn::MulAdd(mean, mean, variance), second);
    }
  }
  const double total = hn::GetLane(hn::SumOfLanes(d, weight_sum));
  const double mean = hn::GetLane(hn::SumOfLanes(d, first)) / total;
  const double square = hn::GetLane(hn::SumOfLanes(d, second)) / total;
  return {anchor + mean, square - mean * mean, largest + std::log(total)};
}

float scan_any(const float* packed, std::size_t blocks, std::size_t inputs, const float* z,
               float* log_weights) {
  switch (inputs) {
    case 1: return scan_fixed<1>(packed, blocks, inputs, z, log_weights);
    case 2: return scan_fixed<2>(packed, blocks, inputs, z, log_weights);
    case 3: return scan_fixed<3>(packed, blocks, inputs, z, log_weights);
    case 4: return scan_fixed<4>(packed, blocks, inputs, z, log_weights);
    default: return scan_fixed<0>(packed, blocks, inputs, z, log_weights);
  }
}

Conditional finish_any(const double* packed, std::size_t inputs, const double* z,
                       const std::size_t* candidates, std::size_t count, double* log_weights) {
  switch (inputs) {
    case 1: return finish_fixed<1>(packed, inputs, z, candidates, count, log_weights);
    case 2: return finish_fixed<2>(packed, inputs, z, candidates, count, log_weights);
    case 3: return finish_fixed<3>(packed, inputs, z, candidates, count, log_weights);
    case 4: return finish_fixed<4>(packed, inputs, z, candidates, count, log_weights);
    default: return finish_fixed<0>(packed, inputs, z, candidates, count, log_weights);
  }
}

}  // namespace torsio::mixture_kernels::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace torsio::mixture_kernels {

HWY_EXPORT(scan_any);
HWY_EXPORT(select_blocks);
HWY_EXPORT(finish_any);

float scan(const float* packed, std::size_t blocks, std::size_t inputs, const float* z,
           float* log_weights) noexcept {
  return HWY_DYNAMIC_DISPATCH(scan_any)(packed, blocks, inputs, z, log_weights);
}

std::size_t select(const float* log_weights, std::size_t exact_blocks, float threshold,
                   std::size_t* candidates) noexcept {
  return HWY_DYNAMIC_DISPATCH(select_blocks)(log_weights, exact_blocks, threshold, candidates);
}

Conditional finish(const double* packed, std::size_t inputs, const double* z,
                   const std::size_t* candidates, std::size_t count, double* log_weights) noexcept {
  return HWY_DYNAMIC_DISPATCH(finish_any)(packed, inputs, z, candidates, count, log_weights);
}

}  // namespace torsio::mixture_kernels
#endif

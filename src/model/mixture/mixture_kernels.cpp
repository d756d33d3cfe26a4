#include "model/mixture/mixture_kernels.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

// Highway compiles this file once for each instruction set; the order of its headers matters.
// clang-format off
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "model/mixture/mixture_kernels.cpp"
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

Selection select_blocks(const float* HWY_RESTRICT log_weights, std::size_t exact_blocks,
                        float threshold, float largest, std::size_t* HWY_RESTRICT candidates) {
  const hn::CappedTag<float, kExactLanes> d;
  const auto limit = hn::Set(d, threshold);
  const auto top = hn::Set(d, largest);
  Selection selection{0, 0};
  for (std::size_t b = 0; b < exact_blocks; ++b) {
    bool below = true;  // NaN, which float32 may make of a far input, is never below
    for (std::size_t lane = 0; lane < kExactLanes; lane += hn::Lanes(d)) {
      const auto value = hn::Load(d, log_weights + b * kExactLanes + lane);
      below &= hn::AllTrue(d, hn::Lt(value, limit));
      const auto found = hn::FindFirstTrue(d, hn::Eq(value, top));
      if (found >= 0) selection.best = b * kExactLanes + lane + static_cast<std::size_t>(found);
    }
    candidates[selection.count] = b;
    selection.count += below ? 0 : 1;
  }
  return selection;
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

// A variance is; its rounded difference need not be. NaN stays.
inline double positive(double variance) {
  return std::max(variance, std::numeric_limits<double>::min());
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
  return {anchor + mean, positive(square - mean * mean), largest + std::log(total)};
}

// z - mean with the digits that neither has in float.
template <std::size_t kFixed, class D>
HWY_INLINE hn::Vec<D> compensated(D d, const float* HWY_RESTRICT block, std::size_t inputs,
                                  std::size_t column, const float* HWY_RESTRICT z) {
  const std::size_t n = count_of<kFixed>(inputs);
  const float* HWY_RESTRICT lost = block + exact_rows(n) * kScanLanes;
  const auto high = hn::Sub(hn::Set(d, z[column]), hn::Load(d, block + column * kScanLanes));
  const auto low = hn::Sub(hn::Set(d, z[n + column]), hn::Load(d, lost + column * kScanLanes));
  return hn::Add(high, low);
}

template <std::size_t kFixed, class D>
HWY_INLINE hn::Vec<D> compensated_output(D d, const float* HWY_RESTRICT block, std::size_t inputs,
                                         const float* HWY_RESTRICT z) {
  const std::size_t n = count_of<kFixed>(inputs);
  const float* HWY_RESTRICT output = block + scan_rows(n) * kScanLanes;
  auto mean = hn::Load(d, output);
  for (std::size_t c = 0; c < n; ++c)
    mean = hn::MulAdd(hn::Load(d, output + (c + 1) * kScanLanes),
                      compensated<kFixed>(d, block, inputs, c, z), mean);
  return mean;
}

template <std::size_t kFixed>
Conditional finish_rounded_fixed(const float* HWY_RESTRICT packed, std::size_t inputs,
                                 const float* HWY_RESTRICT z,
                                 const std::size_t* HWY_RESTRICT candidates, std::size_t count,
                                 std::size_t best, float largest) {
  const hn::CappedTag<float, kScanLanes> d;
  const std::size_t n = count_of<kFixed>(inputs);
  const std::size_t block_size = rounded_rows(n) * kScanLanes;
  const std::size_t lane_of_best = best % kScanLanes;
  const float* HWY_RESTRICT heaviest =
      packed + best / kScanLanes * block_size + lane_of_best / hn::Lanes(d) * hn::Lanes(d);
  const float anchor = hn::ExtractLane(compensated_output<kFixed>(d, heaviest, inputs, z),
                                       lane_of_best % hn::Lanes(d));
  const auto shift = hn::Set(d, anchor);
  const auto top = hn::Set(d, largest);
  const auto lightest = hn::Set(d, -60.0F);  // e^-60 is nothing, and still a normal number: fast
  auto weight_sum = hn::Zero(d);
  auto first = hn::Zero(d);
  auto second = hn::Zero(d);
  for (std::size_t k = 0; k < count; ++k) {
    for (std::size_t lane = 0; lane < kScanLanes; lane += hn::Lanes(d)) {
      const float* HWY_RESTRICT block = packed + candidates[k] * block_size + lane;
      const float* HWY_RESTRICT whitening = block + n * kScanLanes;
      auto value = hn::Sub(hn::Load(d, block + (scan_rows(n) - 1) * kScanLanes), top);
      for (std::size_t row = 0; row < n; ++row) {
        auto white = hn::Zero(d);
        for (std::size_t column = 0; column <= row; ++column, whitening += kScanLanes)
          white = hn::MulAdd(hn::Load(d, whitening),
                             compensated<kFixed>(d, block, inputs, column, z), white);
        value = hn::NegMulAdd(white, white, value);
      }
      const auto weight = hn::Exp(d, hn::Max(value, lightest));
      const auto mean = hn::Sub(compensated_output<kFixed>(d, block, inputs, z), shift);
      const auto variance = hn::Load(d, block + (exact_rows(n) - 1) * kScanLanes);
      weight_sum = hn::Add(weight_sum, weight);
      first = hn::MulAdd(weight, mean, first);
      second = hn::MulAdd(weight, hn::MulAdd(mean, mean, variance), second);
    }
  }
  const auto sum = [&](auto v)
                       HWY_ATTR { return static_cast<double>(hn::GetLane(hn::SumOfLanes(d, v))); };
  const double total = sum(weight_sum);
  const double mean = sum(first) / total;
  return {static_cast<double>(anchor) + mean, positive(sum(second) / total - mean * mean),
          static_cast<double>(largest) + std::log(total)};
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

Conditional finish_rounded_any(const float* packed, std::size_t inputs, const float* z,
                               const std::size_t* candidates, std::size_t count, std::size_t best,
                               float largest) {
  switch (inputs) {
    case 1: return finish_rounded_fixed<1>(packed, inputs, z, candidates, count, best, largest);
    case 2: return finish_rounded_fixed<2>(packed, inputs, z, candidates, count, best, largest);
    case 3: return finish_rounded_fixed<3>(packed, inputs, z, candidates, count, best, largest);
    case 4: return finish_rounded_fixed<4>(packed, inputs, z, candidates, count, best, largest);
    default: return finish_rounded_fixed<0>(packed, inputs, z, candidates, count, best, largest);
  }
}

}  // namespace torsio::mixture_kernels::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace torsio::mixture_kernels {

HWY_EXPORT(scan_any);
HWY_EXPORT(select_blocks);
HWY_EXPORT(finish_any);
HWY_EXPORT(finish_rounded_any);

float scan(const float* packed, std::size_t blocks, std::size_t inputs, const float* z,
           float* log_weights) noexcept {
  return HWY_DYNAMIC_DISPATCH(scan_any)(packed, blocks, inputs, z, log_weights);
}

Selection select(const float* log_weights, std::size_t exact_blocks, float threshold, float largest,
                 std::size_t* candidates) noexcept {
  return HWY_DYNAMIC_DISPATCH(select_blocks)(log_weights, exact_blocks, threshold, largest,
                                             candidates);
}

Conditional finish(const double* packed, std::size_t inputs, const double* z,
                   const std::size_t* candidates, std::size_t count, double* log_weights) noexcept {
  return HWY_DYNAMIC_DISPATCH(finish_any)(packed, inputs, z, candidates, count, log_weights);
}

Conditional finish_rounded(const float* packed, std::size_t inputs, const float* z,
                           const std::size_t* candidates, std::size_t count, std::size_t best,
                           float largest) noexcept {
  return HWY_DYNAMIC_DISPATCH(finish_rounded_any)(packed, inputs, z, candidates, count, best,
                                                  largest);
}

}  // namespace torsio::mixture_kernels
#endif

#include "fit/mixture/mixture_em_kernel.hpp"

#include <array>
#include <limits>

// Highway compiles this file once for each instruction set; the order of its headers matters.
// clang-format off
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "fit/mixture/mixture_em_kernel.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>
#include <hwy/contrib/math/math-inl.h>
// clang-format on

HWY_BEFORE_NAMESPACE();
namespace torsio::mixture_em_kernel::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

// Responsibilities below this share of a sample's largest are dropped: e^-40 = 4e-18.
constexpr double kDropped = -40.0;

// Every kernel exists with the dimension fixed, so that its loops unroll, and once for any (0).
template <std::size_t kFixed>
constexpr std::size_t count_of(std::size_t dimension) {
  return kFixed > 0 ? kFixed : dimension;
}

template <std::size_t kFixed>
void log_weights(const double* HWY_RESTRICT samples, const double* HWY_RESTRICT parameters,
                 std::size_t dimension, double* HWY_RESTRICT result, double* HWY_RESTRICT largest) {
  const hn::CappedTag<double, kLanes> d;
  const std::size_t n = count_of<kFixed>(dimension);
  for (std::size_t k = 0; k < kTile; k += hn::Lanes(d)) {
    const double* HWY_RESTRICT whitening = parameters + n;
    auto value = hn::Set(d, parameters[rows(n) - 1]);
    for (std::size_t row = 0; row < n; ++row) {
      auto white = hn::Zero(d);
      for (std::size_t column = 0; column <= row; ++column, ++whitening) {
        const auto centred =
            hn::Sub(hn::Load(d, samples + column * kTile + k), hn::Set(d, parameters[column]));
        white = hn::MulAdd(hn::Set(d, *whitening), centred, white);
      }
      value = hn::NegMulAdd(white, white, value);
    }
    hn::Store(value, d, result + k);
    hn::Store(hn::Max(value, hn::Load(d, largest + k)), d, largest + k);
  }
}

// Turns log weights into weights relative to the largest; adds them up.
void exponentiate(double* HWY_RESTRICT weights, const double* HWY_RESTRICT largest,
                  double* HWY_RESTRICT total) {
  const hn::CappedTag<double, kLanes> d;
  for (std::size_t k = 0; k < kTile; k += hn::Lanes(d)) {
    const auto relative = hn::Sub(hn::Load(d, weights + k), hn::Load(d, largest + k));
    const auto kept = hn::Gt(relative, hn::Set(d, kDropped));
    if (hn::AllFalse(d, kept)) {
      hn::Store(hn::Zero(d), d, weights + k);
      continue;
    }
    const auto weight = hn::Exp(d, relative);
    hn::Store(weight, d, weights + k);
    hn::Store(hn::Add(weight, hn::Load(d, total + k)), d, total + k);
  }
}

// sums += r, r d, r d d^T for d = x - mean.
template <std::size_t kFixed>
void add_moments(const double* HWY_RESTRICT samples, const double* HWY_RESTRICT weights,
                 const double* HWY_RESTRICT inverse_total, const double* HWY_RESTRICT mean,
                 std::size_t dimension, double* HWY_RESTRICT sums) {
  const hn::CappedTag<double, kLanes> d;
  const std::size_t n = count_of<kFixed>(dimension);
  const std::size_t lanes = hn::Lanes(d);
  for (std::size_t k = 0; k < kTile; k += lanes) {
    const auto weight = hn::Load(d, weights + k);
    if (hn::AllTrue(d, hn::Eq(weight, hn::Zero(d)))) continue;
    const auto share = hn::Mul(weight, hn::Load(d, inverse_total + k));
    const auto add = [&](std::size_t row, auto value) HWY_ATTR {
      double* HWY_RESTRICT sum = sums + row * kLanes;
      hn::Store(hn::Add(hn::Load(d, sum), value), d, sum);
    };
    add(0, share);
    std::size_t at = n + 1;
    for (std::size_t r = 0; r < n; ++r) {
      const auto centred = hn::Sub(hn::Load(d, samples + r * kTile + k), hn::Set(d, mean[r]));
      const auto weighted = hn::Mul(share, centred);
      add(r + 1, weighted);
      for (std::size_t c = 0; c <= r; ++c, ++at) {
        const auto other = hn::Sub(hn::Load(d, samples + c * kTile + k), hn::Set(d, mean[c]));
        add(at, hn::Mul(weighted, other));
      }
    }
  }
}

template <std::size_t kFixed>
double add_tile_fixed(const Tile& tile, const double* HWY_RESTRICT parameters,
                      std::size_t components, std::size_t dimension, double* HWY_RESTRICT scratch,
                      double* HWY_RESTRICT sums) {
  const hn::CappedTag<double, kLanes> d;
  const std::size_t stride = rows(count_of<kFixed>(dimension));
  alignas(64) std::array<double, kTile> largest;
  alignas(64) std::array<double, kTile> total{};
  largest.fill(-std::numeric_limits<double>::infinity());
  for (std::size_t i = 0; i < components; ++i)
    log_weights<kFixed>(tile.samples, parameters + i * stride, dimension, scratch + i * kTile,
                        largest.data());
  for (std::size_t i = 0; i < components; ++i)
    exponentiate(scratch + i * kTile, largest.data(), total.data());

  double log_likelihood = 0.0;
  for (std::size_t k = 0; k < kTile; k += hn::Lanes(d)) {
    const auto sum = hn::Load(d, total.data() + k);
    hn::Store(hn::Add(hn::Log(d, sum), hn::Load(d, largest.data() + k)), d, largest.data() + k);
    hn::Store(hn::Div(hn::Set(d, 1.0), sum), d, total.data() + k);
  }
  for (std::size_t k = 0; k < tile.valid; ++k) log_likelihood += largest[k];
  for (std::size_t k = tile.valid; k < kTile; ++k) total[k] = 0.0;

  for (std::size_t i = 0; i < components; ++i)
    add_moments<kFixed>(tile.samples, scratch + i * kTile, total.data(), parameters + i * stride,
                        dimension, sums + i * stride * kLanes);
  return log_likelihood;
}

double add_tile_any(const Tile& tile, const double* parameters, std::size_t components,
                    std::size_t dimension, double* scratch, double* sums) {
  switch (dimension) {
    case 2: return add_tile_fixed<2>(tile, parameters, components, dimension, scratch, sums);
    case 3: return add_tile_fixed<3>(tile, parameters, components, dimension, scratch, sums);
    case 4: return add_tile_fixed<4>(tile, parameters, components, dimension, scratch, sums);
    case 5: return add_tile_fixed<5>(tile, parameters, components, dimension, scratch, sums);
    default: return add_tile_fixed<0>(tile, parameters, components, dimension, scratch, sums);
  }
}

}  // namespace torsio::mixture_em_kernel::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace torsio::mixture_em_kernel {

HWY_EXPORT(add_tile_any);

double add_tile(const Tile& tile, const double* parameters, std::size_t components,
                std::size_t dimension, double* scratch, double* sums) noexcept {
  return HWY_DYNAMIC_DISPATCH(add_tile_any)(tile, parameters, components, dimension, scratch, sums);
}

}  // namespace torsio::mixture_em_kernel
#endif

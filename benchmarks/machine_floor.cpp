#include <cstdint>
#include <vector>

#include "bench_row.hpp"
#include "core/aligned_vector.hpp"

// Highway compiles this file once for each instruction set; the order of its headers matters.
// clang-format off
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "machine_floor.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>
// clang-format on

HWY_BEFORE_NAMESPACE();
namespace torsio::bench::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

std::uint64_t read_all(const std::uint64_t* HWY_RESTRICT data, std::size_t count) {
  const hn::ScalableTag<std::uint64_t> d;
  const std::size_t n = hn::Lanes(d);
  auto a = hn::Zero(d);
  auto b = hn::Zero(d);
  auto c = hn::Zero(d);
  auto e = hn::Zero(d);
  for (std::size_t k = 0; k + 4 * n <= count; k += 4 * n) {
    a = hn::Xor(a, hn::Load(d, data + k));
    b = hn::Xor(b, hn::Load(d, data + k + n));
    c = hn::Xor(c, hn::Load(d, data + k + 2 * n));
    e = hn::Xor(e, hn::Load(d, data + k + 3 * n));
  }
  return hn::GetLane(hn::SumOfLanes(d, hn::Xor(hn::Xor(a, b), hn::Xor(c, e))));
}

// Ten independent chains hide the latency of a multiply-add. @returns how many were done.
double multiply_add_chains(std::size_t rounds, double* HWY_RESTRICT result) {
  const hn::ScalableTag<double> d;
  const auto factor = hn::Set(d, 0.999);
  const auto term = hn::Set(d, 1e-3);
  auto a = hn::Zero(d), b = a, c = a, e = a, f = a, g = a, h = a, i = a, j = a, k = a;
  for (std::size_t round = 0; round < rounds; ++round) {
    a = hn::MulAdd(a, factor, term);
    b = hn::MulAdd(b, factor, term);
    c = hn::MulAdd(c, factor, term);
    e = hn::MulAdd(e, factor, term);
    f = hn::MulAdd(f, factor, term);
    g = hn::MulAdd(g, factor, term);
    h = hn::MulAdd(h, factor, term);
    i = hn::MulAdd(i, factor, term);
    j = hn::MulAdd(j, factor, term);
    k = hn::MulAdd(k, factor, term);
  }
  const auto sum = hn::Add(hn::Add(hn::Add(a, b), hn::Add(c, e)),
                           hn::Add(hn::Add(hn::Add(f, g), hn::Add(h, i)), hn::Add(j, k)));
  *result = hn::GetLane(hn::SumOfLanes(d, sum));
  return 10.0 * static_cast<double>(rounds * hn::Lanes(d));
}

std::size_t double_lanes() { return hn::Lanes(hn::ScalableTag<double>()); }

}  // namespace torsio::bench::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace torsio::bench {

HWY_EXPORT(read_all);
HWY_EXPORT(multiply_add_chains);
HWY_EXPORT(double_lanes);

double stream_seconds(std::size_t bytes) {
  const detail::AlignedVector<std::uint64_t> data(bytes / sizeof(std::uint64_t), 1);
  constexpr std::size_t kPasses = 100;
  volatile std::uint64_t sink = 0;
  const double seconds = best_seconds([&] {
    for (std::size_t pass = 0; pass < kPasses; ++pass)
      sink = HWY_DYNAMIC_DISPATCH(read_all)(data.data(), data.size());
  });
  return seconds / static_cast<double>(kPasses);
}

double multiply_adds_per_second() {
  constexpr std::size_t kRounds = 100000;
  volatile double sink = 0.0;
  double done = 0.0;
  const double seconds = best_seconds([&] {
    double result = 0.0;
    done = HWY_DYNAMIC_DISPATCH(multiply_add_chains)(kRounds, &result);
    sink = result;
  });
  return done / seconds;
}

std::size_t vector_lanes() { return HWY_DYNAMIC_DISPATCH(double_lanes)(); }

}  // namespace torsio::bench
#endif

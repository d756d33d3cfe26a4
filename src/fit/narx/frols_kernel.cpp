#include "fit/narx/frols_kernel.hpp"

// Highway compiles this file once for each instruction set; the order of its headers matters.
// clang-format off
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "fit/narx/frols_kernel.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>
// clang-format on

HWY_BEFORE_NAMESPACE();
namespace torsio::frols_kernel::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

using D = hn::CappedTag<double, 8>;

// phi_j = parent x column. Two sums each, so that one addition need not wait for the last.
template <bool kStored, bool kSquared>
HWY_INLINE void add_one(const double* HWY_RESTRICT parent, const double* HWY_RESTRICT column,
                        const double* HWY_RESTRICT v, double* HWY_RESTRICT phi, double& dot,
                        double* square) {
  const D d;
  const std::size_t lanes = hn::Lanes(d);
  auto dot_low = hn::Zero(d);
  auto dot_high = hn::Zero(d);
  auto square_low = hn::Zero(d);
  auto square_high = hn::Zero(d);
  for (std::size_t k = 0; k < kBlock; k += 2 * lanes) {
    const auto low = hn::Mul(hn::Load(d, parent + k), hn::Load(d, column + k));
    const auto high = hn::Mul(hn::Load(d, parent + k + lanes), hn::Load(d, column + k + lanes));
    if constexpr (kStored) {
      hn::Store(low, d, phi + k);
      hn::Store(high, d, phi + k + lanes);
    }
    dot_low = hn::MulAdd(low, hn::Load(d, v + k), dot_low);
    dot_high = hn::MulAdd(high, hn::Load(d, v + k + lanes), dot_high);
    if constexpr (kSquared) {
      square_low = hn::MulAdd(low, low, square_low);
      square_high = hn::MulAdd(high, high, square_high);
    }
  }
  dot += hn::GetLane(hn::SumOfLanes(d, hn::Add(dot_low, dot_high)));
  if constexpr (kSquared)
    *square += hn::GetLane(hn::SumOfLanes(d, hn::Add(square_low, square_high)));
}

template <bool kSquared>
void add_all(const Candidates& candidates, const double* columns, std::size_t stride,
             const double* v, double* scratch, double* dots, double* squares) {
  for (std::size_t j = 0; j < candidates.count; ++j) {
    const Candidate& of = candidates.list[j];
    const double* column = columns + of.column * stride;
    // The first is the constant, which is stored in a column.
    const double* parent = j == 0 ? columns : scratch + of.parent * kBlock;
    double* square = kSquared ? squares + j : nullptr;
    if (j < candidates.parents)
      add_one<true, kSquared>(parent, column, v, scratch + j * kBlock, dots[j], square);
    else
      add_one<false, kSquared>(parent, column, v, nullptr, dots[j], square);
  }
}

void add_products_any(const Candidates& candidates, const double* columns, std::size_t stride,
                      const double* v, double* scratch, double* dots, double* squares) {
  if (squares == nullptr)
    add_all<false>(candidates, columns, stride, v, scratch, dots, squares);
  else
    add_all<true>(candidates, columns, stride, v, scratch, dots, squares);
}

}  // namespace torsio::frols_kernel::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace torsio::frols_kernel {

HWY_EXPORT(add_products_any);

void add_products(const Candidates& candidates, const double* columns, std::size_t stride,
                  const double* v, double* scratch, double* dots, double* squares) noexcept {
  HWY_DYNAMIC_DISPATCH(add_products_any)(candidates, columns, stride, v, scratch, dots, squares);
}

}  // namespace torsio::frols_kernel
#endif

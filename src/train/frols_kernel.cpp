#include "train/frols_kernel.hpp"

// Highway compiles this file once for each instruction set; the order of its headers matters.
// clang-format off
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "train/frols_kernel.cpp"
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
                        double& square) {
  const D d;
  const std::size_t lanes = hn::Lanes(d);
  auto dot_even = hn::Zero(d);
  auto dot_odd = hn::Zero(d);
  auto square_even = hn::Zero(d);
  auto square_odd = hn::Zero(d);
  for (std::size_t k = 0; k < kBlock; k += 2 * lanes) {
    const auto even = hn::Mul(hn::Load(d, parent + k), hn::Load(d, column + k));
    const auto odd = hn::Mul(hn::Load(d, parent + k + lanes), hn::Load(d, column + k + lanes));
    if constexpr (kStored) {
      hn::Store(even, d, phi + k);
      hn::Store(odd, d, phi + k + lanes);
    }
    dot_even = hn::MulAdd(even, hn::Load(d, v + k), dot_even);
    dot_odd = hn::MulAdd(odd, hn::Load(d, v + k + lanes), dot_odd);
    if constexpr (kSquared) {
      square_even = hn::MulAdd(even, even, square_even);
      square_odd = hn::MulAdd(odd, odd, square_odd);
    }
  }
  dot += hn::GetLane(hn::SumOfLanes(d, hn::Add(dot_even, dot_odd)));
  if constexpr (kSquared)
    square += hn::GetLane(hn::SumOfLanes(d, hn::Add(square_even, square_odd)));
}

template <bool kSquared>
void add_all(const Candidates& candidates, const double* columns, std::size_t stride,
             const double* v, double* scratch, double* dots, double* squares) {
  double none = 0.0;
  for (std::size_t j = 0; j < candidates.count; ++j) {
    const Candidate& of = candidates.list[j];
    const double* column = columns + of.column * stride;
    // The first is the constant, which stands in a column.
    const double* parent = j == 0 ? columns : scratch + of.parent * kBlock;
    double& square = kSquared ? squares[j] : none;
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

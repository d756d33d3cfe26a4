#include "model/gaussian_process/kernel_kernels.hpp"

#include <array>
#include <cmath>
#include <limits>
#include <numbers>

// Highway compiles this file once for each instruction set; the order of its headers matters.
// clang-format off
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "model/gaussian_process/kernel_kernels.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>
#include <hwy/contrib/math/math-inl.h>
// clang-format on

#ifndef TORSIO_KERNEL_KERNELS_SERIES
#define TORSIO_KERNEL_KERNELS_SERIES
namespace torsio::kernel_kernels {

// Taylor coefficients of sin(pi u) / u and cos(pi u) in u^2: to rounding for |u| <= 1/2.
inline constexpr std::size_t kSeriesTerms = 12;
constexpr std::array<double, kSeriesTerms> series(int first_power) {
  std::array<double, kSeriesTerms> coefficients{};
  double term = first_power == 1 ? std::numbers::pi : 1.0;
  int power = first_power;
  for (double& coefficient : coefficients) {
    coefficient = term;
    term *= -std::numbers::pi * std::numbers::pi / ((power + 1) * (power + 2));
    power += 2;
  }
  return coefficients;
}
inline constexpr auto kSine = series(1);
inline constexpr auto kCosine = series(0);

}  // namespace torsio::kernel_kernels
#endif

HWY_BEFORE_NAMESPACE();
namespace torsio::kernel_kernels::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

using D = hn::CappedTag<double, kGroup>;
using V = hn::Vec<D>;

HWY_INLINE V constant(double value) { return hn::Set(D(), value); }

// Some points of a program's row.
struct At {
  const Program& program;
  const double* HWY_RESTRICT x;
  const double* HWY_RESTRICT points;
  std::size_t stride;

  HWY_INLINE V point(std::size_t input) const { return hn::LoadU(D(), points + input * stride); }
  HWY_INLINE V difference(std::size_t input) const {
    return hn::Sub(constant(x[input]), point(input));
  }
  HWY_INLINE const double* weights(const KernelTerm& term) const {
    return program.weights + term.first_weight;
  }
};

HWY_INLINE V polynomial(const std::array<double, kSeriesTerms>& series_of, V z) {
  const double* coefficient = series_of.data();
  V sum = constant(coefficient[kSeriesTerms - 1]);
  for (std::size_t n = kSeriesTerms - 1; n-- > 0;)
    sum = hn::MulAdd(sum, z, constant(coefficient[n]));
  return sum;
}

struct SineCosine {
  V sine;
  V cosine;
};

// Sine and cosine of pi u for any u.
template <bool kWithCosine>
HWY_INLINE SineCosine sine_cosine(V u) {
  const V part = hn::Sub(u, hn::Round(u));
  const V square = hn::Mul(part, part);
  // The sign lost by whole turns of pi falls out of sin^2 and of sin cos.
  SineCosine result{hn::Mul(part, polynomial(kSine, square)), square};
  if constexpr (kWithCosine) result.cosine = polynomial(kCosine, square);
  return result;
}

// A kernel and its derivatives, at some points.
struct Value {
  // Not left implicit: GCC would compile them without the target's instructions, and NEON's vectors
  // need these.
  Value() = default;
  HWY_INLINE Value(V k_, V by_scale_, V slope_, V by_shape_)
      : k(k_), by_scale(by_scale_), slope(slope_), by_shape(by_shape_) {}

  V k;
  V by_scale;  // dk / d ln l of a shared length scale
  V slope;  // dk / d ln l_i = slope w_i times: D_i^2; sin^2 of a periodic, (x-s)(z-s) of a linear
  V by_shape;
};

HWY_INLINE V scaled_distance(const At& at, const KernelTerm& term, V shared_distance) {
  const double* weights = at.weights(term);
  if (term.shared_scale) return hn::Mul(shared_distance, constant(weights[0]));
  V sum = hn::Zero(D());
  for (std::size_t i = 0; i < at.program.inputs; ++i) {
    const V d = at.difference(i);
    sum = hn::MulAdd(hn::Mul(d, constant(weights[i])), d, sum);
  }
  return sum;
}

template <bool kSlopes>
HWY_INLINE Value radial(const At& at, const KernelTerm& term, V shared_distance) {
  const D d;
  const V distance = scaled_distance(at, term, shared_distance);
  const V variance = constant(term.variance);
  const V zero = hn::Zero(d);
  Value value{zero, zero, zero, zero};
  switch (term.kind) {
    case KernelKind::rational_quadratic: {
      const V base = hn::MulAdd(distance, constant(0.5 / term.shape), constant(1.0));
      const V log = hn::Log(d, base);
      const V inside = hn::Mul(variance, hn::Exp(d, hn::Mul(constant(-term.shape), log)));
      value.k = hn::IfThenElse(hn::Gt(base, zero), inside,
                               constant(std::numeric_limits<double>::quiet_NaN()));
      if constexpr (kSlopes) {
        value.slope = hn::Div(value.k, base);
        const V share = hn::Sub(constant(1.0), hn::Div(constant(1.0), base));
        value.by_shape = hn::Mul(hn::Mul(value.k, constant(term.shape)), hn::Sub(share, log));
      }
      break;
    }
    case KernelKind::matern32:
    case KernelKind::matern52: {
      const bool rough = term.kind == KernelKind::matern32;
      // Capped, since 0 times infinity is NaN; the exponential is 0 there.
      const V s = hn::Min(hn::Sqrt(hn::Mul(distance, constant(rough ? 3.0 : 5.0))), constant(1e6));
      const V decay = hn::Mul(variance, hn::Exp(d, hn::Neg(s)));
      const V line = hn::Add(s, constant(1.0));
      if (rough) {
        value.k = hn::Mul(line, decay);
        value.slope = hn::Mul(decay, constant(3.0));
      } else {
        value.k = hn::Mul(hn::MulAdd(hn::Mul(s, s), constant(1.0 / 3.0), line), decay);
        value.slope = hn::Mul(hn::Mul(line, decay), constant(5.0 / 3.0));
      }
      break;
    }
    default:
      value.k = hn::Mul(variance, hn::Exp(d, hn::Mul(distance, constant(-0.5))));
      value.slope = value.k;
  }
  if constexpr (kSlopes) value.by_scale = hn::Mul(value.slope, distance);
  return value;
}

template <bool kSlopes>
HWY_INLINE Value linear(const At& at, const KernelTerm& term) {
  const double* weights = at.weights(term);
  const V offset = constant(term.shape);
  V product = hn::Zero(D());
  V sum = hn::Zero(D());
  for (std::size_t i = 0; i < at.program.inputs; ++i) {
    const V x = hn::Sub(constant(at.x[i]), offset);
    const V z = hn::Sub(at.point(i), offset);
    const V weight = constant(weights[term.shared_scale ? 0 : i]);
    product = hn::MulAdd(hn::Mul(x, weight), z, product);
    if constexpr (kSlopes) sum = hn::MulAdd(hn::Add(x, z), weight, sum);
  }
  const V k = hn::Mul(constant(term.variance), product);
  return {k, hn::Mul(k, constant(-2.0)), constant(-2.0 * term.variance),
          hn::Mul(constant(-term.variance), sum)};
}

template <bool kSlopes>
HWY_INLINE Value periodic(const At& at, const KernelTerm& term) {
  const double* weights = at.weights(term);
  const V frequency = constant(1.0 / term.shape);
  V squares = hn::Zero(D());
  V turns = hn::Zero(D());
  for (std::size_t i = 0; i < at.program.inputs; ++i) {
    const V u = hn::Mul(at.difference(i), frequency);
    const V weight = constant(weights[term.shared_scale ? 0 : i]);
    const SineCosine of = sine_cosine<kSlopes>(u);
    const V weighted = hn::Mul(of.sine, weight);
    squares = hn::MulAdd(weighted, of.sine, squares);
    if constexpr (kSlopes) turns = hn::MulAdd(hn::Mul(weighted, of.cosine), u, turns);
  }
  const V k = hn::Mul(constant(term.variance), hn::Exp(D(), hn::Mul(squares, constant(-2.0))));
  const V slope = hn::Mul(k, constant(4.0));
  return {k, hn::Mul(slope, squares), slope,
          hn::Mul(hn::Mul(k, turns), constant(4.0 * std::numbers::pi))};
}

template <bool kSlopes>
HWY_INLINE void evaluate(const At& at, bool needs_distance, Value* values) {
  V distance = hn::Zero(D());
  if (needs_distance)
    for (std::size_t i = 0; i < at.program.inputs; ++i) {
      const V difference = at.difference(i);
      distance = hn::MulAdd(difference, difference, distance);
    }
  for (std::size_t n = 0; n < at.program.count; ++n) {
    const KernelTerm& term = at.program.terms[n];
    switch (term.kind) {
      case KernelKind::sum: values[n].k = hn::Add(values[term.left].k, values[n - 1].k); break;
      case KernelKind::product: values[n].k = hn::Mul(values[term.left].k, values[n - 1].k); break;
      case KernelKind::linear: values[n] = linear<kSlopes>(at, term); break;
      case KernelKind::periodic: values[n] = periodic<kSlopes>(at, term); break;
      default: values[n] = radial<kSlopes>(at, term, distance);
    }
  }
}

bool needs_distance(const Program& program) {
  for (std::size_t n = 0; n < program.count; ++n)
    if (program.terms[n].shared_scale && program.terms[n].kind < KernelKind::sum) return true;
  return false;
}

void row_any(const Program& program, const double* x, const Points& points, double* values) {
  const D d;
  const bool with_distance = needs_distance(program);
  Value terms[Kernel::kMaxNodes];  // NOLINT(modernize-avoid-c-arrays)
  for (std::size_t j = 0; j < in_groups(points.count); j += hn::Lanes(d)) {
    evaluate<false>({program, x, points.values + j, points.stride}, with_distance, terms);
    hn::Store(terms[program.count - 1].k, d, values + j);
  }
}

HWY_INLINE void add_to(double* sums, V value) {
  hn::Store(hn::Add(hn::Load(D(), sums), value), D(), sums);
}

// What the length scale of input i adds, its slope apart.
HWY_INLINE V scale_factor(const At& at, const KernelTerm& term, std::size_t i) {
  if (term.kind == KernelKind::linear) {
    const V offset = constant(term.shape);
    return hn::Mul(hn::Sub(constant(at.x[i]), offset), hn::Sub(at.point(i), offset));
  }
  const V difference = at.difference(i);
  if (term.kind != KernelKind::periodic) return hn::Mul(difference, difference);
  const V sine = sine_cosine<false>(hn::Mul(difference, constant(1.0 / term.shape))).sine;
  return hn::Mul(sine, sine);
}

HWY_INLINE void add_term(const At& at, const KernelTerm& term, const Value& value, V outer,
                         double* HWY_RESTRICT sums) {
  sums += term.first_parameter * kGroup;
  if (term.scaled) {
    add_to(sums, hn::Mul(outer, hn::Mul(value.k, constant(2.0))));
    sums += kGroup;
  }
  if (term.shared_scale) {
    add_to(sums, hn::Mul(outer, value.by_scale));
    sums += kGroup;
  } else {
    const V slope = hn::Mul(outer, value.slope);
    for (std::size_t i = 0; i < at.program.inputs; ++i, sums += kGroup)
      add_to(sums,
             hn::Mul(hn::Mul(slope, constant(at.weights(term)[i])), scale_factor(at, term, i)));
  }
  if (term.kind == KernelKind::linear || term.kind == KernelKind::periodic ||
      term.kind == KernelKind::rational_quadratic)
    add_to(sums, hn::Mul(outer, value.by_shape));
}

void add_gradient_any(const Program& program, const double* x, const Points& points,
                      const double* weights, double* gradient) {
  const D d;
  const bool with_distance = needs_distance(program);
  Value terms[Kernel::kMaxNodes];  // NOLINT(modernize-avoid-c-arrays)
  V outer[Kernel::kMaxNodes];      // NOLINT(modernize-avoid-c-arrays)
  for (std::size_t j = 0; j < in_groups(points.count); j += hn::Lanes(d)) {
    const At at{program, x, points.values + j, points.stride};
    evaluate<true>(at, with_distance, terms);
    outer[program.count - 1] = hn::Load(d, weights + j);
    for (std::size_t n = program.count; n-- > 0;) {
      const KernelTerm& term = program.terms[n];
      if (term.kind == KernelKind::sum) {
        outer[term.left] = outer[n - 1] = outer[n];
      } else if (term.kind == KernelKind::product) {
        outer[term.left] = hn::Mul(outer[n], terms[n - 1].k);
        outer[n - 1] = hn::Mul(outer[n], terms[term.left].k);
      } else {
        add_term(at, term, terms[n], outer[n], gradient + j % kGroup);
      }
    }
  }
}

double dot_any(const double* HWY_RESTRICT a, const double* HWY_RESTRICT b, std::size_t count) {
  const D d;
  const std::size_t lanes = hn::Lanes(d);
  V even = hn::Zero(d);
  V odd = hn::Zero(d);
  std::size_t j = 0;
  for (; j + 2 * lanes <= count; j += 2 * lanes) {
    even = hn::MulAdd(hn::LoadU(d, a + j), hn::LoadU(d, b + j), even);
    odd = hn::MulAdd(hn::LoadU(d, a + j + lanes), hn::LoadU(d, b + j + lanes), odd);
  }
  for (; j < count; j += lanes) even = hn::MulAdd(hn::LoadU(d, a + j), hn::LoadU(d, b + j), even);
  return hn::GetLane(hn::SumOfLanes(d, hn::Add(even, odd)));
}

double quadratic_form_any(const double* c, const double* q, std::size_t size) {
  const D d;
  const std::size_t stride = in_groups(size);
  V total = hn::Zero(d);
  for (std::size_t i = 0; i < size; ++i, c += stride) {
    V sum = hn::Zero(d);
    for (std::size_t j = 0; j < stride; j += hn::Lanes(d))
      sum = hn::MulAdd(hn::LoadU(d, c + j), hn::LoadU(d, q + j), sum);
    total = hn::MulAdd(sum, constant(q[i]), total);
  }
  return hn::GetLane(hn::SumOfLanes(d, total));
}

double whitened_square_any(const double* rows, double* k, std::size_t size) {
  double square = 0.0;
  for (std::size_t i = 0; i < size; ++i) {
    // In the row's last group, the elements after i are 0; k[i] itself is not yet white.
    const double white = (k[i] - dot_any(rows, k, i / kGroup * kGroup) -
                          [&] {
                            double rest = 0.0;
                            for (std::size_t j = i / kGroup * kGroup; j < i; ++j)
                              rest += rows[j] * k[j];
                            return rest;
                          }()) *
                         rows[i];
    k[i] = white;
    square += white * white;
    rows += in_groups(i + 1);
  }
  return square;
}

}  // namespace torsio::kernel_kernels::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace torsio::kernel_kernels {

HWY_EXPORT(row_any);
HWY_EXPORT(add_gradient_any);
HWY_EXPORT(dot_any);
HWY_EXPORT(quadratic_form_any);
HWY_EXPORT(whitened_square_any);

void row(const Program& program, const double* x, const Points& points, double* values) noexcept {
  HWY_DYNAMIC_DISPATCH(row_any)(program, x, points, values);
}

void add_gradient(const Program& program, const double* x, const Points& points,
                  const double* weights, double* gradient) noexcept {
  HWY_DYNAMIC_DISPATCH(add_gradient_any)(program, x, points, weights, gradient);
}

double dot(const double* a, const double* b, std::size_t count) noexcept {
  return HWY_DYNAMIC_DISPATCH(dot_any)(a, b, count);
}

double quadratic_form(const double* c, const double* q, std::size_t size) noexcept {
  return HWY_DYNAMIC_DISPATCH(quadratic_form_any)(c, q, size);
}

double whitened_square(const double* rows, double* k, std::size_t size) noexcept {
  return HWY_DYNAMIC_DISPATCH(whitened_square_any)(rows, k, size);
}

}  // namespace torsio::kernel_kernels
#endif

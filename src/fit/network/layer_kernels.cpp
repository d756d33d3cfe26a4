#include "fit/network/layer_kernels.hpp"

// Highway compiles this file once for each instruction set; the order of its headers matters.
// clang-format off
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "fit/network/layer_kernels.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>
#include <hwy/contrib/math/math-inl.h>
// clang-format on

HWY_BEFORE_NAMESPACE();
namespace torsio::layer_kernels::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

// Panels are 16 wide, so no vector of at most 16 lanes ever meets the end of a row.
using D = hn::CappedTag<float, 16>;
using V = hn::Vec<D>;

HWY_INLINE V one() { return hn::Set(D(), 1.0F); }

// exp(-x) overflows below -88; the sigmoid is 0 to all digits there.
HWY_INLINE V sigmoid(V x) {
  const V bounded = hn::Min(hn::Neg(x), hn::Set(D(), 88.0F));
  return hn::Div(one(), hn::Add(one(), hn::Exp(D(), bounded)));
}

HWY_INLINE V tanh(V x) { return hn::Tanh(D(), x); }

HWY_INLINE V one_minus(V x) { return hn::Sub(one(), x); }
HWY_INLINE V one_minus_square(V x) { return hn::NegMulAdd(x, x, one()); }
HWY_INLINE V sigmoid_slope(V s) { return hn::Mul(s, one_minus(s)); }

template <class Function>
HWY_INLINE void for_each(std::size_t count, const Function& function) {
  for (std::size_t k = 0; k < count; k += hn::Lanes(D())) function(k);
}

void activate_any(Activation activation, float* HWY_RESTRICT values, std::size_t count) {
  const D d;
  const auto replace = [&](const auto& function) HWY_ATTR {
    for_each(count, [&](std::size_t k) HWY_ATTR {
      hn::StoreU(function(hn::LoadU(d, values + k)), d, values + k);
    });
  };
  switch (activation) {
    case Activation::linear: return;
    case Activation::relu: return replace([&](V a) HWY_ATTR { return hn::Max(a, hn::Zero(d)); });
    case Activation::tanh: return replace([&](V a) HWY_ATTR { return tanh(a); });
    case Activation::softsign:
      return replace([&](V a) HWY_ATTR { return hn::Div(a, hn::Add(one(), hn::Abs(a))); });
    case Activation::elu:
      return replace([&](V a) HWY_ATTR {
        const V below = hn::Expm1(d, hn::Min(a, hn::Zero(d)));
        return hn::IfThenElse(hn::Gt(a, hn::Zero(d)), a, below);
      });
  }
}

void activate_backward_any(Activation activation, const float* HWY_RESTRICT values,
                           float* HWY_RESTRICT slope, std::size_t count) {
  const D d;
  const auto scale = [&](const auto& function) HWY_ATTR {
    for_each(count, [&](std::size_t k) HWY_ATTR {
      const V factor = function(hn::LoadU(d, values + k));
      hn::StoreU(hn::Mul(factor, hn::LoadU(d, slope + k)), d, slope + k);
    });
  };
  switch (activation) {
    case Activation::linear: return;
    case Activation::relu:
      return scale([&](V y) HWY_ATTR { return hn::IfThenElseZero(hn::Gt(y, hn::Zero(d)), one()); });
    case Activation::tanh: return scale([&](V y) HWY_ATTR { return one_minus_square(y); });
    case Activation::softsign:
      return scale([&](V y) HWY_ATTR {
        const V rest = one_minus(hn::Abs(y));
        return hn::Mul(rest, rest);
      });
    case Activation::elu:
      return scale([&](V y) HWY_ATTR {
        return hn::IfThenElse(hn::Gt(y, hn::Zero(d)), one(), hn::Add(y, one()));
      });
  }
}

void lstm_forward_any(const LstmStep& step, float* HWY_RESTRICT output, std::size_t output_stride) {
  const D d;
  const std::size_t w = step.width;
  for (std::size_t row = 0; row < step.rows; ++row) {
    float* HWY_RESTRICT i = step.gates + row * 4 * w;
    const float* HWY_RESTRICT old_cell = step.old_cell + row * w;
    float* HWY_RESTRICT cell = step.cell + row * w;
    for_each(w, [&](std::size_t k) HWY_ATTR {
      const V in = sigmoid(hn::LoadU(d, i + k));
      const V forget = sigmoid(hn::LoadU(d, i + w + k));
      const V candidate = tanh(hn::LoadU(d, i + 2 * w + k));
      const V out = sigmoid(hn::LoadU(d, i + 3 * w + k));
      const V c = hn::MulAdd(forget, hn::LoadU(d, old_cell + k), hn::Mul(in, candidate));
      hn::StoreU(in, d, i + k);
      hn::StoreU(forget, d, i + w + k);
      hn::StoreU(candidate, d, i + 2 * w + k);
      hn::StoreU(out, d, i + 3 * w + k);
      hn::StoreU(c, d, cell + k);
      hn::StoreU(hn::Mul(out, tanh(c)), d, output + row * output_stride + k);
    });
  }
}

void lstm_backward_any(const LstmStep& step, const float* HWY_RESTRICT output_slope,
                       float* HWY_RESTRICT cell_slope) {
  const D d;
  const std::size_t w = step.width;
  for (std::size_t row = 0; row < step.rows; ++row) {
    float* HWY_RESTRICT i = step.gates + row * 4 * w;
    const std::size_t at = row * w;
    for_each(w, [&](std::size_t k) HWY_ATTR {
      const V in = hn::LoadU(d, i + k);
      const V forget = hn::LoadU(d, i + w + k);
      const V candidate = hn::LoadU(d, i + 2 * w + k);
      const V out = hn::LoadU(d, i + 3 * w + k);
      const V squashed = tanh(hn::LoadU(d, step.cell + at + k));
      const V dh = hn::LoadU(d, output_slope + at + k);
      const V dc = hn::MulAdd(hn::Mul(dh, out), one_minus_square(squashed),
                              hn::LoadU(d, cell_slope + at + k));
      const V old_cell = hn::LoadU(d, step.old_cell + at + k);
      hn::StoreU(hn::Mul(hn::Mul(dc, candidate), sigmoid_slope(in)), d, i + k);
      hn::StoreU(hn::Mul(hn::Mul(dc, old_cell), sigmoid_slope(forget)), d, i + w + k);
      hn::StoreU(hn::Mul(hn::Mul(dc, in), one_minus_square(candidate)), d, i + 2 * w + k);
      hn::StoreU(hn::Mul(hn::Mul(dh, squashed), sigmoid_slope(out)), d, i + 3 * w + k);
      hn::StoreU(hn::Mul(dc, forget), d, cell_slope + at + k);
    });
  }
}

void gru_forward_any(const GruStep& step, float* HWY_RESTRICT output) {
  const D d;
  const std::size_t w = step.width;
  for (std::size_t row = 0; row < step.rows; ++row) {
    float* HWY_RESTRICT n = step.gates + row * 4 * w;
    const float* HWY_RESTRICT old_output = step.old_output + row * step.stride;
    for_each(w, [&](std::size_t k) HWY_ATTR {
      const V reset = sigmoid(hn::LoadU(d, n + w + k));
      const V update = sigmoid(hn::LoadU(d, n + 2 * w + k));
      const V memory = hn::LoadU(d, n + 3 * w + k);
      const V candidate = tanh(hn::MulAdd(reset, memory, hn::LoadU(d, n + k)));
      const V change = hn::Sub(hn::LoadU(d, old_output + k), candidate);
      hn::StoreU(candidate, d, n + k);
      hn::StoreU(reset, d, n + w + k);
      hn::StoreU(update, d, n + 2 * w + k);
      hn::StoreU(hn::MulAdd(update, change, candidate), d, output + row * step.stride + k);
    });
  }
}

void gru_backward_any(const GruStep& step, float* HWY_RESTRICT output_slope) {
  const D d;
  const std::size_t w = step.width;
  for (std::size_t row = 0; row < step.rows; ++row) {
    float* HWY_RESTRICT n = step.gates + row * 4 * w;
    const float* HWY_RESTRICT old_output = step.old_output + row * step.stride;
    float* HWY_RESTRICT slope = output_slope + row * w;
    for_each(w, [&](std::size_t k) HWY_ATTR {
      const V candidate = hn::LoadU(d, n + k);
      const V reset = hn::LoadU(d, n + w + k);
      const V update = hn::LoadU(d, n + 2 * w + k);
      const V memory = hn::LoadU(d, n + 3 * w + k);
      const V dh = hn::LoadU(d, slope + k);
      const V dn = hn::Mul(hn::Mul(dh, one_minus(update)), one_minus_square(candidate));
      const V change = hn::Sub(hn::LoadU(d, old_output + k), candidate);
      hn::StoreU(dn, d, n + k);
      hn::StoreU(hn::Mul(hn::Mul(dn, memory), sigmoid_slope(reset)), d, n + w + k);
      hn::StoreU(hn::Mul(hn::Mul(dh, change), sigmoid_slope(update)), d, n + 2 * w + k);
      hn::StoreU(hn::Mul(dn, reset), d, n + 3 * w + k);
      hn::StoreU(hn::Mul(dh, update), d, slope + k);
    });
  }
}

constexpr float kBeta1 = 0.9F;
constexpr float kBeta2 = 0.999F;
constexpr float kEpsilon = 1e-8F;

void adam_any(const AdamStep& step, const float* HWY_RESTRICT gradient, float* HWY_RESTRICT weights,
              float* HWY_RESTRICT mean, float* HWY_RESTRICT square, std::size_t count) {
  const D d;
  const V scale = hn::Set(d, step.gradient_scale);
  const V kept = hn::Set(d, 1.0F - step.decay);
  const V penalty = hn::Set(d, step.penalty);
  const V rate = hn::Set(d, step.rate);
  const V root_scale = hn::Set(d, step.root_scale);
  for_each(count, [&](std::size_t k) HWY_ATTR {
    V w = hn::LoadU(d, weights + k);
    const V g = hn::MulAdd(hn::LoadU(d, gradient + k), scale, hn::Mul(penalty, w));
    const V m = hn::MulAdd(hn::Set(d, 1.0F - kBeta1), g,
                           hn::Mul(hn::Set(d, kBeta1), hn::LoadU(d, mean + k)));
    const V v = hn::MulAdd(hn::Mul(hn::Set(d, 1.0F - kBeta2), g), g,
                           hn::Mul(hn::Set(d, kBeta2), hn::LoadU(d, square + k)));
    hn::StoreU(m, d, mean + k);
    hn::StoreU(v, d, square + k);
    const V root = hn::MulAdd(hn::Sqrt(v), root_scale, hn::Set(d, kEpsilon));
    w = hn::NegMulAdd(rate, hn::Div(m, root), hn::Mul(kept, w));
    hn::StoreU(w, d, weights + k);
  });
}

}  // namespace torsio::layer_kernels::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace torsio::layer_kernels {

HWY_EXPORT(activate_any);
HWY_EXPORT(activate_backward_any);
HWY_EXPORT(lstm_forward_any);
HWY_EXPORT(lstm_backward_any);
HWY_EXPORT(gru_forward_any);
HWY_EXPORT(gru_backward_any);
HWY_EXPORT(adam_any);

void activate(Activation activation, float* values, std::size_t count) noexcept {
  HWY_DYNAMIC_DISPATCH(activate_any)(activation, values, count);
}

void activate_backward(Activation activation, const float* values, float* slope,
                       std::size_t count) noexcept {
  HWY_DYNAMIC_DISPATCH(activate_backward_any)(activation, values, slope, count);
}

void lstm_forward(const LstmStep& step, float* output, std::size_t output_stride) noexcept {
  HWY_DYNAMIC_DISPATCH(lstm_forward_any)(step, output, output_stride);
}

void lstm_backward(const LstmStep& step, const float* output_slope, float* cell_slope) noexcept {
  HWY_DYNAMIC_DISPATCH(lstm_backward_any)(step, output_slope, cell_slope);
}

void gru_forward(const GruStep& step, float* output) noexcept {
  HWY_DYNAMIC_DISPATCH(gru_forward_any)(step, output);
}

void gru_backward(const GruStep& step, float* output_slope) noexcept {
  HWY_DYNAMIC_DISPATCH(gru_backward_any)(step, output_slope);
}

void adam(const AdamStep& step, const float* gradient, float* weights, float* mean, float* square,
          std::size_t count) noexcept {
  HWY_DYNAMIC_DISPATCH(adam_any)(step, gradient, weights, mean, square, count);
}

}  // namespace torsio::layer_kernels
#endif

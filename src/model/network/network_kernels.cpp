#include "model/network/network_kernels.hpp"

// Highway compiles this file once for each instruction set; the order of its headers matters.
// clang-format off
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "model/network/network_kernels.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>
#include <hwy/contrib/math/math-inl.h>
// clang-format on

HWY_BEFORE_NAMESPACE();
namespace torsio::network_kernels::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

using Lanes = hn::ScalableTag<float>;
using Vector = hn::Vec<Lanes>;
constexpr Lanes kTag;
constexpr std::size_t kLanes = hn::MaxLanes(kTag);

// Thirty-two registers hold the sums of twice as many units or joints.
constexpr std::size_t kBlocksAtOnce = 2;
constexpr std::size_t kJointsAtOnce = kLanes >= 16 ? 6 : 2;

std::size_t lane_count() { return kLanes; }

HWY_INLINE Vector set(float value) { return hn::Set(kTag, value); }

// NaN stays. Max and Min of x86 vectors return their second argument where one is NaN; those of NEON
// and of single numbers return the number.
constexpr bool kKeepsSecond =
    HWY_ARCH_X86 != 0 && HWY_TARGET != HWY_SCALAR && HWY_TARGET != HWY_EMU128;
HWY_INLINE Vector at_least(Vector x, float limit) {
  if constexpr (kKeepsSecond) return hn::Max(set(limit), x);
  return hn::IfThenElse(hn::Lt(x, set(limit)), set(limit), x);
}
HWY_INLINE Vector at_most(Vector x, float limit) {
  if constexpr (kKeepsSecond) return hn::Min(set(limit), x);
  return hn::IfThenElse(hn::Gt(x, set(limit)), set(limit), x);
}

// x P(x^2) / Q(x^2) on |x| <= 9, where tanh is 1 to float32: a minimax fit of the relative error,
// 2.1e-8 before rounding.
HWY_INLINE Vector tanh_of(Vector value) {
  const Vector x = at_most(at_least(value, -9.0F), 9.0F);
  const Vector square = hn::Mul(x, x);
  Vector above = set(1.33547570e-08F);
  above = hn::MulAdd(above, square, set(2.06091563e-05F));
  above = hn::MulAdd(above, square, set(3.49559281e-03F));
  above = hn::MulAdd(above, square, set(1.33810296e-01F));
  above = hn::MulAdd(above, square, set(9.99999979e-01F));
  Vector below = set(7.77659893e-07F);
  below = hn::MulAdd(below, square, set(3.28564235e-04F));
  below = hn::MulAdd(below, square, set(2.58770002e-02F));
  below = hn::MulAdd(below, square, set(4.67143452e-01F));
  below = hn::MulAdd(below, square, set(1.0F));
  return hn::Div(hn::Mul(x, above), below);
}

HWY_INLINE Vector sigmoid_of(Vector x) {
  const Vector half = set(0.5F);
  return hn::MulAdd(half, tanh_of(hn::Mul(half, x)), half);
}

struct LstmCell {
  static constexpr std::size_t kRows = 4;
  static constexpr std::size_t kSums = 4;
  static HWY_INLINE Vector start(const float* HWY_RESTRICT bias) { return hn::Load(kTag, bias); }
  static constexpr std::size_t recurrent_sum(std::size_t row) { return row; }

  static HWY_INLINE Vector hidden(const Vector* HWY_RESTRICT sums, const float* /*bias*/,
                                  Vector /*before*/, float* HWY_RESTRICT cell) {
    const Vector kept = hn::Mul(sigmoid_of(sums[1]), hn::Load(kTag, cell));
    const Vector next = hn::MulAdd(sigmoid_of(sums[0]), tanh_of(sums[2]), kept);
    hn::Store(next, kTag, cell);
    return hn::Mul(sigmoid_of(sums[3]), tanh_of(next));
  }
};

// In double, of both halves of a vector.
template <class Function>
HWY_INLINE Vector from_double(Vector x, const Function& function) {
#if HWY_TARGET == HWY_SCALAR
  const hn::Rebind<double, Lanes> wide;
  return hn::DemoteTo(kTag, function(wide, hn::PromoteTo(wide, x)));
#else
  const hn::Repartition<double, Lanes> wide;
  const hn::Half<Lanes> half;
  return hn::Combine(
      kTag, hn::DemoteTo(half, function(wide, hn::PromoteTo(wide, hn::UpperHalf(half, x)))),
      hn::DemoteTo(half, function(wide, hn::PromoteTo(wide, hn::LowerHalf(half, x)))));
#endif
}

// PyTorch's cell: two sums, each with its bias, and no fused product.
struct LstmCellBiasesApart {
  static constexpr std::size_t kRows = 4;
  static constexpr std::size_t kSums = 8;
  static HWY_INLINE Vector start(const float* /*bias*/) { return hn::Zero(kTag); }
  static constexpr std::size_t recurrent_sum(std::size_t row) { return kRows + row; }

  static HWY_INLINE Vector tanh_rounded(Vector x) {
    return from_double(x, [](auto wide, auto value) HWY_ATTR { return hn::Tanh(wide, value); });
  }
  static HWY_INLINE Vector sigmoid_rounded(Vector x) {
    const Vector decay = from_double(
        hn::Neg(x), [](auto wide, auto value) HWY_ATTR { return hn::Exp(wide, value); });
    return hn::Div(set(1.0F), hn::Add(set(1.0F), decay));
  }

  static HWY_INLINE Vector hidden(const Vector* HWY_RESTRICT sums, const float* HWY_RESTRICT bias,
                                  Vector /*before*/, float* HWY_RESTRICT cell) {
    const auto gate = [&](std::size_t row) HWY_ATTR {
      return hn::Add(hn::Add(sums[row], hn::Load(kTag, bias + row * kLanes)),
                     hn::Add(sums[kRows + row], hn::Load(kTag, bias + (kRows + row) * kLanes)));
    };
    const Vector kept = hn::Mul(sigmoid_rounded(gate(1)), hn::Load(kTag, cell));
    const Vector next = hn::Add(kept, hn::Mul(sigmoid_rounded(gate(0)), tanh_rounded(gate(2))));
    hn::Store(next, kTag, cell);
    return hn::Mul(sigmoid_rounded(gate(3)), tanh_rounded(next));
  }
};

struct GruCell {
  static constexpr std::size_t kRows = 3;
  static constexpr std::size_t kSums = 4;
  static HWY_INLINE Vector start(const float* HWY_RESTRICT bias) { return hn::Load(kTag, bias); }
  static constexpr std::size_t recurrent_sum(std::size_t row) { return row < 2 ? row : 3; }

  static HWY_INLINE Vector hidden(const Vector* HWY_RESTRICT sums, const float* /*bias*/,
                                  Vector before, float* HWY_RESTRICT /*cell*/) {
    const Vector fresh = tanh_of(hn::MulAdd(sigmoid_of(sums[0]), sums[3], sums[2]));
    return hn::MulAdd(sigmoid_of(sums[1]), hn::Sub(before, fresh), fresh);
  }
};

// Some blocks of one joint, or one block of some joints: what shares the loads of a column.
template <class Cell, std::size_t kBlocks, std::size_t kJoints>
HWY_INLINE void step_tile(const PackedView& layer, const JointStates& joints, std::size_t block,
                          std::size_t joint) {
  constexpr std::size_t kSums = Cell::kSums;
  const std::size_t block_size = (kSums + Cell::kRows * (layer.inputs + layer.units)) * kLanes;
  const float* const biases = layer.weights + block * block_size;
  const float* HWY_RESTRICT weights = biases;
  const float* HWY_RESTRICT inputs = joints.inputs + joint * joints.input_stride;
  const float* HWY_RESTRICT hidden = joints.hidden + joint * joints.state_stride;
  Vector sums[kBlocks][kJoints][kSums];  // NOLINT(modernize-avoid-c-arrays): registers
  for (std::size_t b = 0; b < kBlocks; ++b)
    for (std::size_t j = 0; j < kJoints; ++j)
      for (std::size_t row = 0; row < kSums; ++row)
        sums[b][j][row] = Cell::start(weights + b * block_size + row * kLanes);
  weights += kSums * kLanes;
  for (std::size_t column = 0; column < layer.inputs; ++column, weights += Cell::kRows * kLanes)
    for (std::size_t b = 0; b < kBlocks; ++b)
      for (std::size_t row = 0; row < Cell::kRows; ++row) {
        const Vector weight = hn::Load(kTag, weights + b * block_size + row * kLanes);
        for (std::size_t j = 0; j < kJoints; ++j)
          sums[b][j][row] =
              hn::MulAdd(weight, set(inputs[j * joints.input_stride + column]), sums[b][j][row]);
      }
  for (std::size_t column = 0; column < layer.units; ++column, weights += Cell::kRows * kLanes)
    for (std::size_t b = 0; b < kBlocks; ++b)
      for (std::size_t row = 0; row < Cell::kRows; ++row) {
        const Vector weight = hn::Load(kTag, weights + b * block_size + row * kLanes);
        for (std::size_t j = 0; j < kJoints; ++j) {
          Vector& sum = sums[b][j][Cell::recurrent_sum(row)];
          sum = hn::MulAdd(weight, set(hidden[j * joints.state_stride + column]), sum);
        }
      }
  for (std::size_t b = 0; b < kBlocks; ++b)
    for (std::size_t j = 0; j < kJoints; ++j) {
      const std::size_t at = (joint + j) * joints.state_stride + (block + b) * kLanes;
      float* const cell = joints.cell == nullptr ? nullptr : joints.cell + at;
      const Vector before = hn::Load(kTag, joints.hidden + at);
      hn::Store(Cell::hidden(sums[b][j], biases + b * block_size, before, cell), kTag,
                joints.next_hidden + at);
    }
}

template <class Cell>
HWY_INLINE void step_layer(const PackedView& layer, const JointStates& joints) {
  if (joints.count == 1) {
    std::size_t block = 0;
    for (; block + kBlocksAtOnce <= layer.blocks; block += kBlocksAtOnce)
      step_tile<Cell, kBlocksAtOnce, 1>(layer, joints, block, 0);
    for (; block < layer.blocks; ++block) step_tile<Cell, 1, 1>(layer, joints, block, 0);
    return;
  }
  for (std::size_t block = 0; block < layer.blocks; ++block) {
    std::size_t joint = 0;
    for (; joint + kJointsAtOnce <= joints.count; joint += kJointsAtOnce)
      step_tile<Cell, 1, kJointsAtOnce>(layer, joints, block, joint);
    for (; joint + 2 <= joints.count; joint += 2)
      step_tile<Cell, 1, 2>(layer, joints, block, joint);
    for (; joint < joints.count; ++joint) step_tile<Cell, 1, 1>(layer, joints, block, joint);
  }
}

void lstm_layer(const PackedView& layer, const JointStates& joints) {
  step_layer<LstmCell>(layer, joints);
}

void lstm_layer_biases_apart(const PackedView& layer, const JointStates& joints) {
  step_layer<LstmCellBiasesApart>(layer, joints);
}

void gru_layer(const PackedView& layer, const JointStates& joints) {
  step_layer<GruCell>(layer, joints);
}

// Four sums hide the latency of a multiply-add.
template <class Function>
HWY_INLINE void dense_blocks(const PackedView& layer, const float* HWY_RESTRICT input,
                             float* HWY_RESTRICT output, const Function& function) {
  constexpr std::size_t kSums = 4;
  const float* HWY_RESTRICT weights = layer.weights;
  for (std::size_t block = 0; block < layer.blocks; ++block) {
    // NOLINTNEXTLINE(modernize-avoid-c-arrays)
    Vector sums[kSums] = {hn::Load(kTag, weights), hn::Zero(kTag), hn::Zero(kTag), hn::Zero(kTag)};
    weights += kLanes;
    std::size_t column = 0;
    for (; column + kSums <= layer.inputs; column += kSums, weights += kSums * kLanes)
      for (std::size_t k = 0; k < kSums; ++k)
        sums[k] = hn::MulAdd(hn::Load(kTag, weights + k * kLanes), set(input[column + k]), sums[k]);
    for (; column < layer.inputs; ++column, weights += kLanes)
      sums[0] = hn::MulAdd(hn::Load(kTag, weights), set(input[column]), sums[0]);
    const Vector sum = hn::Add(hn::Add(sums[0], sums[1]), hn::Add(sums[2], sums[3]));
    hn::Store(function(sum), kTag, output + block * kLanes);
  }
}

void dense_layer(const PackedView& layer, Activation activation, const float* input,
                 float* output) {
  const auto run = [&](const auto& function)
                       HWY_ATTR { dense_blocks(layer, input, output, function); };
  switch (activation) {
    case Activation::linear: return run([](Vector x) HWY_ATTR { return x; });
    case Activation::relu: return run([](Vector x) HWY_ATTR { return at_least(x, 0.0F); });
    case Activation::tanh: return run([](Vector x) HWY_ATTR { return tanh_of(x); });
    case Activation::softsign:
      return run([](Vector x) HWY_ATTR { return hn::Div(x, hn::Add(set(1.0F), hn::Abs(x))); });
    case Activation::elu:
      return run([](Vector x) HWY_ATTR {
        const auto is_below = hn::Lt(x, hn::Zero(kTag));  // false for NaN, which stays so
        const Vector below = hn::Expm1(kTag, hn::IfThenElseZero(is_below, x));
        return hn::IfThenElse(is_below, below, x);
      });
  }
}

float dot_product(const float* HWY_RESTRICT weights, const float* HWY_RESTRICT input,
                  std::size_t count) {
  constexpr std::size_t kSums = 4;
  // NOLINTNEXTLINE(modernize-avoid-c-arrays)
  Vector sums[kSums] = {hn::Zero(kTag), hn::Zero(kTag), hn::Zero(kTag), hn::Zero(kTag)};
  std::size_t at = 0;
  for (; at + kSums * kLanes <= count; at += kSums * kLanes)
    for (std::size_t k = 0; k < kSums; ++k)
      sums[k] = hn::MulAdd(hn::Load(kTag, weights + at + k * kLanes),
                           hn::Load(kTag, input + at + k * kLanes), sums[k]);
  for (; at < count; at += kLanes)
    sums[0] = hn::MulAdd(hn::Load(kTag, weights + at), hn::Load(kTag, input + at), sums[0]);
  const Vector sum = hn::Add(hn::Add(sums[0], sums[1]), hn::Add(sums[2], sums[3]));
  return hn::GetLane(hn::SumOfLanes(kTag, sum));
}

}  // namespace torsio::network_kernels::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace torsio::network_kernels {

HWY_EXPORT(lane_count);
HWY_EXPORT(lstm_layer);
HWY_EXPORT(lstm_layer_biases_apart);
HWY_EXPORT(gru_layer);
HWY_EXPORT(dense_layer);
HWY_EXPORT(dot_product);

std::size_t lanes() noexcept { return HWY_DYNAMIC_DISPATCH(lane_count)(); }

void lstm(const PackedView& layer, const JointStates& joints) noexcept {
  HWY_DYNAMIC_DISPATCH(lstm_layer)(layer, joints);
}

void lstm_biases_apart(const PackedView& layer, const JointStates& joints) noexcept {
  HWY_DYNAMIC_DISPATCH(lstm_layer_biases_apart)(layer, joints);
}

void gru(const PackedView& layer, const JointStates& joints) noexcept {
  HWY_DYNAMIC_DISPATCH(gru_layer)(layer, joints);
}

void dense(const PackedView& layer, Activation activation, const float* input,
           float* output) noexcept {
  HWY_DYNAMIC_DISPATCH(dense_layer)(layer, activation, input, output);
}

float dot(const float* weights, const float* input, std::size_t count) noexcept {
  return HWY_DYNAMIC_DISPATCH(dot_product)(weights, input, count);
}

}  // namespace torsio::network_kernels
#endif

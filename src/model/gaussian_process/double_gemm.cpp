#include "model/gaussian_process/double_gemm.hpp"

#include <algorithm>

// Highway compiles this file once for each instruction set; the order of its headers matters.
// clang-format off
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "model/gaussian_process/double_gemm.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>
// clang-format on

HWY_BEFORE_NAMESPACE();
namespace torsio::double_gemm::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

using D = hn::CappedTag<double, 8>;
using V = hn::Vec<D>;

// 32 registers hold 8 rows of 3 vectors, 16 hold half of that.
#if HWY_TARGET <= HWY_AVX3 || HWY_TARGET == HWY_NEON
constexpr std::size_t kRows = 8;
#else
constexpr std::size_t kRows = 4;
#endif
constexpr std::size_t kVectors = 3;
constexpr std::size_t kMaxPanel = kVectors * 8;

// A block of the right factor's panel stays in the nearest cache, the left one in the second.
constexpr std::size_t kDepth = 192;
constexpr std::size_t kLeftRows = 96;
constexpr std::size_t kRightColumns = 480;

HWY_INLINE std::size_t panel() { return kVectors * hn::Lanes(D()); }
constexpr std::size_t rounded_up(std::size_t count, std::size_t to) {
  return (count + to - 1) / to * to;
}

// Rows [0, count) of `from` in groups of `width`: [group][depth][width], filled up with 0.
void pack(const Factor& from, std::size_t count, std::size_t depth, std::size_t width, double* to) {
  for (std::size_t i = 0; i < count; i += width, to += depth * width) {
    const std::size_t here = std::min(width, count - i);
    const double* row = from.values + i * from.row_step;
    if (from.column_step == 1) {
      for (std::size_t r = 0; r < here; ++r, row += from.row_step)
        for (std::size_t k = 0; k < depth; ++k) to[k * width + r] = row[k];
    } else {
      for (std::size_t k = 0; k < depth; ++k)
        for (std::size_t r = 0; r < here; ++r)
          to[k * width + r] = row[r * from.row_step + k * from.column_step];
    }
    for (std::size_t k = 0; here < width && k < depth; ++k)
      std::fill(to + k * width + here, to + (k + 1) * width, 0.0);
  }
}

// c [kRows x panel] (mode) left right.
HWY_INLINE void tile(const double* HWY_RESTRICT left, const double* HWY_RESTRICT right,
                     std::size_t depth, Mode mode, double* HWY_RESTRICT c, std::size_t stride) {
  const D d;
  const std::size_t lanes = hn::Lanes(d);
  // Registers: functions of std::array have no target attribute.
  V sum[kRows][kVectors];  // NOLINT(modernize-avoid-c-arrays)
  for (auto& row : sum)
    for (V& each : row) each = hn::Zero(d);
  for (std::size_t k = 0; k < depth; ++k, left += kRows, right += kVectors * lanes) {
    V b[kVectors];  // NOLINT(modernize-avoid-c-arrays)
    for (std::size_t j = 0; j < kVectors; ++j) b[j] = hn::Load(d, right + j * lanes);
    for (std::size_t i = 0; i < kRows; ++i) {
      const V a = hn::Set(d, left[i]);
      for (std::size_t j = 0; j < kVectors; ++j) sum[i][j] = hn::MulAdd(a, b[j], sum[i][j]);
    }
  }
  for (std::size_t i = 0; i < kRows; ++i)
    for (std::size_t j = 0; j < kVectors; ++j) {
      double* at = c + i * stride + j * lanes;
      if (mode == Mode::set) {
        hn::StoreU(sum[i][j], d, at);
      } else if (mode == Mode::add) {
        hn::StoreU(hn::Add(hn::LoadU(d, at), sum[i][j]), d, at);
      } else {
        hn::StoreU(hn::Sub(hn::LoadU(d, at), sum[i][j]), d, at);
      }
    }
}

// A tile that reaches beyond the result.
void edge_tile(const double* left, const double* right, std::size_t depth, Mode mode,
               const Result& c) {
  HWY_ALIGN double whole[kRows * kMaxPanel];  // NOLINT(modernize-avoid-c-arrays)
  tile(left, right, depth, Mode::set, whole, kMaxPanel);
  for (std::size_t i = 0; i < c.rows; ++i)
    for (std::size_t j = 0; j < c.columns; ++j) {
      double& at = c.values[i * c.stride + j];
      const double value = whole[i * kMaxPanel + j];
      at = mode == Mode::set ? value : mode == Mode::add ? at + value : at - value;
    }
}

struct Block {
  std::size_t first_row;  // in the whole result, to find its diagonal
  std::size_t first_column;
  bool lower_only;
};

void multiply_block(const double* left, const double* right, std::size_t depth, Mode mode,
                    const Result& c, const Block& block) {
  for (std::size_t j = 0; j < c.columns; j += panel()) {
    const std::size_t width = std::min(panel(), c.columns - j);
    for (std::size_t i = 0; i < c.rows; i += kRows) {
      const std::size_t height = std::min(kRows, c.rows - i);
      if (block.lower_only && block.first_column + j > block.first_row + i + height - 1) continue;
      double* at = c.values + i * c.stride + j;
      if (height == kRows && width == panel()) {
        tile(left + i * depth, right + j * depth, depth, mode, at, c.stride);
      } else {
        edge_tile(left + i * depth, right + j * depth, depth, mode, {at, c.stride, height, width});
      }
    }
  }
}

void multiply_any(const Factor& a, const Factor& b, std::size_t depth, Mode mode, const Result& c,
                  bool lower_only, double* left, double* right) {
  for (std::size_t j = 0; j < c.columns; j += kRightColumns) {
    const std::size_t columns = std::min(kRightColumns, c.columns - j);
    for (std::size_t k = 0; k < depth; k += kDepth) {
      const std::size_t part = std::min(kDepth, depth - k);
      const Mode here = k > 0 && mode == Mode::set ? Mode::add : mode;
      pack({b.values + k * b.row_step + j * b.column_step, b.column_step, b.row_step}, columns,
           part, panel(), right);
      const std::size_t first = lower_only ? j / kRows * kRows : 0;
      for (std::size_t i = first; i < c.rows; i += kLeftRows) {
        const std::size_t rows = std::min(kLeftRows, c.rows - i);
        pack({a.values + i * a.row_step + k * a.column_step, a.row_step, a.column_step}, rows, part,
             kRows, left);
        multiply_block(left, right, part, here,
                       {c.values + i * c.stride + j, c.stride, rows, columns}, {i, j, lower_only});
      }
    }
  }
}

std::size_t left_size() { return kLeftRows * kDepth; }
std::size_t right_size() { return rounded_up(kRightColumns, panel()) * kDepth; }

}  // namespace torsio::double_gemm::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace torsio::double_gemm {

HWY_EXPORT(multiply_any);
HWY_EXPORT(left_size);
HWY_EXPORT(right_size);

void multiply(const Factor& a, const Factor& b, std::size_t depth, Mode mode, const Result& c,
              bool lower_only, Scratch& scratch) {
  const std::size_t left = HWY_DYNAMIC_DISPATCH(left_size)();
  const std::size_t right = HWY_DYNAMIC_DISPATCH(right_size)();
  if (scratch.left.size() < left) scratch.left.resize(left);
  if (scratch.right.size() < right) scratch.right.resize(right);
  HWY_DYNAMIC_DISPATCH(multiply_any)
  (a, b, depth, mode, c, lower_only, scratch.left.data(), scratch.right.data());
}

}  // namespace torsio::double_gemm
#endif

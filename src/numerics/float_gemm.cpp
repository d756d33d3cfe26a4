#include "numerics/float_gemm.hpp"

#include <algorithm>
#include <cstring>

// Highway compiles this file once for each instruction set; the order of its headers matters.
// clang-format off
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "numerics/float_gemm.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>
// clang-format on

HWY_BEFORE_NAMESPACE();
namespace torsio::float_gemm::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

// 32 registers hold 8 rows of 2 vectors, 16 hold half of that.
#if HWY_TARGET <= HWY_AVX3 || HWY_TARGET == HWY_NEON
constexpr std::size_t kRows = 8;
#else
constexpr std::size_t kRows = 4;
#endif

/// Position of the left factor's element (row, k): values[row * row_stride + k * step].
struct Left {
  const float* values;
  std::size_t row_stride;
  std::size_t step;
};

// One block of C: kBlockRows rows, kVectors vectors side by side, `depth` products each.
template <std::size_t kBlockRows, std::size_t kVectors>
HWY_INLINE void block(const Left& a, const float* HWY_RESTRICT b, std::size_t b_vector_stride,
                      std::size_t depth, float* HWY_RESTRICT c, std::size_t c_stride,
                      bool accumulate) {
  const hn::CappedTag<float, kPanel> d;
  using V = hn::Vec<decltype(d)>;
  const std::size_t lanes = hn::Lanes(d);
  // Registers: functions of std::array have no target attribute.
  V sum[kBlockRows][kVectors];  // NOLINT(modernize-avoid-c-arrays)
  for (std::size_t i = 0; i < kBlockRows; ++i)
    for (std::size_t j = 0; j < kVectors; ++j)
      sum[i][j] = accumulate ? hn::LoadU(d, c + i * c_stride + j * lanes) : hn::Zero(d);
  for (std::size_t k = 0; k < depth; ++k) {
    V right[kVectors];  // NOLINT(modernize-avoid-c-arrays)
    for (std::size_t j = 0; j < kVectors; ++j)
      right[j] = hn::LoadU(d, b + j * b_vector_stride + k * kPanel);
    for (std::size_t i = 0; i < kBlockRows; ++i) {
      const V left = hn::Set(d, a.values[i * a.row_stride + k * a.step]);
      for (std::size_t j = 0; j < kVectors; ++j) sum[i][j] = hn::MulAdd(left, right[j], sum[i][j]);
    }
  }
  for (std::size_t i = 0; i < kBlockRows; ++i)
    for (std::size_t j = 0; j < kVectors; ++j)
      hn::StoreU(sum[i][j], d, c + i * c_stride + j * lanes);
}

// `rows` <= kRows rows of one or two panels.
template <std::size_t kBlockRows>
HWY_INLINE void rows_of_panels(const Left& a, const float* b, std::size_t panels,
                               std::size_t panel_stride, std::size_t depth, float* c,
                               std::size_t c_stride, bool accumulate) {
  const hn::CappedTag<float, kPanel> d;
  const std::size_t lanes = hn::Lanes(d);
  if (lanes == kPanel) {
    if (panels == 2) {
      block<kBlockRows, 2>(a, b, panel_stride, depth, c, c_stride, accumulate);
    } else {
      block<kBlockRows, 1>(a, b, panel_stride, depth, c, c_stride, accumulate);
    }
    return;
  }
  for (std::size_t p = 0; p < panels; ++p)
    for (std::size_t j = 0; j < kPanel; j += 2 * lanes)
      block<kBlockRows, 2>(a, b + p * panel_stride + j, lanes, depth, c + p * kPanel + j, c_stride,
                           accumulate);
}

void any_rows_of_panels(const Left& a, std::size_t rows, const float* b, std::size_t panels,
                        std::size_t panel_stride, std::size_t depth, float* c, std::size_t c_stride,
                        bool accumulate) {
  std::size_t i = 0;
  const auto from = [&](std::size_t row) {
    return Left{a.values + row * a.row_stride, a.row_stride, a.step};
  };
  for (; i + kRows <= rows; i += kRows)
    rows_of_panels<kRows>(from(i), b, panels, panel_stride, depth, c + i * c_stride, c_stride,
                          accumulate);
  if (i + 4 <= rows) {
    rows_of_panels<4>(from(i), b, panels, panel_stride, depth, c + i * c_stride, c_stride,
                      accumulate);
    i += 4;
  }
  for (; i < rows; ++i)
    rows_of_panels<1>(from(i), b, panels, panel_stride, depth, c + i * c_stride, c_stride,
                      accumulate);
}

// Depth of a block whose panels stay in the nearest cache.
constexpr std::size_t kDepth = 256;

void multiply_any(const float* a, std::size_t a_stride, std::size_t rows, const float* b,
                  std::size_t depth, std::size_t columns, float* c, std::size_t c_stride,
                  bool accumulate) {
  const std::size_t panels = in_panels(columns) / kPanel;
  for (std::size_t k = 0; k < depth || k == 0; k += kDepth) {
    const std::size_t part = std::min(kDepth, depth - k);
    for (std::size_t p = 0; p < panels; p += 2)
      any_rows_of_panels({a + k, a_stride, 1}, rows, b + (p * depth + k) * kPanel,
                         std::min<std::size_t>(2, panels - p), depth * kPanel, part, c + p * kPanel,
                         c_stride, accumulate || k > 0);
  }
}

// Both factors lie packed: `left` as [group of 8 columns][row][8], `right` as [panel][row][16].
void add_packed_any(const float* left, std::size_t left_columns, const float* right,
                    std::size_t panels, std::size_t depth, float* c, std::size_t c_stride) {
  for (std::size_t p = 0; p < panels; p += 2)
    for (std::size_t i = 0; i < left_columns; i += 8)
      any_rows_of_panels({left + i * depth, 1, 8}, std::min<std::size_t>(8, left_columns - i),
                         right + p * depth * kPanel, std::min<std::size_t>(2, panels - p),
                         depth * kPanel, depth, c + i * c_stride + p * kPanel, c_stride, true);
}

}  // namespace torsio::float_gemm::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace torsio::float_gemm {

HWY_EXPORT(multiply_any);
HWY_EXPORT(add_packed_any);

namespace {

constexpr std::size_t kGroup = 8;
constexpr std::size_t kRowsPerBlock = 192;

// Columns in groups of `group`, [group][row][group]; missing columns are 0.
template <std::size_t kWidth>
void pack_columns(const float* values, std::size_t stride, std::size_t rows, std::size_t columns,
                  float* to) {
  for (std::size_t j = 0; j < columns; j += kWidth) {
    const std::size_t width = std::min(kWidth, columns - j);
    const float* from = values + j;
    if (width == kWidth) {
      for (std::size_t k = 0; k < rows; ++k, to += kWidth, from += stride)
        std::memcpy(to, from, kWidth * sizeof(float));  // size known at compile time: no call
      continue;
    }
    for (std::size_t k = 0; k < rows; ++k, to += kWidth, from += stride)
      std::fill(std::copy_n(from, width, to), to + kWidth, 0.0F);
  }
}

}  // namespace

void PackedMatrix::resize(std::size_t rows, std::size_t columns) {
  rows_ = rows;
  columns_ = columns;
  values_.resize(rows * in_panels(columns));
}

void PackedMatrix::pack(const float* values, std::size_t stride, std::size_t rows,
                        std::size_t columns) {
  resize(rows, columns);
  pack_columns<kPanel>(values, stride, rows, columns, values_.data());
}

void PackedMatrix::pack_transposed(const float* values, std::size_t stride, std::size_t rows,
                                   std::size_t columns) {
  resize(rows, columns);
  float* to = values_.data();
  for (std::size_t p = 0; p < in_panels(columns); p += kPanel, to += rows * kPanel)
    for (std::size_t j = 0; j < kPanel; ++j)
      for (std::size_t k = 0; k < rows; ++k)
        to[k * kPanel + j] = p + j < columns ? values[(p + j) * stride + k] : 0.0F;
}

void multiply(const float* a, std::size_t a_stride, std::size_t rows, const PackedMatrix& b,
              float* c, std::size_t c_stride, bool accumulate) noexcept {
  HWY_DYNAMIC_DISPATCH(multiply_any)
  (a, a_stride, rows, b.values(), b.rows(), b.columns(), c, c_stride, accumulate);
}

void add_product_of_transposed(const float* a, std::size_t a_stride, std::size_t left,
                               const float* b, std::size_t b_stride, std::size_t right,
                               std::size_t rows, float* c, std::size_t c_stride, Scratch& scratch) {
  const std::size_t block = std::min(rows, kRowsPerBlock);
  scratch.left.resize(std::max(scratch.left.size(), (left + kGroup - 1) / kGroup * kGroup * block));
  scratch.right.resize(std::max(scratch.right.size(), in_panels(right) * block));
  for (std::size_t k = 0; k < rows; k += kRowsPerBlock) {
    const std::size_t part = std::min(kRowsPerBlock, rows - k);
    pack_columns<kGroup>(a + k * a_stride, a_stride, part, left, scratch.left.data());
    pack_columns<kPanel>(b + k * b_stride, b_stride, part, right, scratch.right.data());
    HWY_DYNAMIC_DISPATCH(add_packed_any)
    (scratch.left.data(), left, scratch.right.data(), in_panels(right) / kPanel, part, c, c_stride);
  }
}

}  // namespace torsio::float_gemm
#endif

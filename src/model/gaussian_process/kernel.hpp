#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/aligned_vector.hpp"
#include "torsio/core/matrix.hpp"
#include "torsio/core/realtime.hpp"
#include "torsio/model/common/model.hpp"

namespace torsio {

/// With D_i = x_i - z_i, R = sum_i D_i^2 / l_i^2, amplitude a and a further number s:
///
///     squared_exponential  a^2 exp(-R / 2)
///     linear               a^2 sum_i (x_i - s)(z_i - s) / l_i^2
///     periodic             a^2 exp(-2 sum_i sin^2(pi D_i / s) / l_i^2)
///     rational_quadratic   a^2 (1 + R / (2 s))^-s
///     matern32             a^2 (1 + sqrt(3 R)) exp(-sqrt(3 R))
///     matern52             a^2 (1 + sqrt(5 R) + 5 R / 3) exp(-sqrt(5 R))
///
/// The numbers are stored in model files: never reorder.
enum class KernelKind : std::uint8_t {
  squared_exponential = 0,
  linear = 1,
  periodic = 2,
  rational_quadratic = 3,
  matern32 = 4,
  matern52 = 5,
  sum = 6,
  product = 7,
};

/// One kernel of an expression, or the sum or product of two. Plain data.
struct KernelNode {
  std::size_t kind = 0;
  bool scaled = false;     ///< its amplitude is fitted; else it is 1
  double amplitude = 1.0;  ///< a
  double shape = 0.0;      ///< s: offset of linear, period of periodic, alpha of rational_quadratic
  std::vector<double>
      length_scales;  ///< l: one for all inputs or one per input; none for sum, product

  template <class Self, class Visit>
  static void visit_fields(Self& self, Visit&& visit) {
    visit("kind", self.kind);
    visit("scaled", self.scaled);
    visit("amplitude", self.amplitude);
    visit("shape", self.shape);
    visit("length_scales", self.length_scales);
  }
  bool operator==(const KernelNode&) const = default;
};

/// A covariance function; sums and products follow their operands (postfix).
struct KernelExpression {
  std::vector<KernelNode> nodes;

  template <class Self, class Visit>
  static void visit_fields(Self& self, Visit&& visit) {
    visit("nodes", self.nodes);
  }
  bool operator==(const KernelExpression&) const = default;
};

/// Reads "se * (linear + periodic * rq)": names se, linear, periodic, rq, matern32, matern52, each
/// followed by `_ard` for one length scale per input; +, *, brackets. All numbers are 1, offsets 0.
/// Every product of kernels without a sum among them has one amplitude, unless it contains a linear
/// kernel, whose length scale has the same effect: further amplitudes could not be identified from
/// any data.
/// @throws UsageError that points at the place.
[[nodiscard]] KernelExpression parse_kernel(std::string_view text, std::size_t inputs);

/// The reverse, without the numbers.
[[nodiscard]] std::string text_of(const KernelExpression& kernel);

/// A node of an expression as the vector code reads it.
struct KernelTerm {
  KernelKind kind = KernelKind::sum;
  bool scaled = false;
  bool shared_scale = true;
  double variance = 1.0;  ///< a^2
  double shape = 0.0;
  std::size_t left = 0;  ///< left operand of a sum or product; the right one is directly before it
  std::size_t first_parameter = 0;
  std::size_t first_weight = 0;  ///< index of 1 / l^2, one per input
};

/// The points stored input by input, padded to whole vectors with the last point.
class PackedPoints {
 public:
  PackedPoints() = default;
  explicit PackedPoints(const Matrix& points);

  [[nodiscard]] std::size_t size() const noexcept { return size_; }
  /// Places for values, one a point: what rows over all points take.
  [[nodiscard]] std::size_t padded_size() const noexcept { return stride_; }
  [[nodiscard]] const double* data() const noexcept { return values_.data(); }
  void set(std::size_t index, Features point) noexcept;

 private:
  std::size_t size_ = 0;
  std::size_t inputs_ = 0;
  std::size_t stride_ = 0;
  detail::AlignedVector<double> values_;  ///< [input][stride]
};

/// Sums of weights times derivatives, kept vector by vector until they are read.
class KernelGradient {
 public:
  explicit KernelGradient(std::size_t parameters);
  void clear() noexcept;
  [[nodiscard]] double operator[](std::size_t parameter) const noexcept;
  [[nodiscard]] double* lanes() noexcept { return lanes_.data(); }

 private:
  detail::AlignedVector<double> lanes_;
};

/// A covariance function ready to be evaluated, row by row over many points.
///
/// Its fitted numbers are the logarithms of amplitudes, length scales, periods and alpha, in the
/// order of the nodes (amplitude, length scales, shape); the offset of a linear kernel is not in
/// logarithms. Source: specification 3.3 (paper 002, equations 9 to 13, corrected), Rasmussen and
/// Williams 2006 chapter 4. Cost: 2 operations per input and point, about 20 per kernel and point
/// (24 per input for a periodic one).
class Kernel {
 public:
  static constexpr std::size_t kMaxNodes = 64;
  static constexpr std::size_t kMaxInputs = 4096;

  /// @throws Error that names the node: an unknown kind, a sum or product of less than two, a
  /// number of length scales that is neither 1 nor `inputs`, a number that is not finite, or not
  /// positive where it must be. An alpha below 0 (Table II of paper 002) is taken: that kernel
  /// exists where R < 2 |alpha| only, and is NaN elsewhere.
  Kernel(KernelExpression expression, std::size_t inputs);

  [[nodiscard]] const KernelExpression& expression() const noexcept { return expression_; }
  [[nodiscard]] std::size_t input_count() const noexcept { return inputs_; }
  [[nodiscard]] std::size_t parameter_count() const noexcept { return parameters_; }
  [[nodiscard]] std::vector<double> log_parameters() const;
  /// Nothing is checked: numbers that are not finite make values that are not.
  void set_log_parameters(std::span<const double> values) noexcept;

  /// values[j] = k(x, points[j]) for j < count, and some more up to a whole vector (`values` is
  /// aligned and has `points.padded_size()` places).
  void row(const double* x, const PackedPoints& points, std::size_t count,
           double* values) const noexcept TORSIO_REALTIME;

  /// k(x, x)
  [[nodiscard]] double self(const double* x) const noexcept TORSIO_REALTIME;

  /// gradient[p] += sum_j weights[j] dk(x, points[j]) / dp. Weights from `count` up to a whole
  /// vector are 0.
  void add_gradient(const double* x, const PackedPoints& points, std::size_t count,
                    const double* weights, KernelGradient& gradient) const noexcept;

 private:
  void prepare();
  void refresh() noexcept;

  KernelExpression expression_;
  std::size_t inputs_;
  std::size_t parameters_ = 0;
  std::vector<KernelTerm> terms_;
  std::vector<double> weights_;
};

}  // namespace torsio

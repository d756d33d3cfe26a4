#include "model/gaussian_process/cholesky.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "model/gaussian_process/double_gemm.hpp"

namespace torsio {
namespace {

using double_gemm::Factor;
using double_gemm::Mode;

// Smaller triangles are worked on number by number, and multiplied with as if they were whole.
constexpr std::size_t kSmall = 48;

/// A part of a matrix, row-major.
struct View {
  double* values;
  std::size_t stride;
  std::size_t rows;
  std::size_t columns;

  double& operator()(std::size_t i, std::size_t j) const { return values[i * stride + j]; }
  [[nodiscard]] View part(std::size_t i, std::size_t j, std::size_t r, std::size_t c) const {
    return {values + i * stride + j, stride, r, c};
  }
  [[nodiscard]] Factor factor() const { return {values, stride, 1}; }
};

/// A triangle cut in four: [top, -; side, bottom].
struct Quarters {
  View top;
  View side;
  View bottom;

  explicit Quarters(const View& a) : Quarters(a, std::max(kSmall, a.rows / 2 / kSmall * kSmall)) {}
  Quarters(const View& a, std::size_t half)
      : top(a.part(0, 0, half, half)),
        side(a.part(half, 0, a.rows - half, half)),
        bottom(a.part(half, half, a.rows - half, a.rows - half)) {}
};

using Small = std::array<double, kSmall * kSmall>;

class Triangle {
 public:
  bool factorise(const View& a) {
    if (a.rows <= kSmall) return factorise_small(a);
    const Quarters q(a);
    if (!factorise(q.top)) return false;
    divide(q.side, q.top);
    multiply(q.side.factor(), q.side.factor().transposed(), Mode::subtract, q.bottom, true,
             q.side.columns);
    return factorise(q.bottom);
  }

  /// L becomes L^-1.
  void invert(const View& l) {
    if (l.rows <= kSmall) {
      const Small inverse = inverse_of(l);
      for (std::size_t i = 0; i < l.rows; ++i)
        std::copy_n(inverse.begin() + static_cast<std::ptrdiff_t>(i * kSmall), i + 1, &l(i, 0));
      return;
    }
    const Quarters q(l);
    invert(q.top);
    invert(q.bottom);
    times_lower(q.side, q.top);
    lower_times(q.bottom, q.side, false);
    for (std::size_t i = 0; i < q.side.rows; ++i)
      for (std::size_t j = 0; j < q.side.columns; ++j) q.side(i, j) = -q.side(i, j);
  }

  /// W becomes the lower triangle of W^T W.
  void square(const View& w) {
    if (w.rows <= kSmall) return square_small(w);
    const Quarters q(w);
    square(q.top);
    multiply(q.side.factor().transposed(), q.side.factor(), Mode::add, q.top, true, q.side.rows);
    lower_times(q.bottom, q.side, true);
    square(q.bottom);
  }

 private:
  void multiply(const Factor& a, const Factor& b, Mode mode, const View& c, bool lower_only,
                std::size_t depth) {
    double_gemm::multiply(a, b, depth, mode, {c.values, c.stride, c.rows, c.columns}, lower_only,
                          scratch_);
  }
  static bool factorise_small(const View& a) {
    for (std::size_t j = 0; j < a.rows; ++j) {
      double pivot = a(j, j);
      for (std::size_t k = 0; k < j; ++k) pivot -= a(j, k) * a(j, k);
      if (!(pivot > 0.0) || !std::isfinite(pivot)) return false;
      const double root = std::sqrt(pivot);
      a(j, j) = root;
      for (std::size_t i = j + 1; i < a.rows; ++i) {
        double sum = a(i, j);
        for (std::size_t k = 0; k < j; ++k) sum -= a(i, k) * a(j, k);
        a(i, j) = sum / root;
      }
    }
    return true;
  }

  /// [kSmall x kSmall], 0 above the diagonal.
  static Small inverse_of(const View& l) {
    Small inverse{};
    for (std::size_t i = 0; i < l.rows; ++i) {
      for (std::size_t k = 0; k < i; ++k)
        for (std::size_t j = 0; j <= k; ++j)
          inverse[i * kSmall + j] -= l(i, k) * inverse[k * kSmall + j];
      for (std::size_t j = 0; j < i; ++j) inverse[i * kSmall + j] /= l(i, i);
      inverse[i * kSmall + i] = 1.0 / l(i, i);
    }
    return inverse;
  }

  static Small whole_of(const View& l) {
    Small whole{};
    for (std::size_t i = 0; i < l.rows; ++i)
      std::copy_n(&l(i, 0), i + 1, whole.begin() + static_cast<std::ptrdiff_t>(i * kSmall));
    return whole;
  }

  static void square_small(const View& w) {
    // Row i of the result needs rows of w from i on.
    for (std::size_t i = 0; i < w.rows; ++i)
      for (std::size_t j = 0; j <= i; ++j) {
        double sum = 0.0;
        for (std::size_t k = i; k < w.rows; ++k) sum += w(k, i) * w(k, j);
        w(i, j) = sum;
      }
  }

  /// B = left right, where B may be one of them.
  void replace(const View& b, const Factor& left, const Factor& right, std::size_t depth) {
    const std::size_t stride = (b.columns + 7) / 8 * 8;
    if (kept_.size() < b.rows * stride) kept_.resize(b.rows * stride);
    const View kept{kept_.data(), stride, b.rows, b.columns};
    multiply(left, right, Mode::set, kept, false, depth);
    for (std::size_t i = 0; i < b.rows; ++i) std::copy_n(&kept(i, 0), b.columns, &b(i, 0));
  }

  /// B = B L^-T.
  void divide(const View& b, const View& l) {
    if (l.rows <= kSmall) {
      const Small inverse = inverse_of(l);
      replace(b, b.factor(), {inverse.data(), 1, kSmall}, l.rows);
      return;
    }
    const Quarters q(l);
    const View first = b.part(0, 0, b.rows, q.top.rows);
    const View rest = b.part(0, q.top.rows, b.rows, q.bottom.rows);
    divide(first, q.top);
    multiply(first.factor(), q.side.factor().transposed(), Mode::subtract, rest, false,
             first.columns);
    divide(rest, q.bottom);
  }

  /// B = B L.
  void times_lower(const View& b, const View& l) {
    if (l.rows <= kSmall) {
      const Small whole = whole_of(l);
      replace(b, b.factor(), {whole.data(), kSmall, 1}, l.rows);
      return;
    }
    const Quarters q(l);
    const View first = b.part(0, 0, b.rows, q.top.rows);
    const View rest = b.part(0, q.top.rows, b.rows, q.bottom.rows);
    times_lower(first, q.top);
    multiply(rest.factor(), q.side.factor(), Mode::add, first, false, rest.columns);
    times_lower(rest, q.bottom);
  }

  /// B = L B, or L^T B.
  void lower_times(const View& l, const View& b, bool transposed) {
    if (l.rows <= kSmall) {
      const Small whole = whole_of(l);
      const Factor left{whole.data(), kSmall, 1};
      replace(b, transposed ? left.transposed() : left, b.factor(), l.rows);
      return;
    }
    const Quarters q(l);
    const View first = b.part(0, 0, q.top.rows, b.columns);
    const View rest = b.part(q.top.rows, 0, q.bottom.rows, b.columns);
    if (transposed) {
      lower_times(q.top, first, true);
      multiply(q.side.factor().transposed(), rest.factor(), Mode::add, first, false, rest.rows);
      lower_times(q.bottom, rest, true);
    } else {
      lower_times(q.bottom, rest, false);
      multiply(q.side.factor(), first.factor(), Mode::add, rest, false, first.rows);
      lower_times(q.top, first, false);
    }
  }

  double_gemm::Scratch scratch_;
  detail::AlignedVector<double> kept_;
};

View view_of(SquareMatrix& matrix) {
  return {matrix.row(0), matrix.stride(), matrix.size(), matrix.size()};
}

}  // namespace

bool cholesky(SquareMatrix& a) { return Triangle().factorise(view_of(a)); }

void solve(const SquareMatrix& factor, std::span<double> b) noexcept {
  for (std::size_t i = 0; i < b.size(); ++i) {
    const double* row = factor.row(i);
    double sum = b[i];
    for (std::size_t j = 0; j < i; ++j) sum -= row[j] * b[j];
    b[i] = sum / row[i];
  }
  for (std::size_t i = b.size(); i-- > 0;) {
    const double* row = factor.row(i);
    b[i] /= row[i];
    for (std::size_t j = 0; j < i; ++j) b[j] -= row[j] * b[i];
  }
}

void invert(SquareMatrix& factor) {
  Triangle triangle;
  triangle.invert(view_of(factor));
  triangle.square(view_of(factor));
}

double log_determinant(const SquareMatrix& factor) noexcept {
  double sum = 0.0;
  for (std::size_t i = 0; i < factor.size(); ++i) sum += std::log(factor(i, i));
  return 2.0 * sum;
}

}  // namespace torsio

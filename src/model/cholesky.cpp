#include "model/cholesky.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <cmath>

namespace torsio {
namespace {

using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

template <class Square>
auto map_of(Square& matrix) {
  using Plain = std::conditional_t<std::is_const_v<Square>, const RowMajor, RowMajor>;
  const auto size = static_cast<Eigen::Index>(matrix.size());
  return Eigen::Map<Plain, Eigen::Unaligned, Eigen::OuterStride<>>(
      matrix.row(0), size, size, Eigen::OuterStride<>(static_cast<Eigen::Index>(matrix.stride())));
}

}  // namespace

bool cholesky(SquareMatrix& a) noexcept {
  auto matrix = map_of(a);
  if (Eigen::internal::llt_inplace<double, Eigen::Lower>::blocked(matrix) != -1) return false;
  return matrix.diagonal().allFinite();
}

void solve(const SquareMatrix& factor, std::span<double> b) noexcept {
  const auto lower = map_of(factor).triangularView<Eigen::Lower>();
  Eigen::Map<Eigen::VectorXd> x(b.data(), static_cast<Eigen::Index>(b.size()));
  lower.solveInPlace(x);
  lower.transpose().solveInPlace(x);
}

void invert(SquareMatrix& factor) {
  auto matrix = map_of(factor);
  RowMajor inverse = RowMajor::Identity(matrix.rows(), matrix.cols());
  const auto lower = matrix.triangularView<Eigen::Lower>();
  lower.solveInPlace(inverse);
  matrix.noalias() = inverse.transpose() * inverse;
}

double log_determinant(const SquareMatrix& factor) noexcept {
  double sum = 0.0;
  for (std::size_t i = 0; i < factor.size(); ++i) sum += std::log(factor(i, i));
  return 2.0 * sum;
}

}  // namespace torsio

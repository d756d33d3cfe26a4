#include "numerics/least_squares.hpp"

#include <Eigen/QR>
#include <algorithm>
#include <string>

#include "core/row_major_map.hpp"
#include "torsio/core/error.hpp"

namespace torsio {
namespace {

constexpr double kDependent = 1e-10;

struct Factorised {
  Eigen::HouseholderQR<Eigen::MatrixXd> qr;
  std::vector<std::size_t> kept;
  std::vector<double> lengths;  ///< lengths of the kept columns before scaling
  std::vector<std::size_t> dropped;
};

Eigen::MatrixXd scaled_columns(const Eigen::Map<const RowMajor>& design,
                               const Factorised& factorised) {
  Eigen::MatrixXd scaled(design.rows(), static_cast<Eigen::Index>(factorised.kept.size()));
  for (std::size_t i = 0; i < factorised.kept.size(); ++i)
    scaled.col(static_cast<Eigen::Index>(i)) =
        design.col(static_cast<Eigen::Index>(factorised.kept[i])) / factorised.lengths[i];
  return scaled;
}

Factorised factorise(const Matrix& matrix) {
  const Eigen::Map<const RowMajor> design(matrix.values.data(),
                                          static_cast<Eigen::Index>(matrix.rows),
                                          static_cast<Eigen::Index>(matrix.columns));
  Factorised result;
  for (std::size_t j = 0; j < matrix.columns; ++j) {
    const double length = design.col(static_cast<Eigen::Index>(j)).norm();
    if (length > 0.0) {
      result.kept.push_back(j);
      result.lengths.push_back(length);
    } else {
      result.dropped.push_back(j);
    }
  }
  // After a dependent column the factors are meaningless, so the factorisation restarts for each
  // one found.
  while (true) {
    if (matrix.rows < result.kept.size())
      throw Error({.problem = "too few samples to fit",
                   .expected = "at least " + std::to_string(result.kept.size()) +
                               ", one for each coefficient",
                   .found = std::to_string(matrix.rows)});
    result.qr.compute(scaled_columns(design, result));
    std::size_t i = 0;
    while (i < result.kept.size() &&
           std::abs(result.qr.matrixQR()(static_cast<Eigen::Index>(i),
                                         static_cast<Eigen::Index>(i))) >= kDependent)
      ++i;
    if (i == result.kept.size()) return result;
    result.dropped.push_back(result.kept[i]);
    result.kept.erase(result.kept.begin() + static_cast<std::ptrdiff_t>(i));
    result.lengths.erase(result.lengths.begin() + static_cast<std::ptrdiff_t>(i));
  }
}

}  // namespace

LeastSquares least_squares(const Matrix& design, std::span<const double> target) {
  const Factorised factorised = factorise(design);
  LeastSquares result{std::vector<double>(design.columns, 0.0), factorised.dropped};
  if (factorised.kept.empty()) return result;
  const Eigen::Map<const Eigen::VectorXd> y(target.data(),
                                            static_cast<Eigen::Index>(target.size()));
  const Eigen::VectorXd solution = factorised.qr.solve(y);
  for (std::size_t i = 0; i < factorised.kept.size(); ++i)
    result.coefficients[factorised.kept[i]] =
        solution(static_cast<Eigen::Index>(i)) / factorised.lengths[i];
  return result;
}

StreamedLeastSquares::StreamedLeastSquares(std::size_t columns, std::size_t block_rows)
    : rows_(columns + 1 + std::max<std::size_t>(block_rows, 1), columns + 1) {}

void StreamedLeastSquares::add(std::span<const double> row, double target) {
  if (filled_ == rows_.rows) reduce();
  const std::span<double> to = rows_.row(filled_++);
  std::ranges::copy(row, to.begin());
  to.back() = target;
}

void StreamedLeastSquares::reduce() {
  const auto columns = static_cast<Eigen::Index>(rows_.columns);
  const auto filled = static_cast<Eigen::Index>(filled_);
  if (filled <= columns) return;
  Eigen::Map<RowMajor> rows(rows_.values.data(), filled, columns);
  const Eigen::HouseholderQR<Eigen::MatrixXd> qr{Eigen::MatrixXd(rows)};
  rows.topRows(columns) = qr.matrixQR().topRows(columns).triangularView<Eigen::Upper>();
  filled_ = rows_.columns;
}

LeastSquares StreamedLeastSquares::solve() {
  reduce();
  Matrix design(filled_, rows_.columns - 1);
  std::vector<double> target(filled_);
  for (std::size_t n = 0; n < filled_; ++n) {
    std::ranges::copy(rows_.row(n).first(design.columns), design.row(n).begin());
    target[n] = rows_.row(n).back();
  }
  return least_squares(design, target);
}

Matrix orthonormal_basis(const Matrix& design) {
  const Factorised factorised = factorise(design);
  Matrix basis(design.rows, factorised.kept.size());
  const auto rows = static_cast<Eigen::Index>(basis.rows);
  const auto columns = static_cast<Eigen::Index>(basis.columns);
  Eigen::Map<RowMajor>(basis.values.data(), rows, columns) =
      factorised.qr.householderQ() * Eigen::MatrixXd::Identity(rows, columns);
  return basis;
}

}  // namespace torsio

#include "numerics/least_squares.hpp"

#include <Eigen/QR>
#include <string>

#include "torsio/core/error.hpp"

namespace torsio {
namespace {

using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

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

#include "evaluate/drift/direction_fit.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "fit/redundancy/block_bootstrap.hpp"
#include "numerics/least_squares.hpp"

namespace torsio {
namespace {

using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

Matrix picked(const Matrix& columns, const std::vector<std::size_t>& which) {
  Matrix result(columns.rows, which.size());
  for (std::size_t n = 0; n < columns.rows; ++n)
    for (std::size_t j = 0; j < which.size(); ++j) result(n, j) = columns(n, which[j]);
  return result;
}

Eigen::MatrixXd gram_of(const Matrix& columns) {
  const auto size = static_cast<Eigen::Index>(columns.columns);
  const Eigen::Map<const RowMajor> all(columns.values.data(),
                                       static_cast<Eigen::Index>(columns.rows), size);
  return all.transpose() * all;
}

/// Square of the length of column j without what `others` explain.
double own_square(const Eigen::MatrixXd& gram, std::size_t j,
                  const std::vector<std::size_t>& others) {
  const auto at = [](std::size_t k) { return static_cast<Eigen::Index>(k); };
  const double square = gram(at(j), at(j));
  if (others.empty() || !(square > 0.0)) return square;
  const auto size = at(others.size());
  Eigen::MatrixXd among(size, size);
  Eigen::VectorXd with(size);
  Eigen::VectorXd scale(size);
  for (Eigen::Index a = 0; a < size; ++a)
    scale(a) = 1.0 / std::sqrt(gram(at(others[static_cast<std::size_t>(a)]),
                                    at(others[static_cast<std::size_t>(a)])));
  for (Eigen::Index a = 0; a < size; ++a) {
    const auto first = at(others[static_cast<std::size_t>(a)]);
    with(a) = gram(first, at(j)) * scale(a);
    for (Eigen::Index b = 0; b < size; ++b)
      among(a, b) = gram(first, at(others[static_cast<std::size_t>(b)])) * scale(a) * scale(b);
  }
  return std::max(0.0, square - with.dot(among.fullPivLu().solve(with)));
}

/// Columns that do not explain each other, in their order.
std::vector<std::size_t> separable(const Eigen::MatrixXd& gram) {
  std::vector<std::size_t> kept;
  for (std::size_t j = 0; j < static_cast<std::size_t>(gram.cols()); ++j) {
    const auto at = static_cast<Eigen::Index>(j);
    const double square = gram(at, at);
    if (square > 0.0 && own_square(gram, j, kept) > kLeastOwnShare * kLeastOwnShare * square)
      kept.push_back(j);
  }
  return kept;
}

/// The inverse of R in columns = basis R.
Matrix to_coefficients(const Matrix& basis, const Matrix& columns) {
  const auto size = static_cast<Eigen::Index>(columns.columns);
  const auto rows = static_cast<Eigen::Index>(columns.rows);
  const Eigen::Map<const RowMajor> q(basis.values.data(), rows, size);
  const Eigen::Map<const RowMajor> a(columns.values.data(), rows, size);
  const Eigen::MatrixXd inverse = (q.transpose() * a).eval().fullPivLu().inverse();
  Matrix result(columns.columns, columns.columns);
  for (std::size_t i = 0; i < result.rows; ++i)
    for (std::size_t j = 0; j < result.columns; ++j)
      result(i, j) = inverse(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j));
  return result;
}

}  // namespace

double DirectionFit::residual_rms() const noexcept {
  double sum = 0.0;
  for (const double value : residual) sum += value * value;
  return std::sqrt(sum / static_cast<double>(residual.size()));
}

LastingError DirectionFit::lasting_error(std::size_t lag) const noexcept {
  constexpr std::size_t kSpan = 4;
  const auto covariance = [this](std::size_t apart) {
    double sum = 0.0;
    for (std::size_t n = apart; n < residual.size(); ++n) sum += residual[n] * residual[n - apart];
    return sum / static_cast<double>(residual.size());
  };
  const double power = covariance(0);
  // A ripple may pass through zero at a single lag.
  double shared = 0.0;
  for (std::size_t apart = lag; apart <= kSpan * lag; ++apart)
    shared = std::max(shared, covariance(apart));
  // The correlation of white noise is 0 +- 1 / sqrt(N).
  const double least = power / std::sqrt(static_cast<double>(residual.size()));
  constexpr double kSure = 2.0;
  return {.rms = std::sqrt(std::clamp(shared, least, std::max(least, power))),
          .is_resolved = shared > kSure * least};
}

DirectionFit fit_directions(const Matrix& columns, std::span<const double> residual,
                            std::size_t resamples, std::uint64_t seed) {
  const Eigen::MatrixXd gram = gram_of(columns);
  const std::vector<std::size_t> kept = separable(gram);
  const Matrix design = picked(columns, kept);
  DirectionFit fit{.coefficients = std::vector<double>(columns.columns, 0.0),
                   .standard_errors = std::vector<double>(columns.columns, kNotMeasured),
                   .own_rms = std::vector<double>(columns.columns, 0.0),
                   .residual = {residual.begin(), residual.end()}};
  const LeastSquares solution = least_squares(design, residual);
  for (std::size_t n = 0; n < design.rows; ++n)
    for (std::size_t j = 0; j < design.columns; ++j)
      fit.residual[n] -= solution.coefficients[j] * design(n, j);
  const Matrix basis = orthonormal_basis(design);
  const BlockBootstrap bootstrap =
      block_bootstrap(basis, fit.residual, to_coefficients(basis, design), resamples, seed);
  fit.effective_samples = bootstrap.effective_samples;
  for (std::size_t j = 0; j < kept.size(); ++j) {
    std::vector<std::size_t> others = kept;
    std::erase(others, kept[j]);
    fit.coefficients[kept[j]] = solution.coefficients[j];
    fit.standard_errors[kept[j]] = bootstrap.standard_errors[j];
    fit.own_rms[kept[j]] =
        std::sqrt(own_square(gram, kept[j], others) / static_cast<double>(columns.rows));
  }
  return fit;
}

}  // namespace torsio

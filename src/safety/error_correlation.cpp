#include "error_correlation.hpp"

#include <fmt/format.h>

#include <cmath>
#include <numeric>

#include "torsio/core/error.hpp"

namespace torsio::detail {
namespace {

/// Cholesky factorisation in place, lower triangle.
/// @returns the smallest pivot, which is not positive (or NaN) where the matrix is not positive definite
double factorise(SquareMatrix& matrix, std::size_t count) noexcept {
  double smallest = matrix[0][0];
  for (std::size_t j = 0; j < count; ++j) {
    for (std::size_t k = 0; k < j; ++k) matrix[j][j] -= matrix[j][k] * matrix[j][k];
    if (!(matrix[j][j] > smallest)) smallest = matrix[j][j];
    matrix[j][j] = std::sqrt(matrix[j][j]);
    for (std::size_t i = j + 1; i < count; ++i) {
      for (std::size_t k = 0; k < j; ++k) matrix[i][j] -= matrix[i][k] * matrix[j][k];
      matrix[i][j] /= matrix[j][j];
    }
  }
  return smallest;
}

}  // namespace

SquareMatrix error_correlation(const std::vector<double>& rows, std::size_t count,
                               std::string_view place) {
  SquareMatrix matrix{};
  for (std::size_t i = 0; i < count; ++i) matrix[i][i] = 1.0;
  if (rows.empty()) return matrix;
  if (rows.size() != count * count)
    throw Error({.place = std::string(place),
                 .expected = fmt::format("a correlation of {0} x {0} numbers", count),
                 .found = fmt::format("{}", rows.size())});
  for (std::size_t i = 0; i < count; ++i)
    for (std::size_t j = 0; j < count; ++j) {
      matrix[i][j] = rows[i * count + j];
      const bool is_sound = i == j ? matrix[i][j] == 1.0 : matrix[i][j] == rows[j * count + i];
      if (!is_sound || !(std::abs(matrix[i][j]) <= 1.0))
        throw Error({.place = std::string(place),
                     .expected = "a symmetric correlation with ones on its diagonal",
                     .found = fmt::format("{} in row {}, column {}", matrix[i][j], i + 1, j + 1)});
    }
  SquareMatrix factor = matrix;
  if (!(factorise(factor, count) > 1e-9))
    throw Error({.place = std::string(place),
                 .problem = "the correlation of the sources is not positive definite",
                 .advice = "two sources with a correlation of 1 are one source"});
  return matrix;
}

std::array<double, Redundancy::kMaxSources> smallest_variance(
    const SquareMatrix& covariance, std::span<const std::size_t> index) noexcept {
  const std::size_t count = index.size();
  SquareMatrix factor{};
  for (std::size_t i = 0; i < count; ++i)
    for (std::size_t j = 0; j <= i; ++j) factor[i][j] = covariance[index[i]][index[j]];
  factorise(factor, count);
  std::array<double, Redundancy::kMaxSources> x{};
  for (std::size_t i = 0; i < count; ++i) {
    x[i] = 1.0;
    for (std::size_t k = 0; k < i; ++k) x[i] -= factor[i][k] * x[k];
    x[i] /= factor[i][i];
  }
  for (std::size_t i = count; i-- > 0;) {
    for (std::size_t k = i + 1; k < count; ++k) x[i] -= factor[k][i] * x[k];
    x[i] /= factor[i][i];
  }
  const double sum =
      std::accumulate(x.begin(), x.begin() + static_cast<std::ptrdiff_t>(count), 0.0);
  for (std::size_t i = 0; i < count; ++i) x[i] /= sum;
  return x;
}

}  // namespace torsio::detail

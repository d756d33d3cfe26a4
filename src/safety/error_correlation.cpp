#include "error_correlation.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "torsio/core/error.hpp"

namespace torsio::detail {
namespace {

/// Cholesky factorisation in place, lower triangle.
/// @returns the smallest pivot, which is not positive (or NaN) where the matrix is not positive
/// definite
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

std::vector<double> inverses(const SquareMatrix& correlation, std::size_t count) {
  const std::size_t size = count * count;
  std::vector<double> result((std::size_t{1} << count) * size, 0.0);
  for (std::size_t set = 1; set < std::size_t{1} << count; ++set) {
    // The other sources keep a row and column of the unit matrix, which is its own inverse.
    SquareMatrix factor{};
    const auto has = [set](std::size_t i) { return (set >> i & 1U) != 0; };
    for (std::size_t i = 0; i < count; ++i)
      for (std::size_t j = 0; j <= i; ++j)
        factor[i][j] = i == j || (has(i) && has(j)) ? correlation[i][j] : 0.0;
    factorise(factor, count);
    for (std::size_t column = 0; column < count; ++column) {
      if (!has(column)) continue;
      std::array<double, Redundancy::kMaxSources> x{};
      x[column] = 1.0;
      for (std::size_t i = 0; i < count; ++i) {
        for (std::size_t k = 0; k < i; ++k) x[i] -= factor[i][k] * x[k];
        x[i] /= factor[i][i];
      }
      for (std::size_t i = count; i-- > 0;) {
        for (std::size_t k = i + 1; k < count; ++k) x[i] -= factor[k][i] * x[k];
        x[i] /= factor[i][i];
      }
      std::copy_n(x.begin(), count,
                  result.begin() + static_cast<std::ptrdiff_t>(set * size + column * count));
    }
  }
  return result;
}

}  // namespace torsio::detail

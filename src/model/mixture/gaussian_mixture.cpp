#include "model/mixture/gaussian_mixture.hpp"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <numeric>
#include <span>

#include "core/all_finite.hpp"
#include "torsio/core/error.hpp"

namespace torsio {
namespace {

void check_shapes(const GaussianMixture& mixture, const std::string& place) {
  const std::size_t m = mixture.size();
  const std::size_t d = mixture.dimension();
  const auto check_shape = [&](const char* field, const Matrix& matrix, std::size_t columns) {
    if (matrix.rows != m || matrix.columns != columns || matrix.values.size() != m * columns)
      throw Error({.place = place + ": " + field,
                   .expected = fmt::format("[{} x {}]", m, columns),
                   .found = fmt::format("[{} x {}]", matrix.rows, matrix.columns)});
  };
  if (m == 0) throw Error({.place = place, .expected = "at least one component", .found = "none"});
  if (d == 0) throw Error({.place = place, .expected = "at least one quantity", .found = "none"});
  if (d > kMaxMixtureQuantities)
    throw Error({.place = place,
                 .expected = fmt::format("at most {} quantities", kMaxMixtureQuantities),
                 .found = std::to_string(d)});
  if (mixture.scale.size() != d)
    throw Error({.place = place + ": scale",
                 .expected = fmt::format("{} values, as in centre", d),
                 .found = std::to_string(mixture.scale.size())});
  check_shape("means", mixture.means, d);
  check_shape("covariances", mixture.covariances, d * d);
}

void check_scaling(const GaussianMixture& mixture, const std::string& place) {
  for (std::size_t j = 0; j < mixture.dimension(); ++j) {
    if (!std::isfinite(mixture.centre[j]))
      throw Error({.place = fmt::format("{}: centre of quantity {}", place, j),
                   .expected = "a finite value",
                   .found = fmt::format("{}", mixture.centre[j])});
    if (!std::isfinite(mixture.scale[j]) || mixture.scale[j] <= 0.0)
      throw Error({.place = fmt::format("{}: scale of quantity {}", place, j),
                   .expected = "a positive finite value",
                   .found = fmt::format("{}", mixture.scale[j])});
  }
}

void check_component(const GaussianMixture& mixture, std::size_t i, const std::string& place) {
  const auto wrong = [&](const char* what, std::string expected, std::string found) {
    throw Error({.place = fmt::format("{}: component {}", place, i),
                 .problem = what,
                 .expected = std::move(expected),
                 .found = std::move(found)});
  };
  const double weight = mixture.weights[i];
  if (!std::isfinite(weight) || weight <= 0.0)
    wrong("bad weight", "a positive finite value", fmt::format("{}", weight));
  if (!all_finite(mixture.means.row(i))) wrong("bad mean", "finite values", "NaN or infinity");
  if (!all_finite(mixture.covariances.row(i)))
    wrong("bad covariance", "finite values", "NaN or infinity");

  const auto d = static_cast<Eigen::Index>(mixture.dimension());
  const Eigen::Map<const Eigen::MatrixXd> covariance(mixture.covariances.row(i).data(), d, d);
  const double asymmetry = (covariance - covariance.transpose()).cwiseAbs().maxCoeff();
  if (asymmetry > 1e-9 * covariance.cwiseAbs().maxCoeff())
    wrong("bad covariance", "a symmetric matrix", fmt::format("a difference of {:.3g}", asymmetry));
  if (const Eigen::LLT<Eigen::MatrixXd> cholesky(covariance); cholesky.info() != Eigen::Success)
    wrong("bad covariance", "a positive definite matrix", "one that has no Cholesky factor");
}

}  // namespace

void check(const GaussianMixture& mixture, const std::string& place) {
  check_shapes(mixture, place);
  check_scaling(mixture, place);
  for (std::size_t i = 0; i < mixture.size(); ++i) check_component(mixture, i, place);
  const double sum = std::accumulate(mixture.weights.begin(), mixture.weights.end(), 0.0);
  if (std::abs(sum - 1.0) > 1e-6)
    throw Error(
        {.place = place + ": weights", .expected = "a sum of 1", .found = fmt::format("{}", sum)});
}

}  // namespace torsio

#include "model/narx/multivariate_polynomial.hpp"

#include <cmath>
#include <string>
#include <utility>

#include "core/checks.hpp"

namespace torsio {
namespace {

constexpr std::string_view kPlace = "polynomial";

void check_shapes(const MultivariatePolynomial::Parameters& p) {
  require(p.powers.rows >= 1 && p.powers.columns >= 1, {kPlace, "powers"},
          "at least one term and one input",
          std::to_string(p.powers.rows) + " x " + std::to_string(p.powers.columns));
  require(p.powers.values.size() == p.powers.rows * p.powers.columns, {kPlace, "powers"},
          "rows x columns", std::to_string(p.powers.values.size()) + " numbers");
  require(p.scales.size() == p.powers.columns, {kPlace, "scales"},
          std::to_string(p.powers.columns) + ", one for each input",
          std::to_string(p.scales.size()));
  require(p.coefficients.size() == p.powers.rows, {kPlace, "coefficients"},
          std::to_string(p.powers.rows) + ", one for each term",
          std::to_string(p.coefficients.size()));
  for (const double scale : p.scales)
    require(std::isfinite(scale) && scale > 0.0, {kPlace, "scales"}, "positive numbers", scale);
  for (const double coefficient : p.coefficients)
    require(std::isfinite(coefficient), {kPlace, "coefficients"}, "finite numbers", coefficient);
}

/// @returns the degree of the term.
std::size_t checked_degree(const Matrix& powers, std::size_t term) {
  constexpr auto kHighest = static_cast<double>(MultivariatePolynomial::kHighestDegree);
  double degree = 0.0;
  for (const double power : powers.row(term)) {
    require(power >= 0.0 && power <= kHighest && power == std::floor(power), {kPlace, "powers"},
            "whole numbers not below 0", power);
    degree += power;
  }
  require(degree <= kHighest, {kPlace, "powers"},
          "a degree of at most " + std::to_string(MultivariatePolynomial::kHighestDegree), degree);
  return static_cast<std::size_t>(degree);
}

}  // namespace

MultivariatePolynomial::MultivariatePolynomial(Parameters parameters)
    : parameters_(std::move(parameters)) {
  check_shapes(parameters_);
  const Matrix& powers = parameters_.powers;
  std::vector<std::size_t> place(powers.columns, powers.columns);
  for (std::size_t j = 0; j < powers.rows; ++j) {
    factors_.reserve(factors_.size() + checked_degree(powers, j));
    for (std::size_t i = 0; i < powers.columns; ++i) {
      const auto times = static_cast<std::size_t>(powers(j, i));
      if (times == 0) continue;
      if (place[i] == powers.columns) {
        place[i] = used_.size();
        used_.push_back({i, 1.0 / parameters_.scales[i]});
      }
      factors_.insert(factors_.end(), times, place[i]);
    }
    ends_.push_back(factors_.size());
  }
  scaled_.resize(used_.size());
}

Estimate MultivariatePolynomial::step(Features features) noexcept {
  for (std::size_t k = 0; k < used_.size(); ++k)
    scaled_[k] = features[used_[k].input] * used_[k].per_scale;
  double value = 0.0;
  std::size_t at = 0;
  for (std::size_t j = 0; j < ends_.size(); ++j) {
    double term = parameters_.coefficients[j];
    for (; at < ends_[j]; ++at) term *= scaled_[factors_[at]];
    value += term;
  }
  return {.value = value};
}

}  // namespace torsio

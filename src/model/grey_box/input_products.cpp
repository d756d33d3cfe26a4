#include "model/grey_box/input_products.hpp"

#include <cmath>
#include <string>
#include <utility>

#include "core/checks.hpp"

namespace torsio {
namespace {

constexpr std::string_view kPlace = InputProducts::kFamily;

InputProducts::Parameters checked(InputProducts::Parameters p) {
  require(p.degree >= InputProducts::kLowestDegree && p.degree <= InputProducts::kHighestDegree,
          {kPlace, "degree"}, "2 or 3", std::to_string(p.degree));
  require(!p.scales.empty() && p.centres.size() == p.scales.size(), {kPlace, "centres"},
          "one for each scale",
          std::to_string(p.centres.size()) + " for " + std::to_string(p.scales.size()));
  for (const double centre : p.centres)
    require(std::isfinite(centre), {kPlace, "centres"}, "finite numbers", centre);
  for (const double scale : p.scales)
    require(std::isfinite(scale) && scale >= 0.0, {kPlace, "scales"}, "numbers >= 0", scale);
  const std::size_t used = p.used().size();
  require(used >= 1 && used <= InputProducts::kMaxUsed, {kPlace, "scales"},
          "1 to " + std::to_string(InputProducts::kMaxUsed) + " that are not 0",
          std::to_string(used));
  const std::size_t count = InputProducts::count(used, p.degree);
  require(p.coefficients.size() == count, {kPlace, "coefficients"},
          std::to_string(count) + ", one for each product", std::to_string(p.coefficients.size()));
  for (const double coefficient : p.coefficients)
    require(std::isfinite(coefficient), {kPlace, "coefficients"}, "finite numbers", coefficient);
  return p;
}

}  // namespace

std::vector<std::size_t> InputProducts::Parameters::used() const {
  std::vector<std::size_t> places;
  for (std::size_t i = 0; i < scales.size(); ++i)
    if (scales[i] > 0.0) places.push_back(i);
  return places;
}

std::size_t InputProducts::count(std::size_t used, std::size_t degree) noexcept {
  // (used + degree) over degree
  std::size_t count = 1;
  for (std::size_t d = 1; d <= degree; ++d) count = count * (used + d) / d;
  return count;
}

void InputProducts::terms(std::span<const double> z, std::size_t degree,
                          std::span<double> products) noexcept {
  const bool is_cubic = degree == kHighestDegree;
  std::size_t at = 0;
  products[at++] = 1.0;
  for (std::size_t i = 0; i < z.size(); ++i) {
    products[at++] = z[i];
    for (std::size_t j = i; j < z.size(); ++j) {
      const double pair = z[i] * z[j];
      products[at++] = pair;
      for (std::size_t k = j; is_cubic && k < z.size(); ++k) products[at++] = pair * z[k];
    }
  }
}

InputProducts::InputProducts(Parameters parameters)
    : parameters_(checked(std::move(parameters))), used_(parameters_.used()), z_(used_.size()) {}

Estimate InputProducts::step(Features features) noexcept {
  for (std::size_t i = 0; i < used_.size(); ++i) {
    const std::size_t input = used_[i];
    z_[i] = (features[input] - parameters_.centres[input]) / parameters_.scales[input];
  }
  const bool is_cubic = parameters_.degree == kHighestDegree;
  const double* c = parameters_.coefficients.data();
  const std::size_t count = z_.size();
  double value = *c++;
  for (std::size_t i = 0; i < count; ++i) {
    double of_first = *c++;
    for (std::size_t j = i; j < count; ++j) {
      double of_pair = *c++;
      for (std::size_t k = j; is_cubic && k < count; ++k) of_pair += *c++ * z_[k];
      of_first += z_[j] * of_pair;
    }
    value += z_[i] * of_first;
  }
  return {.value = value};
}

}  // namespace torsio

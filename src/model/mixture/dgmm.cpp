#include "model/mixture/dgmm.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "torsio/core/error.hpp"

namespace torsio {
namespace {

Dgmm::Parameters checked(Dgmm::Parameters parameters) {
  const LinearClamp& clamp = parameters.clamp;
  const std::size_t dimension = parameters.mixture.dimension();
  if (clamp.slope.size() + 1 != dimension)
    throw Error(
        {.place = "dgmm: clamp.slope",
         .expected = fmt::format("{} values, one per input", dimension > 0 ? dimension - 1 : 0),
         .found = std::to_string(clamp.slope.size())});
  const bool finite = std::isfinite(clamp.intercept) && std::isfinite(clamp.thin_log_density) &&
                      std::isfinite(clamp.thin_log_density_inverse) &&
                      std::all_of(clamp.slope.begin(), clamp.slope.end(),
                                  [](double slope) { return std::isfinite(slope); });
  if (!finite)
    throw Error({.place = "dgmm: clamp", .expected = "finite values", .found = "NaN or infinity"});
  if (!std::isfinite(clamp.width) || clamp.width < 0.0)
    throw Error({.place = "dgmm: clamp.width",
                 .expected = "a finite value that is not negative",
                 .found = fmt::format("{}", clamp.width)});
  return parameters;
}

// `mean` moved into line +- width max(1, p / p_thin).
double clamped(double mean, double line, double width, double log_ratio) noexcept {
  const double limit = width * std::exp(std::clamp(log_ratio, 0.0, 700.0));
  return std::clamp(mean, line - limit, line + limit);
}

// The estimate `given`, limited around the linear model; without density the linear model itself,
// or else `centre`.
Estimate guarded(const Conditional& given, double line, double centre, double width,
                 double thin_log_density) noexcept {
  Estimate estimate{.value = given.mean, .novelty = -given.log_density};
  if (!std::isfinite(given.mean)) {
    estimate.value = std::isfinite(line) ? line : centre;
    estimate.fault = Fault::model_not_finite;
    return estimate;
  }
  if (width > 0.0 && std::isfinite(line))
    estimate.value = clamped(given.mean, line, width, given.log_density - thin_log_density);
  const double moved = given.mean - estimate.value;
  estimate.std_dev = std::sqrt(given.variance + moved * moved);
  return estimate;
}

}  // namespace

Dgmm::Dgmm(Parameters parameters)
    : parameters_(checked(std::move(parameters))),
      forward_(parameters_.mixture, 0),
      inverse_(parameters_.mixture, 1),
      inverse_inputs_(inverse_.input_count()) {}

std::size_t Dgmm::parameter_count() const noexcept {
  const std::size_t d = parameters_.mixture.dimension();
  return parameters_.mixture.size() * (1 + d + d * (d + 1) / 2);
}

Estimate Dgmm::step(Features features) noexcept {
  return estimate_of(forward_.query(features), features);
}

Estimate Dgmm::estimate_of(const Conditional& given, Features features) const noexcept {
  const LinearClamp& clamp = parameters_.clamp;
  double line = clamp.intercept;
  for (std::size_t j = 0; j < features.size(); ++j) line += clamp.slope[j] * features[j];
  return guarded(given, line, parameters_.mixture.centre[0], clamp.width, clamp.thin_log_density);
}

Estimate Dgmm::invert(double target, Features features) noexcept {
  inverse_inputs_[0] = target;
  std::copy(features.begin() + 1, features.end(), inverse_inputs_.begin() + 1);
  const LinearClamp& clamp = parameters_.clamp;
  double rest = target - clamp.intercept;
  for (std::size_t j = 1; j < features.size(); ++j) rest -= clamp.slope[j] * features[j];
  return guarded(inverse_.query(inverse_inputs_), rest / clamp.slope[0],
                 parameters_.mixture.centre[1], clamp.width / std::abs(clamp.slope[0]),
                 clamp.thin_log_density_inverse);
}

}  // namespace torsio

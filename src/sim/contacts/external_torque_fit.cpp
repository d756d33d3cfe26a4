#include "sim/contacts/external_torque_fit.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "core/all_finite.hpp"
#include "torsio/core/error.hpp"

namespace torsio {
namespace {

constexpr std::size_t kFewestSamples = 100;
constexpr int kUpdates = 400;
constexpr double kLeastConstant = 1e-3;  // over the mean square

/// One update of all coefficients; terms are in units of their means.
void update(std::span<const double> squares, std::span<const ExternalTorqueTerms> scaled,
            ExternalTorqueTerms& coefficients) {
  ExternalTorqueTerms rising = {};
  ExternalTorqueTerms falling = {};
  for (std::size_t n = 0; n < squares.size(); ++n) {
    double variance = 0.0;
    for (std::size_t k = 0; k < coefficients.size(); ++k)
      variance += coefficients[k] * scaled[n][k];
    for (std::size_t k = 0; k < coefficients.size(); ++k) {
      const double share = scaled[n][k] / variance;
      falling[k] += share;
      rising[k] += share * squares[n] / variance;
    }
  }
  for (std::size_t k = 0; k < coefficients.size(); ++k)
    if (falling[k] > 0.0) coefficients[k] *= std::sqrt(rising[k] / falling[k]);
}

}  // namespace

ExternalTorqueError fit_external_torque_error(const ExternalTorqueSamples& samples) {
  const std::size_t count = samples.external_Nm.size();
  const bool are_finite = all_finite(samples.external_Nm) &&
                          std::ranges::all_of(samples.terms, [](const ExternalTorqueTerms& terms) {
                            return all_finite(terms);
                          });
  if (count < kFewestSamples || samples.terms.size() != count || !are_finite)
    throw Error({.place = "error bar of the external torque",
                 .expected = fmt::format("at least {} finite samples", kFewestSamples),
                 .found = are_finite ? fmt::format("{}", count) : "values that are not finite"});
  ExternalTorqueTerms scale = {};
  double mean_square = 0.0;
  std::vector<double> squares;
  squares.reserve(count);
  for (std::size_t n = 0; n < count; ++n) {
    squares.push_back(samples.external_Nm[n] * samples.external_Nm[n]);
    mean_square += squares.back() / static_cast<double>(count);
    for (std::size_t k = 0; k < scale.size(); ++k)
      scale[k] += samples.terms[n][k] / static_cast<double>(count);
  }
  // Errors of 0 everywhere have no error bar: the smallest one that divides nothing by 0.
  mean_square = std::max(mean_square, 1e-12);
  std::vector<ExternalTorqueTerms> scaled = samples.terms;
  for (ExternalTorqueTerms& terms : scaled)
    for (std::size_t k = 0; k < scale.size(); ++k)
      terms[k] = scale[k] > 0.0 ? terms[k] / scale[k] : 0.0;
  ExternalTorqueTerms coefficients;
  coefficients.fill(mean_square / static_cast<double>(scale.size()));
  for (int i = 0; i < kUpdates; ++i) {
    update(squares, scaled, coefficients);
    coefficients[0] = std::max(coefficients[0], kLeastConstant * mean_square);
  }
  ExternalTorqueError error;
  for (std::size_t k = 0; k < scale.size(); ++k)
    error.coefficients[k] = scale[k] > 0.0 ? coefficients[k] / scale[k] : 0.0;
  return error;
}

}  // namespace torsio

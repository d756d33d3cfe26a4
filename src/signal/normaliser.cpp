#include "torsio/signal/normaliser.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "signal/fit_normaliser.hpp"
#include "torsio/core/error.hpp"

namespace torsio {
namespace {

constexpr double kRounding = 1e-12;  // share of the mean below which a spread counts as 0

}  // namespace

Normaliser::Normaliser(Parameters parameters) : parameters_(std::move(parameters)) {
  const auto& [centre, scale] = parameters_;
  if (centre.size() != scale.size())
    throw UsageError({.place = "normaliser",
                      .expected = fmt::format("as many scales as centres ({})", centre.size()),
                      .found = fmt::format("{} scales", scale.size())});
  for (std::size_t j = 0; j < scale.size(); ++j) {
    if (!std::isfinite(centre[j]) || !std::isfinite(scale[j]) || scale[j] <= 0.0)
      throw UsageError({.place = fmt::format("normaliser: channel {}", j),
                        .expected = "a finite centre and a positive, finite scale",
                        .found = fmt::format("centre {}, scale {}", centre[j], scale[j])});
  }
}

Normaliser fit_normaliser(const Matrix& data, std::span<const double> scale_floors) {
  if (data.rows == 0)
    throw UsageError({.place = "normaliser", .expected = "samples to fit to", .found = "none"});
  if (!scale_floors.empty() && scale_floors.size() != data.columns)
    throw UsageError({.place = "normaliser",
                      .expected = fmt::format("{} scale floors", data.columns),
                      .found = fmt::format("{}", scale_floors.size())});
  Normaliser::Parameters fitted;
  const auto count = static_cast<double>(data.rows);
  for (std::size_t j = 0; j < data.columns; ++j) {
    double sum = 0.0;
    for (std::size_t i = 0; i < data.rows; ++i) sum += data(i, j);
    const double mean = sum / count;
    double variance = 0.0;
    for (std::size_t i = 0; i < data.rows; ++i) {
      const double deviation = data(i, j) - mean;
      variance += deviation * deviation / count;
    }
    const double floor = scale_floors.empty() ? 0.0 : scale_floors[j];
    const double scale = std::max(std::sqrt(variance), floor);
    // The mean of equal values is not always exactly that value.
    const bool is_constant = scale <= kRounding * std::abs(mean);
    fitted.centre.push_back(mean);
    fitted.scale.push_back(is_constant ? 1.0 : scale);
  }
  return Normaliser(std::move(fitted));
}

}  // namespace torsio

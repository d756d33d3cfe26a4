#include "torsio/signal/normaliser.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "signal/fit_normaliser.hpp"
#include "torsio/core/error.hpp"

namespace torsio {
namespace {

constexpr double kRounding = 1e-12;  // share of the mean below which a spread counts as 0

void check_fit(std::size_t samples, std::size_t channels, std::span<const double> scale_floors) {
  if (samples == 0)
    throw UsageError({.place = "normaliser", .expected = "samples to fit to", .found = "none"});
  if (!scale_floors.empty() && scale_floors.size() != channels)
    throw UsageError({.place = "normaliser",
                      .expected = fmt::format("{} scale floors", channels),
                      .found = fmt::format("{}", scale_floors.size())});
}

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

Normaliser fit_normaliser(std::size_t channels, const EachSample& each_sample,
                          std::span<const double> scale_floors) {
  std::size_t samples = 0;
  std::vector<double> means(channels, 0.0);
  each_sample([&](std::span<const double> sample) {
    ++samples;
    for (std::size_t j = 0; j < channels; ++j) means[j] += sample[j];
  });
  check_fit(samples, channels, scale_floors);
  const auto count = static_cast<double>(samples);
  for (double& mean : means) mean /= count;
  std::vector<double> variances(channels, 0.0);
  each_sample([&](std::span<const double> sample) {
    for (std::size_t j = 0; j < channels; ++j) {
      const double deviation = sample[j] - means[j];
      variances[j] += deviation * deviation / count;
    }
  });
  Normaliser::Parameters fitted{.centre = std::move(means), .scale = {}};
  for (std::size_t j = 0; j < channels; ++j) {
    const double floor = scale_floors.empty() ? 0.0 : scale_floors[j];
    const double scale = std::max(std::sqrt(variances[j]), floor);
    // The mean of equal values is not always exactly that value.
    const bool is_constant = scale <= kRounding * std::abs(fitted.centre[j]);
    fitted.scale.push_back(is_constant ? 1.0 : scale);
  }
  return Normaliser(std::move(fitted));
}

Normaliser fit_normaliser(const Matrix& data, std::span<const double> scale_floors) {
  const auto each_row = [&data](const auto& take) {
    for (std::size_t i = 0; i < data.rows; ++i) take(data.row(i));
  };
  return fit_normaliser(data.columns, each_row, scale_floors);
}

}  // namespace torsio

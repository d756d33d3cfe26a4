#include "torsio/signal/lowpass.hpp"

#include <fmt/format.h>

#include <numbers>

#include "torsio/core/error.hpp"

namespace torsio {
namespace {

double checked_prewarp(double cutoff_Hz, double sample_rate_Hz) {
  if (!(sample_rate_Hz > 0.0) || !std::isfinite(sample_rate_Hz))
    throw UsageError({.place = "low-pass filter",
                      .expected = "a positive sample rate",
                      .found = fmt::format("{} Hz", sample_rate_Hz)});
  const double lowest_Hz = Lowpass::kLowestShare * sample_rate_Hz;
  if (!(cutoff_Hz >= lowest_Hz && cutoff_Hz < 0.5 * sample_rate_Hz))
    throw UsageError(
        {.place = "low-pass filter",
         .expected = fmt::format("a cut-off from {} Hz to below {} Hz, half the sample rate",
                                 lowest_Hz, 0.5 * sample_rate_Hz),
         .found = fmt::format("{} Hz", cutoff_Hz)});
  return std::tan(std::numbers::pi * cutoff_Hz / sample_rate_Hz);
}

double denominator(double g) { return 1.0 + g * (g + std::numbers::sqrt2); }

}  // namespace

Lowpass::Lowpass(double cutoff_Hz, double sample_rate_Hz)
    : prewarped_(checked_prewarp(cutoff_Hz, sample_rate_Hz)),
      band_gain_(1.0 / denominator(prewarped_)),
      low_gain_(prewarped_ * band_gain_),
      high_gain_(prewarped_ * low_gain_) {}

// The poles are p = (1 + q) / (1 - q) with q = g exp(3 pi i / 4), so |p|^2 = 1 - 2 sqrt(2) g / D
// with D = |1 - q|^2; the step response strays from 1 by at most sqrt(2 / D) |p|^n.
std::size_t Lowpass::settling_samples() const noexcept {
  constexpr double kTolerance = 0.01;
  const double d = denominator(prewarped_);
  const double amplitude = std::sqrt(2.0 / d);
  if (amplitude <= kTolerance) return 1;
  const double log_radius = 0.5 * std::log1p(-2.0 * std::numbers::sqrt2 * prewarped_ / d);
  return 1 + static_cast<std::size_t>(std::ceil(std::log(kTolerance / amplitude) / log_radius));
}

// (1/2pi) times the integral of |H|^2 = 1 / (1 + (tan(w/2) / g)^4) over one turn of w.
double Lowpass::noise_gain() const noexcept {
  const double g = prewarped_;
  const double g3 = g * g * g;
  return std::sqrt((g * g3 + (g - g3) / std::numbers::sqrt2) / (1.0 + g * g3));
}

}  // namespace torsio

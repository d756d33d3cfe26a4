#include "torsio/signal/differentiator.hpp"

#include <fmt/format.h>

#include <cmath>

#include "torsio/core/error.hpp"

namespace torsio {

Differentiator::Differentiator(double sample_rate_Hz, std::optional<double> cutoff_Hz)
    : sample_rate_Hz_(sample_rate_Hz) {
  if (!(sample_rate_Hz > 0.0) || !std::isfinite(sample_rate_Hz))
    throw UsageError({.place = "differentiator",
                      .expected = "a positive sample rate",
                      .found = fmt::format("{} Hz", sample_rate_Hz)});
  if (cutoff_Hz) {
    lowpass_.emplace(*cutoff_Hz, sample_rate_Hz);
    settling_samples_ = 1 + lowpass_->settling_samples();
  }
}

}  // namespace torsio

#include "fit/common/excited_band.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <complex>
#include <cstddef>
#include <numbers>
#include <numeric>
#include <unsupported/Eigen/FFT>
#include <vector>

namespace torsio {
namespace {

/// Without its mean, faded in and out, filled up to `length` with zeros.
std::vector<double> windowed(const Sequence& sequence, std::size_t length) {
  std::vector<double> values;
  for (std::size_t n = 0; n < sequence.target.size(); ++n)
    if (std::isfinite(sequence.features(n, 0))) values.push_back(sequence.features(n, 0));
  const auto count = static_cast<double>(std::max<std::size_t>(values.size(), 1));
  const double mean = std::accumulate(values.begin(), values.end(), 0.0) / count;
  for (std::size_t n = 0; n < values.size(); ++n) {
    const double phase = 2.0 * std::numbers::pi * (static_cast<double>(n) + 0.5) / count;
    values[n] = (values[n] - mean) * 0.5 * (1.0 - std::cos(phase));
  }
  values.resize(length, 0.0);
  return values;
}

}  // namespace

ExcitedBand excited_band(const TrainingData& data) {
  std::size_t longest = 2;
  for (const Sequence& sequence : data.sequences)
    longest = std::max(longest, sequence.target.size());
  const std::size_t length = std::bit_ceil(longest);
  std::vector<double> power(length / 2 + 1, 0.0);
  Eigen::FFT<double> fft;
  std::vector<std::complex<double>> spectrum;
  for (const Sequence& sequence : data.sequences) {
    fft.fwd(spectrum, windowed(sequence, length));
    for (std::size_t i = 0; i < power.size(); ++i) power[i] += std::norm(spectrum[i]);
  }
  std::partial_sum(power.begin(), power.end(), power.begin());
  constexpr double kEdge = 0.01;
  const auto frequency_at = [&](double share) {
    const auto at = std::ranges::lower_bound(power, share * power.back());
    return data.sample_rate_Hz * static_cast<double>(at - power.begin()) /
           static_cast<double>(length);
  };
  return {.lowest_Hz = frequency_at(kEdge), .highest_Hz = frequency_at(1.0 - kEdge)};
}

std::string outside_of(const ExcitedBand& band, double rate_1_s) {
  const double frequency_Hz = rate_1_s / (2.0 * std::numbers::pi);
  const bool is_below = frequency_Hz < 0.5 * band.lowest_Hz;
  if (!is_below && frequency_Hz <= 2.0 * band.highest_Hz) return {};
  return fmt::format("{} the {:.2g} to {:.2g} Hz that the records excite, which see only its tail",
                     is_below ? "below" : "above", band.lowest_Hz, band.highest_Hz);
}

}  // namespace torsio

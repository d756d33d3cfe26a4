#pragma once

#include <cmath>
#include <cstddef>

#include "torsio/core/realtime.hpp"
#include "torsio/core/state_bytes.hpp"

namespace torsio {

/// A second-order Butterworth low-pass, causal, one sample at a time:
///
///     H(s) = 1 / ((s/w)^2 + sqrt(2) s/w + 1)
///
/// discretised by the bilinear transform with w prewarped, so that the gain at the cut-off is
/// 1/sqrt(2) at every sample rate. It starts in the steady state of its first input (a constant
/// input gives that constant from the first sample on). Computed as a state-variable filter, whose
/// coefficients do not cancel when the cut-off is far below the sample rate.
///
/// An input that is not finite is returned unchanged and does not change the state: the filter
/// continues at the next finite input as if there had been no sample.
///
/// Cost: 6 multiplications. Source: specification 3.1, guard 3.
class Lowpass {
 public:
  /// The lowest cut-off, as a share of the sample rate.
  static constexpr double kLowestShare = 1e-6;

  /// @throws UsageError unless 1e-6 sample_rate_Hz <= cutoff_Hz < sample_rate_Hz / 2.
  Lowpass(double cutoff_Hz, double sample_rate_Hz);

  void reset() noexcept { is_started_ = false; }

  double step(double input) noexcept TORSIO_REALTIME {
    if (!std::isfinite(input)) return input;
    if (!is_started_) {
      band_ = 0.0;
      low_ = input;
      is_started_ = true;
    }
    const double high = input - low_;
    const double band = band_gain_ * band_ + low_gain_ * high;
    const double low = low_ + low_gain_ * band_ + high_gain_ * high;
    band_ = 2.0 * band - band_;
    low_ = 2.0 * low - low_;
    // Inputs near the largest double overflow the state; it must not stay infinite.
    if (!std::isfinite(band_) || !std::isfinite(low_)) is_started_ = false;
    return low;
  }

  /// Samples from a step of the input on (included) until the output stays within 1 % of it: an
  /// upper bound from the envelope of the step response.
  [[nodiscard]] std::size_t settling_samples() const noexcept;

  /// Standard deviation of the output over that of a white input, in the long run.
  [[nodiscard]] double noise_gain() const noexcept;

  /// The factors of a step.
  struct Gains {
    double band = 0.0;
    double low = 0.0;
    double high = 0.0;
  };
  [[nodiscard]] Gains gains() const noexcept { return {band_gain_, low_gain_, high_gain_}; }

  /// The members that change in a step.
  void visit_state(detail::StateBytes& bytes) noexcept { bytes.visit(band_, low_, is_started_); }

 private:
  double prewarped_;  // g = tan(pi cutoff / rate)
  double band_gain_;
  double low_gain_;
  double high_gain_;
  double band_ = 0.0;
  double low_ = 0.0;
  bool is_started_ = false;
};

}  // namespace torsio

#pragma once

#include <cstddef>
#include <optional>

#include "torsio/core/realtime.hpp"
#include "torsio/core/state_bytes.hpp"
#include "torsio/signal/lowpass.hpp"

namespace torsio {

/// The causal derivative of a sampled signal: the backward difference over one sample
///
///     y[n] = (x[n] - x[n-1]) * sample_rate
///
/// (it lags by half a sample), low-passed if a cut-off is given. The first output is 0, because
/// there is no difference yet. An input that is not finite affects two differences and has no later
/// effect.
class Differentiator {
 public:
  /// @throws UsageError if the sample rate is not positive and finite, or as `Lowpass` does.
  explicit Differentiator(double sample_rate_Hz, std::optional<double> cutoff_Hz = std::nullopt);

  void reset() noexcept {
    seen_ = 0;
    rate_ = 0.0;
    is_skipped_ = false;
    if (lowpass_) lowpass_->reset();
  }

  double step(double input) noexcept TORSIO_REALTIME {
    if (seen_ > 0 && !is_skipped_) rate_ = (input - previous_) * sample_rate_Hz_;
    is_skipped_ = false;
    previous_ = input;
    if (seen_ < settling_samples_) ++seen_;
    return lowpass_ ? lowpass_->step(rate_) : rate_;
  }

  /// For samples that were lost: the next input is not one sample after the last, and keeps the
  /// last difference instead of making a new one.
  void skip() noexcept TORSIO_REALTIME { is_skipped_ = true; }

  /// Samples after `reset()` until the output is the derivative (to 1 % of a step of it): 2 without
  /// low-pass.
  [[nodiscard]] std::size_t settling_samples() const noexcept { return settling_samples_; }

  /// Whether `settling_samples()` steps were made since `reset()`.
  [[nodiscard]] bool is_settled() const noexcept { return seen_ == settling_samples_; }

  /// The members that change in a step.
  void visit_state(detail::StateBytes& bytes) noexcept {
    bytes.visit_at_most(seen_, settling_samples_);
    bytes.visit(previous_, rate_, is_skipped_);
    if (lowpass_) bytes.visit(*lowpass_);
  }

 private:
  double sample_rate_Hz_;
  std::optional<Lowpass> lowpass_;
  std::size_t settling_samples_ = 2;
  std::size_t seen_ = 0;
  double previous_ = 0.0;
  double rate_ = 0.0;  ///< before the low-pass
  bool is_skipped_ = false;
};

}  // namespace torsio

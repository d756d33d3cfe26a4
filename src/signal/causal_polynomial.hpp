#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <vector>

#include "torsio/core/realtime.hpp"
#include "torsio/core/state_bytes.hpp"

namespace torsio {

/// A signal between its last two samples, interpolated from the samples up to now.
///
///     u(t_k - (1 - s) h) = sum_j w_j(s) u_{k-j},   0 <= s <= 1
///
/// w: the polynomial through the last `order` + 1 samples (Lagrange), or through as many as there
/// are. Order 0 holds the sample before the last one, order 1 interpolates linearly, order 3 has an
/// error of at most 1/24 of the fourth power of the angle that a sine turns in one sample, times
/// its amplitude. A sample is used as soon as it is available, without delay.
class CausalPolynomial {
 public:
  static constexpr std::size_t kHighestOrder = 5;

  /// @param places s of the values wanted, ascending
  /// @throws Error if the order is too high, or a place is outside 0..1.
  CausalPolynomial(std::size_t order, std::vector<double> places);

  void reset() noexcept { known_ = 0; }
  /// Takes the next sample. @returns the values at the places before it: all equal to the first.
  std::span<const double> step(double sample) noexcept TORSIO_REALTIME;
  [[nodiscard]] bool is_started() const noexcept { return known_ > 0; }

  /// The members that change in a step.
  void visit_state(detail::StateBytes& bytes) noexcept {
    bytes.visit(samples_);
    bytes.visit_at_most(known_, order_ + 1);
  }

 private:
  /// Weights of a polynomial through `samples` samples: places x samples, the newest first.
  [[nodiscard]] std::vector<double> weights_through(std::size_t samples) const;

  std::size_t order_;
  std::vector<double> places_;
  std::vector<std::vector<double>> weights_;  ///< through 1, 2, .. order + 1 samples
  std::vector<double> values_;
  std::array<double, kHighestOrder + 1> samples_{};  ///< the newest first
  std::size_t known_ = 0;                            ///< samples that have come, at most order + 1
};

}  // namespace torsio

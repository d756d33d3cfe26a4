#pragma once

#include <algorithm>
#include <array>
#include <cstddef>

#include "torsio/core/realtime.hpp"

namespace torsio {

/// A bank of Maxwell-slip elements whose limits grow with the load: dry friction with memory.
///
///     f = f₀ + μ |τ_el|,   Fᵢ ← clip(Fᵢ + wᵢ f Δx / Xᵢ, ± wᵢ f),   F = Σ Fᵢ
///
/// x displacement [rad], Xᵢ break-away displacement [rad], wᵢ share of the force [–]. Fᵢ is clipped
/// after the update, so that a shrinking limit dissipates instead of pushing. Source: specification
/// 4.1 and 4.6.
template <std::size_t Count>
class MaxwellSlip {
 public:
  struct Parameters {
    double constant_Nm = 0.0;                    ///< f₀
    double load_factor = 0.0;                    ///< μ
    std::array<double, Count> share{};           ///< wᵢ
    std::array<double, Count> break_away_rad{};  ///< Xᵢ
  };

  /// @throws Error if a force or factor is negative, or a break-away displacement is not positive.
  explicit MaxwellSlip(const Parameters& parameters);
  [[nodiscard]] const Parameters& parameters() const noexcept { return parameters_; }

  void reset() noexcept {
    force_Nm_.fill(0.0);
    total_limit_Nm_ = parameters_.constant_Nm;
  }

  /// @param increment_rad displacement since the last step
  /// @param load_Nm the torque whose magnitude presses the surfaces together
  /// @returns F [Nm], of the sign of a spring: positive after a positive displacement
  double step(double increment_rad, double /*rate_rad_s*/,
              double load_Nm) noexcept TORSIO_REALTIME {
    total_limit_Nm_ =
        parameters_.constant_Nm + parameters_.load_factor * (load_Nm < 0.0 ? -load_Nm : load_Nm);
    const double pull = total_limit_Nm_ * increment_rad;
    double total_Nm = 0.0;
    for (std::size_t i = 0; i < Count; ++i) {
      const double limit = parameters_.share[i] * total_limit_Nm_;
      force_Nm_[i] = std::min(std::max(force_Nm_[i] + pull * share_per_rad_[i], -limit), limit);
      total_Nm += force_Nm_[i];
    }
    return total_Nm;
  }

  /// Drops the forces to their shares of this total [Nm]; the stiffness stays. A limit that shrinks
  /// so can only turn energy into heat, whatever makes it shrink.
  /// @returns F [Nm]
  double shed(double total_Nm) noexcept TORSIO_REALTIME {
    double sum_Nm = 0.0;
    for (std::size_t i = 0; i < Count; ++i) {
      const double limit = parameters_.share[i] * total_Nm;
      force_Nm_[i] = std::min(std::max(force_Nm_[i], -limit), limit);
      sum_Nm += force_Nm_[i];
    }
    return sum_Nm;
  }

  /// @returns Fᵢ [Nm]
  [[nodiscard]] const std::array<double, Count>& forces() const noexcept { return force_Nm_; }
  /// @returns the energy [J] held in the elements, Σ Fᵢ² / 2kᵢ with kᵢ = wᵢ f / Xᵢ of the last step
  [[nodiscard]] double energy() const noexcept {
    double sum = 0.0;
    for (std::size_t i = 0; i < Count; ++i) {
      const double stiffness = total_limit_Nm_ * share_per_rad_[i];
      if (stiffness > 0.0) sum += 0.5 * force_Nm_[i] * force_Nm_[i] / stiffness;
    }
    return sum;
  }

  /// @returns the stiffness [Nm/rad] while nothing slips, under this load
  [[nodiscard]] double stiffness(double load_Nm) const noexcept;

 private:
  Parameters parameters_;
  std::array<double, Count> share_per_rad_{};
  std::array<double, Count> force_Nm_{};
  double total_limit_Nm_ = 0.0;
};

extern template class MaxwellSlip<1>;
extern template class MaxwellSlip<3>;
extern template class MaxwellSlip<4>;

}  // namespace torsio

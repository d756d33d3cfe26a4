#pragma once

#include <array>
#include <cstddef>

#include "torsio/core/realtime.hpp"

namespace torsio {

/// (1 − e⁻ᵃ) / a, the mean of an exponential decay over a step; 1 at a = 0.
[[nodiscard]] double mean_decay(double a) noexcept;

/// Springs that each relax through a dashpot, side by side: the viscoelastic part of rubber.
///
///     żᵢ = kᵢ u̇ − zᵢ / Tᵢ,   F = Σ zᵢ
///
/// u displacement [rad], kᵢ stiffness [Nm/rad], Tᵢ relaxation time [s]. Solved exactly for a
/// displacement that is linear between two steps. Source: specification 4.3 and 4.4.
template <std::size_t Count>
class MaxwellBranches {
 public:
  struct Parameters {
    std::array<double, Count> stiffness_Nm_rad{};  ///< kᵢ
    std::array<double, Count> relaxation_s{};      ///< Tᵢ
  };

  /// @throws Error if a stiffness is negative or a relaxation time is not positive.
  explicit MaxwellBranches(const Parameters& parameters);

  /// Before the first call nothing relaxes.
  void set_period(double dt_s) noexcept;
  void reset() noexcept { force_Nm_.fill(0.0); }

  /// @param increment_rad displacement since the last step
  /// @returns F [Nm]
  double step(double increment_rad) noexcept TORSIO_REALTIME {
    double sum_Nm = 0.0;
    for (std::size_t i = 0; i < Count; ++i) {
      force_Nm_[i] = decay_[i] * force_Nm_[i] + gain_Nm_rad_[i] * increment_rad;
      sum_Nm += force_Nm_[i];
    }
    return sum_Nm;
  }

  /// @returns zᵢ [Nm]
  [[nodiscard]] const std::array<double, Count>& forces() const noexcept { return force_Nm_; }
  /// @returns the energy [J] held in the springs, Σ zᵢ² / 2kᵢ
  [[nodiscard]] double energy() const noexcept;
  /// @returns Σ kᵢ [Nm/rad]
  [[nodiscard]] double stiffness() const noexcept;

 private:
  Parameters parameters_;
  std::array<double, Count> decay_{};
  std::array<double, Count> gain_Nm_rad_{};
  std::array<double, Count> force_Nm_{};
};

extern template class MaxwellBranches<3>;

}  // namespace torsio

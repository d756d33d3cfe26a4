#pragma once

#include <array>
#include <cstddef>

#include "parts/maxwell_branches.hpp"
#include "torsio/core/realtime.hpp"

namespace torsio {

/// A linear viscoelastic solid in its creep form: a spring in series with three Kelvin-Voigt
/// elements.
///
///     T = k (u − Σ xⱼ),   dⱼ ẋⱼ = T − kⱼ xⱼ
///
/// It is the exact equivalent of a spring k₀ beside three Maxwell branches (kᵢ, pᵢ = 1 / Tᵢ): the
/// zeros −σⱼ of their Z(s) = k₀ + Σ kᵢ s / (s + pᵢ) interlace the poles, k = Z(∞), dⱼ = Z′(−σⱼ),
/// kⱼ = σⱼ dⱼ. Unlike the branches, the creep form has a provable energy balance with a nonlinear
/// output, and can lose and regain contact. u is deflection [rad], xⱼ creep [rad], T torque [Nm].
/// Source: specification 2.1 (a).
class CreepChain {
 public:
  static constexpr std::size_t kElements = 3;
  using Vector = std::array<double, kElements>;  ///< one number per element

  /// @param stiffness_Nm_rad k₀, that of the relaxed chain
  /// @throws Error if a stiffness is not positive or the relaxation times do not fall strictly.
  CreepChain(double stiffness_Nm_rad, const MaxwellBranches<kElements>::Parameters& branches);

  /// Before the first call nothing creeps.
  void set_period(double dt_s) noexcept;

  [[nodiscard]] double torque(const Vector& creep_rad, double deflection_rad) const noexcept {
    return stiffness_ * (deflection_rad - creep_rad[0] - creep_rad[1] - creep_rad[2]);
  }

  /// Creep after a step in contact, exact for a deflection that is linear over it.
  [[nodiscard]] Vector loaded(const Vector& creep_rad, double from_rad,
                              double to_rad) const noexcept TORSIO_REALTIME {
    // In y = x − (what is relaxed at u) the motion is ẏ = A y − relaxed u̇.
    Vector next{};
    for (std::size_t j = 0; j < kElements; ++j) {
      next[j] = relaxed_[j] * to_rad - push_[j] * (to_rad - from_rad);
      for (std::size_t l = 0; l < kElements; ++l)
        next[j] += transition_[j][l] * (creep_rad[l] - relaxed_[l] * from_rad);
    }
    return next;
  }

  /// Creep after a step without load.
  [[nodiscard]] Vector unloaded(const Vector& creep_rad) const noexcept TORSIO_REALTIME {
    return {recovery_[0] * creep_rad[0], recovery_[1] * creep_rad[1], recovery_[2] * creep_rad[2]};
  }

  /// Creep after a long time at a deflection.
  [[nodiscard]] Vector relaxed(double deflection_rad) const noexcept {
    return {relaxed_[0] * deflection_rad, relaxed_[1] * deflection_rad,
            relaxed_[2] * deflection_rad};
  }

  [[nodiscard]] double stiffness() const noexcept { return stiffness_; }                  ///< k
  [[nodiscard]] double relaxed_stiffness() const noexcept { return relaxed_stiffness_; }  ///< k₀
  [[nodiscard]] const Vector& element_stiffness() const noexcept { return spring_; }      ///< kⱼ
  [[nodiscard]] const Vector& element_damping() const noexcept { return damper_; }        ///< dⱼ

  // What `loaded` and `unloaded` work with, for kernels that step many chains at once.
  [[nodiscard]] const std::array<Vector, kElements>& transition() const noexcept {
    return transition_;
  }
  [[nodiscard]] const Vector& push() const noexcept { return push_; }
  [[nodiscard]] const Vector& recovery() const noexcept { return recovery_; }

 private:
  double relaxed_stiffness_;
  double stiffness_;
  Vector pole_{};                               ///< pᵢ [1/s]
  Vector zero_{};                               ///< σⱼ [1/s]
  Vector branch_{};                             ///< kᵢ [Nm/rad]
  Vector spring_{};                             ///< kⱼ [Nm/rad]
  Vector damper_{};                             ///< dⱼ [Nms/rad]
  Vector relaxed_{};                            ///< xⱼ / u at rest
  std::array<Vector, kElements> transition_{};  ///< exp(A dt)
  Vector push_{};                               ///< mean of exp(A t) over dt, times relaxed
  Vector recovery_{};                           ///< exp(−σⱼ dt)
};

}  // namespace torsio

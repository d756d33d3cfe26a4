#pragma once

#include <array>
#include <cstddef>
#include <span>

#include "torsio/arm/arm_dynamics.hpp"
#include "torsio/core/realtime.hpp"

namespace torsio {

/// Springs and dampers at the flange, along the axes of the base:
///
///     F = K (x* − x) − D ẋ,   τ = Jᵀ F + N τ₀ + c + g
///
/// x is the position of the flange and, as a rotation vector, its orientation; τ₀ = K₀ (q* − q) − D₀ q̇ holds a posture as
/// far as the task leaves it free: N = 1 − Jᵀ Λ J M⁻¹, Λ = (J M⁻¹ Jᵀ)⁻¹, makes no acceleration of the flange. J has the
/// rows of the task, those with a stiffness. Hogan (1985); Khatib (1987).
///
/// Near a singular configuration, where some motion of the task needs no finite motion of the joints, Λ is damped
/// (Nakamura & Hanafusa 1986), `manipulability` falls to 0, and from `kSingular` down `is_singular`. F stays bounded there:
/// Jᵀ has no inverse.
class CartesianImpedance {
 public:
  /// Three translations, then three rotations.
  using PerAxis = std::array<double, 6>;
  static constexpr double kSingular = 0.02;

  struct Settings {
    PerAxis stiffness = {};  ///< N/m, Nm/rad; 0: the axis is free
    /// Share of the critical damping of the mass that the flange has along an axis, D = 2 ζ √(K m), m = 1 / (J M⁻¹ Jᵀ)_ii.
    double damping_ratio = 0.7;
    double null_stiffness_Nm_rad = 0.0;
    double null_damping_Nms_rad = 0.0;
    double largest_force_N = 1e9;    ///< limit of each translation's spring
    double largest_moment_Nm = 1e9;  ///< limit of each rotation's spring
  };
  struct Reference {
    ArmFrame flange = {};                    ///< x*
    ArmDynamics::PerJoint posture_rad = {};  ///< q*
  };
  struct Output {
    ArmDynamics::PerJoint torque_Nm = {};  ///< τ
    PerAxis wrench = {};                   ///< F [N, Nm]
    /// The smallest motion of an axis that the axes before it do not have, over the largest motion of one, for equal
    /// speeds of the joints; a rotation is compared with a translation over 0.5 m. 0: singular.
    double manipulability = 1.0;
    bool is_singular = false;
  };

  /// @throws Error if a value is negative or not finite, or no axis has a stiffness.
  explicit CartesianImpedance(const Settings& settings);

  /// Without a memory. What is not finite gives an output that is not finite.
  [[nodiscard]] Output step(const ArmDynamics& dynamics, std::span<const double> angle_rad,
                            std::span<const double> speed_rad_s,
                            const Reference& reference) const noexcept TORSIO_REALTIME;

  [[nodiscard]] const Settings& settings() const noexcept { return settings_; }

 private:
  struct Task;
  void weigh(Task& task, std::size_t joints) const noexcept;
  [[nodiscard]] PerAxis wrench(const Task& task, std::span<const double> speed_rad_s,
                               const ArmFrame& wanted) const noexcept;
  [[nodiscard]] PerAxis cancelling(Task& task, const ArmDynamics::PerJoint& posture_Nm,
                                   std::size_t joints) const noexcept;
  [[nodiscard]] double manipulability(const ArmDynamics::Jacobian& jacobian,
                                      std::size_t joints) const noexcept;

  Settings settings_;
  std::array<std::size_t, 6> rows_ = {};  ///< the axes of the task
  std::size_t count_ = 0;
};

/// @returns the rotation vector [rad] that turns `from` into `to`, in the frame in which both are given; of two turns by
/// half a revolution one
[[nodiscard]] Vector3 rotation_between(const Matrix3& from, const Matrix3& to) noexcept;

}  // namespace torsio

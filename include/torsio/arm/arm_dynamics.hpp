#pragma once

#include <array>
#include <cstddef>
#include <span>

#include "torsio/arm/arm_model.hpp"
#include "torsio/core/realtime.hpp"

namespace torsio {

/// The rigid-body dynamics of a serial arm:
///
///     M(q) q̈ + c(q, q̇) + g(q) = τ + J(q)ᵀ f
///
/// M the mass matrix, c the torques of Coriolis and centrifugal forces, g of gravity, τ the torques at the joints, f force
/// and moment on the flange, J its Jacobian in the frame of the base. Torques by the recursive Newton-Euler algorithm, M
/// by composite bodies, each in frames that turn with the links (Luh, Walker, Paul 1980; Walker, Orin 1982;
/// Featherstone, Rigid Body Dynamics Algorithms, 2008).
///
/// Spans hold one value per joint, in their order. A span that is shorter than the arm is a precondition that nothing
/// checks. What is not finite gives results that are not finite. Every function but the constructor is real-time code:
/// no heap, no exception.
class ArmDynamics {
 public:
  using PerJoint = std::array<double, kMaxArmJoints>;
  /// The first n x n values, row by row.
  using JointMatrix = std::array<double, kMaxArmJoints * kMaxArmJoints>;
  /// The flange's: three rows of the velocity, three of the angular velocity, each of n values.
  using Jacobian = std::array<double, 6 * kMaxArmJoints>;

  /// @throws Error as `require_possible`.
  explicit ArmDynamics(const ArmModel& arm);

  [[nodiscard]] std::size_t size() const noexcept { return count_; }
  [[nodiscard]] const BodyInertia& payload() const noexcept { return payload_; }
  [[nodiscard]] const Vector3& gravity() const noexcept { return gravity_m_s2_; }

  /// From now on the arm carries this, in the frame of the flange.
  /// @returns false, and nothing changes, if its mass is negative, or a value is not finite
  bool set_payload(const BodyInertia& payload) noexcept TORSIO_REALTIME;
  /// @returns false, and nothing changes, if a value is not finite
  bool set_gravity(const Vector3& gravity_m_s2) noexcept TORSIO_REALTIME;

  /// @returns τ = M(q) q̈ + c(q, q̇) + g(q) [Nm]
  void inverse(std::span<const double> angle_rad, std::span<const double> speed_rad_s,
               std::span<const double> acceleration_rad_s2,
               std::span<double> torque_Nm) const noexcept TORSIO_REALTIME;
  /// @returns g(q) [Nm]
  void gravity_torque(std::span<const double> angle_rad,
                      std::span<double> torque_Nm) const noexcept TORSIO_REALTIME;
  /// @returns M(q) [kg m2], n x n row by row
  void mass_matrix(std::span<const double> angle_rad,
                   std::span<double> mass_kg_m2) const noexcept TORSIO_REALTIME;
  /// M and c + g of one state, for which the sines are computed once.
  void equation(std::span<const double> angle_rad, std::span<const double> speed_rad_s,
                std::span<double> mass_kg_m2,
                std::span<double> bias_Nm) const noexcept TORSIO_REALTIME;
  /// @returns q̈ under these torques [rad/s2]
  void forward(std::span<const double> angle_rad, std::span<const double> speed_rad_s,
               std::span<const double> torque_Nm,
               std::span<double> acceleration_rad_s2) const noexcept TORSIO_REALTIME;

  /// The momentum p = M(q) q̇ [Nms], the derivative of the kinetic energy ∂T/∂q [Nm] and g(q) [Nm] of one state, with which
  ///
  ///     ṗ = τ + J(q)ᵀ f + ∂T/∂q − g(q)
  ///
  /// T changes with q_i as the links beyond the joint turn against the motion before it:
  /// ∂T/∂q_i = −(S_i × v_i) · h_i, v_i the spatial velocity of link i, h_i the momentum of all links from i on.
  void momentum(std::span<const double> angle_rad, std::span<const double> speed_rad_s,
                std::span<double> momentum_Nms, std::span<double> energy_gradient_Nm,
                std::span<double> gravity_Nm) const noexcept TORSIO_REALTIME;

  /// @returns the frame of the flange in that of the base
  [[nodiscard]] ArmFrame flange(std::span<const double> angle_rad) const noexcept TORSIO_REALTIME;
  /// @returns the frame of a link in that of the base
  [[nodiscard]] ArmFrame link(std::size_t joint,
                              std::span<const double> angle_rad) const noexcept TORSIO_REALTIME;
  /// J, 6 x n row by row.
  /// @returns the frame of the flange in that of the base
  ArmFrame jacobian(std::span<const double> angle_rad,
                    std::span<double> jacobian) const noexcept TORSIO_REALTIME;

  [[nodiscard]] double kinetic_energy(std::span<const double> angle_rad,
                                      std::span<const double> speed_rad_s) const noexcept
      TORSIO_REALTIME;  ///< [J]
  /// The energy of the masses under gravity, 0 where all of them are at the origin of the base [J].
  [[nodiscard]] double potential_energy(std::span<const double> angle_rad) const noexcept
      TORSIO_REALTIME;

 private:
  /// A joint in frames whose z axis is the joint's.
  struct Link {
    ArmFrame origin;                           ///< at angle 0 in that of the previous link
    BodyInertia body;                          ///< with the payload, if it is the last
    Vector3 moment_kg_m = {};                  ///< mass times centre of mass
    std::array<double, 6> inertia_kg_m2 = {};  ///< about the origin of the frame
  };
  struct Turned;
  static void set_body(Link& link, const BodyInertia& body) noexcept;
  void place(std::span<const double> angle_rad, Turned& at) const noexcept;
  /// Without its terms of motion, of acceleration, or of both.
  template <bool kMoves, bool kAccelerates>
  void newton_euler(const Turned& at, const double* speed_rad_s, const double* acceleration_rad_s2,
                    double* torque_Nm) const noexcept;
  void composite(const Turned& at, double* mass_kg_m2) const noexcept;
  [[nodiscard]] ArmFrame outwards(std::size_t joint,
                                  std::span<const double> angle_rad) const noexcept;
  void load_last() noexcept;

  std::size_t count_ = 0;
  std::array<Link, kMaxArmJoints> links_;
  BodyInertia last_body_;  ///< the last link without the payload
  ArmFrame flange_;        ///< in the frame of the last link
  std::array<Matrix3, kMaxArmJoints>
      to_joint_;  ///< from a link's frame here to the joint's of the model
  BodyInertia payload_;
  Vector3 gravity_m_s2_;
};

/// Factorises a symmetric positive definite A of n x n in place: A = L D Lᵀ, L below the diagonal, 1/D on it.
/// @returns false, and the matrix is NaN, if A is not positive definite
bool factor_positive(std::span<double> matrix, std::size_t n) noexcept TORSIO_REALTIME;
/// Solves A x = b in place of b, A from `factor_positive`.
void solve_factored(std::span<const double> factor, std::span<double> x) noexcept TORSIO_REALTIME;
/// Both; x is NaN if A is not positive definite.
bool solve_positive(std::span<double> matrix, std::span<double> x) noexcept TORSIO_REALTIME;

}  // namespace torsio

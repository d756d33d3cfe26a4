#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <vector>

#include "torsio/arm/arm_dynamics.hpp"
#include "torsio/core/realtime.hpp"

namespace torsio {

/// The number of parts that the variance of an external torque has.
inline constexpr std::size_t kExternalTorqueTerms = 4;
/// What the parts of the variance grow with, at one joint and one instant.
using ExternalTorqueTerms = std::array<double, kExternalTorqueTerms>;

/// The error bar of the external torque at a joint, one standard deviation:
///
///     σ_i² = a + b |row i of M(q)|² + c ⌈τ*_i²⌉ + d ⌈(M(q) q̈*)_i²⌉,   a, b, c, d ≥ 0
///     τ* = M(q) q̈* + c(q, q̇) + g(q),   ⌈x⌉ = max(x, ⌈x before⌉ e^(−Δt / 0.2 s))
///
/// a: what is always there [Nm²]. b: noise of the encoders' differences, which the observer multiplies with the mass
/// matrix [1/s⁴]. c: the error of the spring's torque, as a share of it, squared. d: the error of masses and of the
/// delay, likewise. ⌈x⌉ fades, since the links still swing on their springs after an acceleration has ended. q̈* and τ*
/// are those of the wanted motion, not the measured ones: a contact must not widen the error bar with which it is compared.
struct ExternalTorqueError {
  ExternalTorqueTerms coefficients = {1.0, 0.0, 0.0, 0.0};  ///< a, b, c, d

  /// @returns σ² [Nm²]
  [[nodiscard]] double variance(const ExternalTorqueTerms& terms) const noexcept {
    double sum = 0.0;
    for (std::size_t k = 0; k < terms.size(); ++k) sum += coefficients[k] * terms[k];
    return sum;
  }
};

/// The terms of every joint in a motion: 1, |row i of M|², ⌈τ*_i²⌉, ⌈(M q̈*)_i²⌉.
class ExternalTorqueMotion {
 public:
  /// @throws Error if the sample rate is not positive.
  explicit ExternalTorqueMotion(double sample_rate_Hz);

  /// @param acceleration_rad_s2 q̈*, wanted; 0 where none is
  /// @returns one per joint of the arm, valid until the next call
  std::span<const ExternalTorqueTerms> step(
      const ArmDynamics& dynamics, std::span<const double> angle_rad,
      std::span<const double> speed_rad_s,
      std::span<const double> acceleration_rad_s2) noexcept TORSIO_REALTIME;

 private:
  double kept_;  ///< share of a term after one tick
  std::array<ExternalTorqueTerms, kMaxArmJoints> terms_ = {};
};

/// Finds contacts of an arm: the external torque of a joint is more than k_i of its standard deviations,
///
///     |τ_ext,i| > k_i σ_i
///
/// with σ_i and k_i learned from motion without contacts (`learn_contacts`) for a rate of false alarms. What the arm
/// carries must be that of the learning, or be set in its dynamics: a mass that is not in the model is an external torque.
class ContactDetector {
 public:
  struct Joint {
    ExternalTorqueError error = {};
    double factor = 0.0;  ///< k
  };
  struct Settings {
    std::vector<Joint> joints = {};
    /// After a start or a stop the observer settles, and nothing is a contact.
    double settling_s = 0.5;
  };
  struct Output {
    ArmDynamics::PerJoint std_dev_Nm = {};  ///< σ
    double largest_share = 0.0;  ///< largest |τ_ext,i| / (k_i σ_i): above 1 in a contact
    std::size_t joint = 0;       ///< which one that is
    bool is_contact = false;
  };

  /// @throws Error that names the joint if there are none or more than `kMaxArmJoints`, a coefficient is negative or not
  /// finite, all of a joint's are 0, or a factor is not positive.
  ContactDetector(const Settings& settings, double sample_rate_Hz);

  /// From now on as after the start.
  void reset() noexcept TORSIO_REALTIME { since_ticks_ = 0; }

  /// As `ExternalTorqueMotion`. @param external_Nm of the `MomentumObserver`
  /// What is not finite is not a contact.
  const Output& step(const ArmDynamics& dynamics, std::span<const double> angle_rad,
                     std::span<const double> speed_rad_s,
                     std::span<const double> acceleration_rad_s2,
                     std::span<const double> external_Nm) noexcept TORSIO_REALTIME;

  [[nodiscard]] std::size_t size() const noexcept { return count_; }

 private:
  std::array<Joint, kMaxArmJoints> joints_ = {};
  std::size_t count_;
  std::size_t settling_ticks_;
  std::size_t since_ticks_ = 0;
  ExternalTorqueMotion motion_;
  Output output_;
};

}  // namespace torsio

#pragma once

#include <cstdint>
#include <span>
#include <string_view>

#include "torsio/arm/arm_dynamics.hpp"
#include "torsio/core/realtime.hpp"

namespace torsio {

/// What an arm does after a contact.
enum class ContactReaction : std::uint8_t {
  none,      ///< it is reported
  stop,      ///< a stop of all joints (`ArmStopCause::contact`), until `ArmController::release`
  hold,      ///< it comes to rest and holds, until `ArmController::end_reaction`
  retract,   ///< it moves away from the contact a little and holds, likewise
  floating,  ///< it yields to every force as in hand guiding, likewise; written "float"
};

/// The word for a reaction in programs and flags: none, stop, hold, retract, float.
[[nodiscard]] std::string_view name(ContactReaction reaction) noexcept;

/// The motion of the joints from a contact to rest:
///
///     q̇*(t) = u + (q̇₀ − u) exp(−t / T) for t < t_r,   then q̇* decays with the same T
///
/// with u = 0 for a hold. For a retreat u is along (M(q) + B)⁻¹ τ_ext, B the rotors' inertias at the joints: the way in which
/// the contact's force pushes the arm, so that the point of contact moves away from what it touches; its length is that at
/// which the flange moves at `retreat_speed_m_s`, within the speeds of the joints.
class ReactionMotion {
 public:
  struct Settings {
    double time_constant_s = 0.025;  ///< T
    double retreat_speed_m_s = 0.25;
    double retreat_m = 0.04;  ///< way of the flange
  };
  struct Output {
    ArmDynamics::PerJoint position_rad = {};
    ArmDynamics::PerJoint velocity_rad_s = {};
    ArmDynamics::PerJoint acceleration_rad_s2 = {};
  };

  /// @throws Error if a value is not positive.
  ReactionMotion(const Settings& settings, double sample_rate_Hz);

  /// @param rotor_kg_m2 B, one per joint
  /// @param speed_limit_rad_s one per joint
  void begin(const ArmDynamics& dynamics, std::span<const double> position_rad,
             std::span<const double> velocity_rad_s, std::span<const double> external_Nm,
             std::span<const double> rotor_kg_m2, std::span<const double> speed_limit_rad_s,
             bool is_retreat) noexcept TORSIO_REALTIME;
  const Output& step() noexcept TORSIO_REALTIME;

 private:
  void find_retreat(const ArmDynamics& dynamics, std::span<const double> external_Nm,
                    std::span<const double> rotor_kg_m2,
                    std::span<const double> speed_limit_rad_s) noexcept;

  Settings settings_;
  double period_s_;
  double decay_;  ///< exp(−dt / T)
  double time_s_ = 0.0;
  double retreat_s_ = 0.0;                    ///< t_r
  ArmDynamics::PerJoint retreat_rad_s_ = {};  ///< u
  Output output_;
};

}  // namespace torsio

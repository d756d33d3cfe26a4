#pragma once

#include "parts/friction.hpp"
#include "torsio/core/realtime.hpp"

namespace torsio {

/// A holding brake on the rotor that springs close and a coil opens.
///
/// The coil opens the brake when its voltage has been at least the activation voltage for the
/// release delay; the springs close it when the voltage has been below for the engagement delay.
/// A closed brake is dry friction with a bristle (`LuGreFriction`): it holds up to the static torque
/// and slides with the sliding one. Opening it loses the energy of the bristle.
class Brake {
 public:
  struct Parameters {
    double static_Nm = 0.0;
    double sliding_Nm = 0.0;
    double bristle_rad = 1.0;     ///< break-away angle
    double stribeck_rad_s = 1.0;  ///< from static to sliding
    double activation_V = 0.0;
    double engage_s = 0.0;
    double release_s = 0.0;
  };

  /// Closed. @throws Error if a torque, an angle or a speed is not positive, the static torque is
  /// below the sliding one, or a delay is negative.
  explicit Brake(const Parameters& parameters);
  [[nodiscard]] const Parameters& parameters() const noexcept { return parameters_; }

  /// Closed (open), for longer than its delays.
  void reset(bool is_closed) noexcept;

  /// @returns the torque against the rotor [Nm]; a voltage that is not finite is none
  double step(double coil_V, double speed_rad_s, double dt_s) noexcept TORSIO_REALTIME;

  [[nodiscard]] bool is_closed() const noexcept { return is_closed_; }
  /// @returns the energy [J] held in the bristle
  [[nodiscard]] double energy() const noexcept { return is_closed_ ? friction_.energy() : 0.0; }
  [[nodiscard]] double steepest() const noexcept { return friction_.steepest(); }

 private:
  Parameters parameters_;
  LuGreFriction friction_;
  bool is_closed_ = true;
  double pending_s_ = 0.0;  ///< how long the coil has asked for the other state
};

}  // namespace torsio

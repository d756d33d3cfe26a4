#pragma once

#include <limits>

#include "torsio/control/deflection_controller.hpp"
#include "torsio/control/pid.hpp"
#include "torsio/core/estimate.hpp"
#include "torsio/core/realtime.hpp"

namespace torsio {

struct ControllerListing;

/// A spring and a damper at the joint, as the reference of a `TorqueController`:
///
///     τ* = K (q* − q) + D (q̇* − q̇) + τ_ff,   then limited in size and rate
///
/// Source: Hogan, Impedance control (1985). The largest stiffness: `passive_stiffness`.
class JointImpedance {
 public:
  struct Gains {
    double stiffness_Nm_rad = 0.0;
    double damping_Nms_rad = 0.0;
  };
  struct Settings {
    Gains gains = {};
    double torque_Nm = std::numeric_limits<double>::infinity();         ///< limit of τ*
    double torque_rate_Nm_s = std::numeric_limits<double>::infinity();  ///< limit of τ̇*
    double transfer_s = 0.1;
    double fault_decay_s = 0.02;  ///< decay of the torque without a usable measurement
  };
  struct Reference {
    double angle_rad = 0.0;
    double speed_rad_s = 0.0;
    double torque_Nm = 0.0;  ///< τ_ff
  };
  struct State {
    double angle_rad = kNotMeasured;
    double speed_rad_s = kNotMeasured;
  };
  struct Output {
    double torque_Nm = 0.0;
    double spring_Nm = 0.0;
    double damper_Nm = 0.0;
    double feed_forward_Nm = 0.0;
    double transfer_Nm = 0.0;
    bool is_limited = false;
    Fault fault = Fault::none;
  };

  /// @throws Error if a gain is negative or not finite, or a limit or time not positive.
  JointImpedance(const Settings& settings, double sample_rate_Hz);

  void reset() noexcept;

  /// A reference that is not finite is a fault, and the last finite one is used (none yet: no
  /// torque). A measurement that is not finite is a fault too: the torque fades to 0 and continues
  /// from there.
  Output step(const Reference& wanted, const State& measured) noexcept TORSIO_REALTIME;

  /// Both at once, from the next step on, without a jump: the change that they would cause at the
  /// last step's errors fades in (`BumplessTransfer`), so that gains may also change in every tick.
  /// @returns false, and both stay, if one is negative or not finite
  [[nodiscard]] bool set_gains(const Gains& gains) noexcept TORSIO_REALTIME;
  [[nodiscard]] const Gains& gains() const noexcept { return gains_; }
  /// Fills its own part.
  void list(ControllerListing& listing) const noexcept;

 private:
  Output fade() noexcept;

  Gains gains_;
  double max_Nm_;
  double step_Nm_;
  double fault_keep_;
  detail::BumplessTransfer transfer_;
  Reference wanted_;
  double position_error_rad_ = 0.0;  ///< at the last step
  double speed_error_rad_s_ = 0.0;   ///< at the last step
  bool has_reference_ = false;
  bool is_returning_ = false;  ///< from a fault
  double torque_Nm_ = 0.0;
};

/// The largest stiffness [Nm/rad] of an impedance on deflection control, with this damping, for
/// which the joint is passive up to the frequency and stable with its output free; 0 if it is not
/// even without stiffness. Searched from below in steps of 5 %, up to ten times the spring.
[[nodiscard]] double passive_stiffness(const DeflectionController& controller,
                                       double damping_Nms_rad, double passive_to_rad_s,
                                       double speed_cutoff_Hz);

}  // namespace torsio

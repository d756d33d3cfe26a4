#pragma once

#include <complex>
#include <optional>

#include "torsio/control/design/series_elastic_joint.hpp"
#include "torsio/control/pid.hpp"
#include "torsio/core/fault.hpp"
#include "torsio/core/realtime.hpp"
#include "torsio/core/units.hpp"
#include "torsio/signal/differentiator.hpp"

namespace torsio {

struct ControllerListing;

/// Turns the spring of a series-elastic actuator to a wanted deflection, by the motor's current:
///
///     i = K_p (δ* − δ) + K_i ∫(δ* − δ) − K_d δ̇ + K δ* / (N k_t)
///     K_p = (J N² ω² − K) / (N k_t),   K_d = 2 ζ ω J N² / (N k_t),   K_i = k_i K_p
///
/// (the poles of the locked joint get frequency ω and damping ζ), or by the speed of a drive that has
/// a loop of its own for that:
///
///     θ̇* = ω (δ* − δ) + D[δ*]
///
/// δ̇ is low-passed; the current stays within the peak, the integral by the scheme of `Pid`. Source:
/// specification 3.11.
class DeflectionController {
 public:
  enum class Actuation { current, velocity };

  struct Settings {
    SeriesElasticJoint joint = {};
    Actuation actuation = Actuation::current;
    double bandwidth_rad_s = 50.0;                   ///< ω
    double damping = 0.9;                            ///< ζ
    double integral_1_s = 6.0;                       ///< k_i; current only
    std::optional<Pid::Gains> gains = std::nullopt;  ///< none: as above
    Pid::Gains speed_loop = {};  ///< the drive's loop [A s/rad], for the margins; velocity only
    double rate_cutoff_Hz = 120.0;
    double largest_deflection_rad = rad_from_deg(9.0);  ///< δ* is cut there
    Pid::AntiWindup anti_windup = Pid::AntiWindup::conditional;
    double fault_decay_s = 0.02;  ///< decay of the command without a usable measurement
  };

  struct Output {
    double command = 0.0;                ///< motor current [A], or motor-side speed [rad/s]
    double wanted_deflection_rad = 0.0;  ///< after its limit
    double proportional = 0.0;
    double integral = 0.0;
    double derivative = 0.0;
    double feed_forward = 0.0;
    double transfer = 0.0;    ///< after a change of gains or a fault
    bool is_limited = false;  ///< the deflection or the command was cut
    bool is_fading = false;   ///< no usable measurement
    Fault fault = Fault::none;
  };

  /// @throws Error if the joint is impossible, a setting out of range, the spring alone faster than
  /// the bandwidth, or the loop unstable with its output locked or free (with the margin).
  DeflectionController(const Settings& settings, double sample_rate_Hz);

  void reset() noexcept;

  /// A wanted deflection that is not finite is a fault, and the last finite one is used. A
  /// measurement that is not finite is a fault too: the command fades to 0, and continues from
  /// there when measurements return.
  Output step(double wanted_rad, double deflection_rad) noexcept TORSIO_REALTIME;
  /// As `Pid::track`: what was applied in the place of the last command.
  void track(double applied) noexcept TORSIO_REALTIME { pid_.track(applied); }
  /// The command applied in place of the last one fades by one tick, and the loop continues from
  /// there: for a controller that adds to the command and whose own measurement is lost.
  /// @returns the command
  double fade(double applied) noexcept TORSIO_REALTIME;

  /// As `Pid::set_gains`. Does not check whether the new gains are stable: use `margins_of`.
  [[nodiscard]] bool set_gains(const Pid::Gains& gains) noexcept TORSIO_REALTIME {
    return pid_.set_gains(gains);
  }
  [[nodiscard]] const Pid::Gains& gains() const noexcept { return pid_.gains(); }
  [[nodiscard]] const Settings& settings() const noexcept { return settings_; }

  /// The feedback of the loop with these gains. Allocates.
  [[nodiscard]] JointFeedback feedback(const Pid::Gains& gains) const;
  [[nodiscard]] JointFeedback feedback() const { return feedback(gains()); }
  /// The system from the wanted deflection to the current, within the limits. Allocates.
  [[nodiscard]] LinearSystem reference_path() const;
  /// Margins of the loop with these gains, opened at the current. Allocates.
  [[nodiscard]] Margins margins_of(const Pid::Gains& gains, JointOutput output) const;

  /// From the wanted to the actual deflection with the output locked, within the limits, below the
  /// Nyquist frequency; H and C as in `impedance`, R the reference path:
  ///
  ///     δ / δ* = H R / (J N² s² + b s + K + H (C_δ + s C_θ̇))
  [[nodiscard]] std::complex<double> tracking(double rad_s) const;
  /// The lowest frequency [rad/s] at which `tracking` is 3 dB below 1; below ω for a damping above 0.71.
  [[nodiscard]] double cutoff_rad_s() const;

  [[nodiscard]] static Pid::Gains gains_for(const Settings& settings);
  /// Fills its own part.
  void list(ControllerListing& listing) const noexcept;

 private:
  void check_stability() const;

  Settings settings_;
  double sample_rate_Hz_;
  double feed_forward_A_rad_;  ///< 0 if it acts on velocity
  double fault_keep_;
  Pid pid_;
  Differentiator wanted_rate_;
  double wanted_rad_ = 0.0;
};

}  // namespace torsio

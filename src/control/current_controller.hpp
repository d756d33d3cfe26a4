#pragma once

#include <cmath>
#include <numbers>

#include "torsio/control/design/drive.hpp"
#include "torsio/core/fault.hpp"
#include "torsio/core/realtime.hpp"

namespace torsio {

/// One quantity of the three phases of a motor; in a motor without a neutral wire the currents add
/// up to zero.
struct ThreePhase {
  double a = 0.0;
  double b = 0.0;
  double c = 0.0;
};

/// The same quantity in axes that turn with the rotor: d along its flux, q a quarter of an
/// electrical turn ahead. Its magnitude is the amplitude of the phases.
struct DirectQuadrature {
  double d = 0.0;
  double q = 0.0;
};

/// The electrical angle of the rotor, as its sine and cosine.
struct ElectricalAngle {
  double sine = 0.0;
  double cosine = 1.0;

  [[nodiscard]] static ElectricalAngle of(double angle_rad) noexcept {
    return {std::sin(angle_rad), std::cos(angle_rad)};
  }

  /// The angle plus this one. A small one, as of a period, is added by a series (error below 1e-10).
  [[nodiscard]] ElectricalAngle turned_by(double angle_rad) const noexcept TORSIO_REALTIME {
    const ElectricalAngle by = std::abs(angle_rad) < 0.3 ? of_small(angle_rad) : of(angle_rad);
    return {sine * by.cosine + cosine * by.sine, cosine * by.cosine - sine * by.sine};
  }

 private:
  /// Taylor series to the seventh and eighth power.
  [[nodiscard]] static ElectricalAngle of_small(double x) noexcept {
    const double y = x * x;
    return {x * (1.0 + y * (-1.0 / 6.0 + y * (1.0 / 120.0 - y * (1.0 / 5040.0)))),
            1.0 + y * (-0.5 + y * (1.0 / 24.0 + y * (-1.0 / 720.0 + y * (1.0 / 40320.0))))};
  }
};

/// d + j q = 2/3 (a + b e^{j 2π/3} + c e^{−j 2π/3}) e^{−j θ} (Clarke and Park, amplitude-invariant).
[[nodiscard]] inline DirectQuadrature rotor_axes(const ThreePhase& phases,
                                                 ElectricalAngle angle) noexcept TORSIO_REALTIME {
  const double alpha = (2.0 * phases.a - phases.b - phases.c) / 3.0;
  const double beta = (phases.b - phases.c) * std::numbers::inv_sqrt3;
  return {alpha * angle.cosine + beta * angle.sine, beta * angle.cosine - alpha * angle.sine};
}

/// The inverse of `rotor_axes` for phases that add up to zero.
[[nodiscard]] inline ThreePhase phases_of(const DirectQuadrature& axes,
                                          ElectricalAngle angle) noexcept TORSIO_REALTIME {
  const double alpha = axes.d * angle.cosine - axes.q * angle.sine;
  const double beta = axes.d * angle.sine + axes.q * angle.cosine;
  const double half = -0.5 * alpha;
  const double side = 0.5 * std::numbers::sqrt3 * beta;
  return {alpha, half + side, half - side};
}

/// The windings of a brushless motor with sinusoidal back-EMF and equal inductance in both axes.
///
///     v_d = R i_d + L di_d/dt − ω_e L i_q
///     v_q = R i_q + L di_q/dt + ω_e L i_d + ω_e ψ,   ω_e = p ω,   τ = 3/2 p ψ i_q = k_t i_q
///
/// Source: standard (Leonhard, Control of Electrical Drives, 2001, chapter 10).
struct Windings {
  double resistance_Ohm = 0.0;        ///< R, of a phase
  double inductance_H = 0.0;          ///< L, of a phase
  double torque_constant_Nm_A = 0.0;  ///< k_t, torque at the rotor per amplitude of the phases
  int pole_pairs = 1;                 ///< p

  /// @returns ψ [Vs]
  [[nodiscard]] double flux_Vs() const noexcept {
    return torque_constant_Nm_A / (1.5 * pole_pairs);
  }
  /// @throws Error if a value is not positive and finite, or there are more than 100 pole pairs.
  void check() const;
};

/// The resistance of a phase over that of a `Drive`, which is the resistance of an equivalent motor with one
/// winding and the same copper loss: 3/2 R_phase i² = R i².
inline constexpr double kPhaseResistanceShare = 2.0 / 3.0;

/// The windings that have the torque constant of a drive and its copper loss R i² at standstill.
/// @throws Error if a value is not positive.
[[nodiscard]] Windings windings_of(const Drive& drive, double inductance_H, int pole_pairs);

/// Field-oriented current control: PI control of both axes with decoupling, one step in each period
/// T of the pulse-width modulation. It controls the torque of a motor, k_t i_q.
///
///     v_d = ω_c L e_d + I_d − ω_e L i_q,   v_q = ω_c L e_q + I_q + ω_e (L i_d + ψ),   İ = ω_c R e
///
/// The zero of each PI controller cancels the pole R / L, so that a current follows its reference
/// with the time constant 1 / ω_c, in addition to the delay of 3/2 T: the voltage of a step is
/// applied in the next period, until whose middle the rotor turns on by 3/2 ω_e T. The voltage is
/// limited to U / √3, the largest amplitude of a sinusoidal phase voltage with common-mode injection.
/// Its direction remains: beyond the speed at which the back-EMF reaches the limit, i_d becomes
/// negative and weakens the field, whereas a limit of v_q alone would let a braking current grow
/// without control. The integrals receive what was cut (back calculation with the time of the PI
/// controller).
///
/// Paper 000 has "FPGA-based joint control" with phase currents, paper 001 prints a modulation of
/// 30 kHz; none prints the current controller. The equations are standard (Leonhard, Control of
/// Electrical Drives, 2001, chapter 12); limits and the behaviour with unusable measurements
/// (`step`) are ours.
class CurrentController {
 public:
  struct Settings {
    Windings windings = {};
    double bandwidth_rad_s = 2000.0;  ///< ω_c
    double peak_current_A = 0.0;      ///< limit of the amplitude of the reference
    /// A measured amplitude above this switches off until `reset`; it must exceed the peak current.
    double trip_current_A = 0.0;
  };

  struct Measurement {
    ThreePhase phases_A = {};
    double angle_rad = 0.0;    ///< electrical, p times that of the rotor
    double speed_rad_s = 0.0;  ///< electrical
    double supply_V = 0.0;
  };

  struct Output {
    ThreePhase duties = {0.5, 0.5, 0.5};  ///< share of the period in which the upper switch is on
    bool is_on = false;                   ///< false: all switches are to be opened
    bool is_tripped = false;              ///< a current was above `trip_current_A`
    bool is_limited = false;              ///< reference or voltage
    DirectQuadrature current_A = {};      ///< measured
    DirectQuadrature voltage_V = {};      ///< after the limit
    Fault fault = Fault::none;
  };

  /// @throws Error if a setting is not positive and finite, the trip current does not exceed the
  /// peak current, or the bandwidth leaves a phase margin below 45 degrees with the delay of 3/2 T.
  CurrentController(const Settings& settings, double pwm_Hz);

  /// Integrals and trip are cleared.
  void reset() noexcept;
  /// The same, with the integrals that hold this current at standstill.
  void start(const DirectQuadrature& current_A) noexcept;

  /// A measurement or supply that cannot be used (not finite, supply not positive) is
  /// `Fault::input_not_finite`: the last voltage is held for `kHeldPeriods` periods, then the
  /// switches are opened and the integrals cleared. A reference that is not finite is the same fault;
  /// the last valid one remains in use.
  Output step(const DirectQuadrature& reference_A,
              const Measurement& measured) noexcept TORSIO_REALTIME;

  static constexpr int kHeldPeriods = 10;

 private:
  void hold(Output& output) noexcept;

  Settings settings_;
  double period_s_;
  double proportional_V_A_;  ///< ω_c L
  double integral_V_A_;      ///< ω_c R T
  double tracking_;          ///< T R / L: share of a cut voltage that the integral receives
  double inductance_H_;
  double flux_Vs_;
  DirectQuadrature reference_A_;
  DirectQuadrature integral_V_;
  // The last voltage, and what is needed to apply it again.
  DirectQuadrature voltage_V_;
  double angle_rad_ = 0.0;
  double speed_rad_s_ = 0.0;
  double supply_V_ = 0.0;
  int missed_ = 0;
  bool is_tripped_ = false;
};

}  // namespace torsio

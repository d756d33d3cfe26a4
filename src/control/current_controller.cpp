#include "control/current_controller.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/checks.hpp"

namespace torsio {
namespace {

constexpr auto kPlace = "current controller";
constexpr double kDelayPeriods = 1.5;
/// Measurements that lead to a voltage above this multiple of the possible one are not real.
constexpr double kAbsurd = 10.0;
constexpr double kLeastPhaseMargin_rad = std::numbers::pi / 4.0;

bool is_finite(const DirectQuadrature& axes) noexcept {
  return std::isfinite(axes.d) && std::isfinite(axes.q);
}

bool is_usable(const CurrentController::Measurement& measured) noexcept {
  const ThreePhase& phases = measured.phases_A;
  return std::isfinite(phases.a) && std::isfinite(phases.b) && std::isfinite(phases.c) &&
         std::isfinite(measured.angle_rad) && std::isfinite(measured.speed_rad_s) &&
         std::isfinite(measured.supply_V) && measured.supply_V > 0.0;
}

double square_of(const DirectQuadrature& axes) noexcept {
  return axes.d * axes.d + axes.q * axes.q;
}

/// Shortens a vector to `longest`; its direction remains.
DirectQuadrature limited(DirectQuadrature axes, double longest) noexcept {
  const double square = square_of(axes);
  if (square <= longest * longest) return axes;
  const double share = longest / std::sqrt(square);
  return {axes.d * share, axes.q * share};
}

// The common-mode voltage that centres the phases between the rails leaves the largest amplitude.
ThreePhase duties_of(const DirectQuadrature& voltage_V, ElectricalAngle angle,
                     double supply_V) noexcept {
  const ThreePhase phases = phases_of(voltage_V, angle);
  const double common =
      0.5 * (std::max({phases.a, phases.b, phases.c}) + std::min({phases.a, phases.b, phases.c}));
  const double per_volt = 1.0 / supply_V;
  const auto duty = [&](double phase) {
    return std::clamp(0.5 + (phase - common) * per_volt, 0.0, 1.0);
  };
  return {duty(phases.a), duty(phases.b), duty(phases.c)};
}

}  // namespace

void Windings::check() const {
  constexpr auto kWindings = "windings";
  require_positive(kWindings, "resistance_Ohm", resistance_Ohm);
  require_positive(kWindings, "inductance_H", inductance_H);
  require_positive(kWindings, "torque_constant_Nm_A", torque_constant_Nm_A);
  require_parameter(pole_pairs >= 1 && pole_pairs <= 100, kWindings, "pole_pairs from 1 to 100",
                    pole_pairs);
}

Windings windings_of(const Drive& drive, double inductance_H, int pole_pairs) {
  const Windings windings{.resistance_Ohm = kPhaseResistanceShare * drive.resistance_Ohm,
                          .inductance_H = inductance_H,
                          .torque_constant_Nm_A = drive.torque_constant_Nm_A,
                          .pole_pairs = pole_pairs};
  windings.check();
  return windings;
}

CurrentController::CurrentController(const Settings& settings, double pwm_Hz)
    : settings_(settings) {
  settings.windings.check();
  require_positive(kPlace, "pwm_Hz", pwm_Hz);
  require_positive(kPlace, "bandwidth_rad_s", settings.bandwidth_rad_s);
  require_positive(kPlace, "peak_current_A", settings.peak_current_A);
  require_parameter(
      settings.trip_current_A > settings.peak_current_A && std::isfinite(settings.trip_current_A),
      kPlace, fmt::format("a trip current above the peak of {} A", settings.peak_current_A),
      settings.trip_current_A);
  period_s_ = 1.0 / pwm_Hz;
  const double margin_rad =
      0.5 * std::numbers::pi - settings.bandwidth_rad_s * kDelayPeriods * period_s_;
  require_parameter(
      margin_rad >= kLeastPhaseMargin_rad, kPlace,
      fmt::format("a bandwidth of at most {:.5g} rad/s at {} Hz: a phase margin of 45 degrees",
                  kLeastPhaseMargin_rad / (kDelayPeriods * period_s_), pwm_Hz),
      settings.bandwidth_rad_s);
  const Windings& windings = settings.windings;
  inductance_H_ = windings.inductance_H;
  flux_Vs_ = windings.flux_Vs();
  proportional_V_A_ = settings.bandwidth_rad_s * windings.inductance_H;
  integral_V_A_ = settings.bandwidth_rad_s * windings.resistance_Ohm * period_s_;
  tracking_ = std::min(1.0, period_s_ * windings.resistance_Ohm / windings.inductance_H);
  reset();
}

void CurrentController::reset() noexcept {
  reference_A_ = {};
  integral_V_ = {};
  missed_ = kHeldPeriods;
  is_tripped_ = false;
}

void CurrentController::start(const DirectQuadrature& current_A) noexcept {
  reset();
  if (!is_finite(current_A)) return;
  const double resistance_Ohm = settings_.windings.resistance_Ohm;
  integral_V_ = {resistance_Ohm * current_A.d, resistance_Ohm * current_A.q};
}

// One variable is returned everywhere, so that it is never copied.
CurrentController::Output CurrentController::step(const DirectQuadrature& reference_A,
                                                  const Measurement& measured) noexcept {
  Output output;
  if (is_tripped_) {
    output.is_tripped = true;
    return output;
  }
  if (!is_usable(measured)) {
    hold(output);
    return output;
  }
  const ElectricalAngle angle = ElectricalAngle::of(measured.angle_rad);
  const DirectQuadrature current = rotor_axes(measured.phases_A, angle);
  output.current_A = current;
  if (!(square_of(current) <= settings_.trip_current_A * settings_.trip_current_A)) {
    is_tripped_ = true;
    output.is_tripped = true;
    return output;
  }
  if (is_finite(reference_A)) {
    reference_A_ = reference_A;
  } else {
    output.fault = Fault::input_not_finite;
  }
  const DirectQuadrature wanted_A = limited(reference_A_, settings_.peak_current_A);
  const double speed_rad_s = measured.speed_rad_s;
  const DirectQuadrature error{wanted_A.d - current.d, wanted_A.q - current.q};
  const DirectQuadrature voltage{
      proportional_V_A_ * error.d + integral_V_.d - speed_rad_s * inductance_H_ * current.q,
      proportional_V_A_ * error.q + integral_V_.q +
          speed_rad_s * (inductance_H_ * current.d + flux_Vs_)};
  const double highest_V = measured.supply_V * std::numbers::inv_sqrt3;
  if (!(square_of(voltage) <= kAbsurd * kAbsurd * highest_V * highest_V)) {
    hold(output);
    return output;
  }
  missed_ = 0;
  voltage_V_ = limited(voltage, highest_V);
  const DirectQuadrature cut{voltage_V_.d - voltage.d, voltage_V_.q - voltage.q};
  const auto integrated = [&](double integral_V, double error_A, double cut_V) {
    return std::clamp(integral_V + integral_V_A_ * error_A + tracking_ * cut_V, -highest_V,
                      highest_V);
  };
  integral_V_ = {integrated(integral_V_.d, error.d, cut.d),
                 integrated(integral_V_.q, error.q, cut.q)};
  speed_rad_s_ = speed_rad_s;
  supply_V_ = measured.supply_V;
  const double ahead_rad = kDelayPeriods * speed_rad_s * period_s_;
  angle_rad_ = measured.angle_rad + ahead_rad;
  output.is_on = true;
  output.is_limited =
      cut.d != 0.0 || cut.q != 0.0 || wanted_A.d != reference_A_.d || wanted_A.q != reference_A_.q;
  output.voltage_V = voltage_V_;
  output.duties = duties_of(voltage_V_, angle.turned_by(ahead_rad), supply_V_);
  return output;
}

void CurrentController::hold(Output& output) noexcept {
  output.fault = Fault::input_not_finite;
  if (missed_ >= kHeldPeriods) {
    integral_V_ = {};
    return;
  }
  ++missed_;
  angle_rad_ += speed_rad_s_ * period_s_;
  output.is_on = true;
  output.voltage_V = voltage_V_;
  output.duties = duties_of(voltage_V_, ElectricalAngle::of(angle_rad_), supply_V_);
}

}  // namespace torsio

#include "sim/plant/motor_windings.hpp"

#include <cmath>
namespace torsio {
namespace {

using Complex = std::complex<double>;
constexpr Complex kJ{0.0, 1.0};

/// The mean of exp(−s t) over 0 .. T, for s T of any size.
Complex mean_decay(Complex s, double dt_s) noexcept {
  const Complex x = s * dt_s;
  // The series where 1 − exp(−x) would lose its digits.
  if (std::abs(x) < 1e-4) return 1.0 - x / 2.0 + x * x / 6.0;
  return (1.0 - std::exp(-x)) / x;
}

/// 3/2 of the real part of a conj(b): the power of a voltage and a current.
double power(Complex voltage_V, Complex current_A) noexcept {
  return 1.5 * (voltage_V * std::conj(current_A)).real();
}

Complex axes_at_rest(const ThreePhase& phases) noexcept {
  const DirectQuadrature axes = rotor_axes(phases, {});
  return {axes.d, axes.q};
}

}  // namespace

MotorWindings::MotorWindings(const Windings& windings) : windings_(windings) { windings.check(); }

MotorWindings::Step MotorWindings::step(const CurrentController::Output& command, double supply_V,
                                        double angle_rad, double speed_rad_s,
                                        double dt_s) noexcept {
  if (!command.is_on) {
    current_A_ = {};
    return {};
  }
  const double resistance = windings_.resistance_Ohm;
  const double inductance = windings_.inductance_H;
  const double flux_Vs = windings_.flux_Vs();
  const Complex voltage_V = supply_V * axes_at_rest(command.duties);
  const Complex turned = std::polar(1.0, angle_rad);
  const double decay_1_s = resistance / inductance;
  const Complex speed = kJ * speed_rad_s;

  // i(t) = c exp(−R t / L) + e exp(j θ(t)) + v / R
  const Complex emf_part = -speed * flux_Vs / (resistance + speed * inductance);
  const Complex voltage_part = voltage_V / resistance;
  const Complex free_part = current_A_ - emf_part * turned - voltage_part;
  const Complex before = current_A_;
  const Complex turned_on = turned * std::exp(speed * dt_s);
  current_A_ = free_part * std::exp(-decay_1_s * dt_s) + emf_part * turned_on + voltage_part;

  // In the rotor's axes: the mean of i exp(−j θ).
  const Complex mean_axes = std::conj(turned) * (free_part * mean_decay(decay_1_s + speed, dt_s) +
                                                 voltage_part * mean_decay(speed, dt_s)) +
                            emf_part;
  // From the differential equation: the mean of i.
  const Complex mean_A = (voltage_V - flux_Vs * (turned_on - turned) / dt_s -
                          inductance * (current_A_ - before) / dt_s) /
                         resistance;
  Step result;
  result.torque_Nm = 1.5 * windings_.pole_pairs * flux_Vs * mean_axes.imag();
  result.electrical_J = power(voltage_V, mean_A) * dt_s;
  const double magnetic_J = 0.75 * inductance * (std::norm(current_A_) - std::norm(before));
  result.copper_J =
      result.electrical_J - magnetic_J - 1.5 * flux_Vs * speed_rad_s * mean_axes.imag() * dt_s;
  return result;
}

DirectQuadrature MotorWindings::current(double angle_rad) const noexcept {
  const Complex axes = current_A_ * std::polar(1.0, -angle_rad);
  return {axes.real(), axes.imag()};
}

double MotorWindings::stored_J() const noexcept {
  return 0.75 * windings_.inductance_H * std::norm(current_A_);
}

}  // namespace torsio

#include "sim/plant/electrical_drive.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/checks.hpp"
#include "torsio/actuator/electrical_sheet.hpp"

namespace torsio {
namespace {

constexpr auto kPlace = "electrical drive";
constexpr double kResistanceAt_K = 293.15;

void check(const ElectricalDrive::Parameters& parameters) {
  require_positive(kPlace, "pwm_Hz", parameters.pwm_Hz);
  require_positive(kPlace, "supply_V", parameters.supply_V);
  require_positive(kPlace, "ambient_K", parameters.ambient_K);
  const MotorThermal& thermal = parameters.thermal;
  require_positive(kPlace, "copper_J_K", thermal.copper_J_K);
  require_positive(kPlace, "stator_J_K", thermal.stator_J_K);
  require_positive(kPlace, "copper_stator_K_W", thermal.copper_stator_K_W);
  require_positive(kPlace, "stator_ambient_K_W", thermal.stator_ambient_K_W);
  const PhaseSensors& sensors = parameters.sensors;
  require_not_negative(kPlace, "noise_A", sensors.noise_A);
  for (const double value : {sensors.offset_a_A, sensors.offset_b_A, sensors.gain_error_a,
                             sensors.gain_error_b, parameters.commutation_error_rad})
    require_parameter(std::isfinite(value), kPlace, "finite errors of the sensors", value);
}

}  // namespace

ElectricalDrive::ElectricalDrive(const Parameters& parameters)
    : parameters_(parameters),
      windings_(parameters.control.windings),
      controller_(parameters.control, parameters.pwm_Hz),
      derating_(parameters.derating_begins_K, parameters.derating_ends_K),
      noise_(parameters.seed),
      copper_K_(parameters.ambient_K),
      stator_K_(parameters.ambient_K) {
  check(parameters);
}

void ElectricalDrive::reset(double current_A, double rotor_angle_rad) noexcept {
  const Windings& parts = parameters_.control.windings;
  windings_.reset({0.0, current_A}, parts.pole_pairs * rotor_angle_rad);
  controller_.start({0.0, current_A});
  present_ = {};
  next_ = {.is_on = current_A != 0.0};  // without voltage in the first period
  left_s_ = 0.0;
  current_A_ = {0.0, current_A};
  supply_current_A_ = 0.0;
}

ThreePhase ElectricalDrive::measure(double angle_rad) noexcept {
  const DirectQuadrature current = windings_.current(angle_rad);
  const ThreePhase phases = phases_of(current, ElectricalAngle::of(angle_rad));
  const PhaseSensors& sensors = parameters_.sensors;
  const double a = phases.a * (1.0 + sensors.gain_error_a) + sensors.offset_a_A +
                   sensors.noise_A * noise_.normal();
  const double b = phases.b * (1.0 + sensors.gain_error_b) + sensors.offset_b_A +
                   sensors.noise_A * noise_.normal();
  return {a, b, -a - b};
}

void ElectricalDrive::begin_period(double wanted_A, double angle_rad, double speed_rad_s) noexcept {
  present_ = next_;
  measured_A_ = measure(angle_rad);
  next_ =
      controller_.step({0.0, wanted_A}, {.phases_A = measured_A_,
                                         .angle_rad = angle_rad + parameters_.commutation_error_rad,
                                         .speed_rad_s = speed_rad_s,
                                         .supply_V = parameters_.supply_V});
  left_s_ = 1.0 / parameters_.pwm_Hz;
}

double ElectricalDrive::step(double wanted_A, double rotor_angle_rad, double rotor_speed_rad_s,
                             double dt_s) noexcept {
  const double allowed_A = parameters_.control.peak_current_A * derating_.allowed_share(stator_K_);
  if (std::isfinite(wanted_A)) wanted_A = std::clamp(wanted_A, -allowed_A, allowed_A);
  const double pairs = parameters_.control.windings.pole_pairs;
  const double speed_rad_s = pairs * rotor_speed_rad_s;
  // The angle within one turn: after many turns few digits of a fraction would be left.
  double angle_rad = pairs * std::remainder(rotor_angle_rad, 2.0 * std::numbers::pi);
  const double shortest_s = 1e-9 / parameters_.pwm_Hz;
  double impulse_Nms = 0.0;
  Energy energy;
  for (double left_s = dt_s; left_s > shortest_s;) {
    if (left_s_ <= shortest_s) begin_period(wanted_A, angle_rad, speed_rad_s);
    const double part_s = std::min(left_s, left_s_);
    const MotorWindings::Step part =
        windings_.step(present_, parameters_.supply_V, angle_rad, speed_rad_s, part_s);
    impulse_Nms += part.torque_Nm * part_s;
    energy.electrical_J += part.electrical_J;
    energy.copper_J += part.copper_J;
    angle_rad += speed_rad_s * part_s;
    left_s -= part_s;
    left_s_ -= part_s;
  }
  energy.mechanical_J = impulse_Nms * rotor_speed_rad_s;
  current_A_ = windings_.current(angle_rad);
  supply_current_A_ = energy.electrical_J / (parameters_.supply_V * dt_s);
  warm(energy.copper_J, dt_s);
  energy_.electrical_J += energy.electrical_J;
  energy_.mechanical_J += energy.mechanical_J;
  energy_.copper_J += energy.copper_J;
  return impulse_Nms / dt_s;
}

void ElectricalDrive::switch_off(double dt_s) noexcept {
  reset();
  warm(0.0, dt_s);
}

void ElectricalDrive::warm(double copper_J, double dt_s) noexcept {
  const MotorThermal& thermal = parameters_.thermal;
  const double to_stator_W = (copper_K_ - stator_K_) / thermal.copper_stator_K_W;
  const double to_ambient_W = (stator_K_ - parameters_.ambient_K) / thermal.stator_ambient_K_W;
  copper_K_ += (copper_J - to_stator_W * dt_s) / thermal.copper_J_K;
  stator_K_ += (to_stator_W - to_ambient_W) * dt_s / thermal.stator_J_K;
  windings_.set_resistance(parameters_.control.windings.resistance_Ohm *
                           (1.0 + kCopperResistanceRise_1_K * (copper_K_ - kResistanceAt_K)));
}

}  // namespace torsio

#include <cmath>
#include <cstddef>
#include <utility>
#include <vector>

#include "control/current_controller.hpp"
#include "fit/mixture/online_mixture.hpp"
#include "fitted_grey_box.hpp"
#include "rows.hpp"
#include "torsio/actuator/electrical_sheet.hpp"
#include "torsio/actuator/joint_parameters.hpp"
#include "torsio/control/joint_cascade.hpp"
#include "torsio/control/joint_impedance.hpp"
#include "torsio/control/model_inverse.hpp"
#include "torsio/control/torque_controller.hpp"
#include "torsio/core/random.hpp"
#include "torsio/estimate/estimator_settings.hpp"

namespace torsio::bench {
namespace {

constexpr double kRate_Hz = 1000.0;
constexpr std::size_t kTicks = 10000;

/// Seconds per call of `step(t_s)`, which returns a number that is kept.
template <class Step>
double seconds_a_tick(const Step& step) {
  double sum = 0.0;
  const double seconds = best_seconds([&] {
    for (std::size_t n = 0; n < kTicks; ++n) sum += step(static_cast<double>(n) / kRate_Hz);
  });
  volatile double kept = sum;
  static_cast<void>(kept);
  return seconds / static_cast<double>(kTicks);
}

JointSample swinging(double t_s) {
  JointSample sample;
  sample.joint_angle_rad = 0.5 * std::sin(0.6 * t_s);
  sample.gear_angle_rad = sample.joint_angle_rad + 0.02 * std::sin(5.0 * t_s);
  sample.motor_angle_rad = 120.0 * sample.gear_angle_rad;
  return sample;
}

/// 300 components over torque, deflection, filtered rate, joint speed of a spring with friction.
Dgmm mixture_300() {
  Random random(5);
  Matrix samples(60000, 4);
  for (std::size_t i = 0; i < samples.rows; ++i) {
    const double phase = 0.001 * static_cast<double>(i);
    const double swell = 1.0 + 0.9 * std::sin(0.037 * phase);
    const double deflection = 0.02 * swell * std::sin(phase) + 1e-4 * random.normal();
    const double rate = 0.1 * swell * std::cos(phase) + 5e-3 * random.normal();
    samples(i, 0) = 573.0 * deflection + 1.5 * std::tanh(rate / 0.02) + 0.05 * random.normal();
    samples(i, 1) = deflection;
    samples(i, 2) = rate;
    samples(i, 3) = 0.3 * std::cos(0.6 * phase) + 0.02 * random.normal();
  }
  OnlineMixture learner(robust_standardisation(samples, std::vector<double>(4, 1e-4)),
                        {.components = 300, .novelty_distance = 0.1});
  for (std::size_t i = 0; i < samples.rows; ++i) learner.learn(samples.row(i));
  return Dgmm(Dgmm::Parameters{.mixture = learner.mixture(),
                               .clamp = {.slope = {573.0, 0.0, 0.0}, .width = 2.0}});
}

EstimatorSettings settings_around_mixture() {
  return {
      .features = {.inputs = {"spring_deflection_rad", "lowpass(rate(spring_deflection_rad), 10Hz)",
                              "lowpass(rate(joint_angle_rad), 10Hz)"},
                   .definitions = {}},
      .sample_rate_Hz = kRate_Hz,
      .target = "torque_Nm",
      .zeroed_channels = {},
      .ranges = {.lowest = {-0.05, -1.0, -1.0}, .highest = {0.05, 1.0, 1.0}},
      .fallback = {.slope = {573.0, 0.0, 0.0}, .residual_std = 1.5},
      .residuals = {}};
}

/// One step of the torque loop of dfki-50 through this inverse.
template <SpringInverse I>
Row torque_loop_row(I inverse, TorqueLoopCore::Settings settings = {}) {
  settings.deflection.joint = series_elastic_joint(data_sheet("dfki-50"));
  TorqueController controller(std::move(inverse), settings, kRate_Hz);
  const double seconds = seconds_a_tick(
      [&](double t_s) { return controller.step(10.0 * std::sin(t_s), swinging(t_s)).current_A; });
  return {.value = seconds * 1e6, .unit = "us"};
}

}  // namespace

Row cascade_step() {
  const Drive drive = drive_of(data_sheet("dfki-50"));
  JointCascade cascade({.drive = drive,
                        .limits = {.lowest_rad = -1.0, .highest_rad = 1.0, .speed_rad_s = 2.0},
                        .has_torque = true},
                       kRate_Hz);
  const double seconds = seconds_a_tick([&](double t_s) {
    const double angle_rad = 0.9 * std::sin(t_s);
    return cascade
        .step({.mode = JointMode::position, .position_rad = angle_rad},
              {.angle_rad = 0.99 * angle_rad, .speed_rad_s = 0.5, .torque_Nm = angle_rad})
        .current_A;
  });
  return {.value = seconds * 1e6, .unit = "us"};
}

/// Field-oriented current control of one motor, from phase currents to duties.
Row current_loop_step() {
  const ElectricalSheet sheet = electrical_sheet(data_sheet("dfki-50"));
  CurrentController controller(
      {.windings = {.resistance_Ohm = sheet.phase_resistance_Ohm.value,
                    .inductance_H = sheet.phase_inductance_H.value,
                    .torque_constant_Nm_A = data_sheet("dfki-50").motor.torque_constant_Nm_A.value,
                    .pole_pairs = 5},
       .peak_current_A = 10.0,
       .trip_current_A = 15.0},
      sheet.pwm_Hz.value);
  const double seconds = seconds_a_tick([&](double t_s) {
    const double angle_rad = 100.0 * t_s;
    return controller
        .step({0.0, 2.0}, {.phases_A = {0.5, -0.2, -0.3},
                           .angle_rad = angle_rad,
                           .speed_rad_s = 500.0,
                           .supply_V = 48.0})
        .duties.a;
  });
  return {.value = seconds * 1e9, .unit = "ns"};
}

Row impedance_step() {
  JointImpedance impedance({.gains = {50.0, 2.0}, .torque_Nm = 40.0}, kRate_Hz);
  const double seconds = seconds_a_tick([&](double t_s) {
    return impedance.step({.angle_rad = std::sin(t_s)}, {.angle_rad = 0.1, .speed_rad_s = 0.2})
        .torque_Nm;
  });
  return {.value = seconds * 1e6, .unit = "us"};
}

/// The loop itself, with a linear inverse.
Row torque_loop_linear_step() {
  return torque_loop_row(LinearInverse(573.0),
                         {.friction = FrictionCompensation{}, .observer_cutoff_Hz = 5.0});
}

Row torque_loop_dgmm300_step() {
  return torque_loop_row(ModelInverse(settings_around_mixture(), mixture_300()));
}

/// With the inverse of a grey box: secants from its present state.
Row torque_loop_grey_box_step() {
  return torque_loop_row(ModelInverse(settings_around_mixture(), fitted_grey_box()));
}

}  // namespace torsio::bench

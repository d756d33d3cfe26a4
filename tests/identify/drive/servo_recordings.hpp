#pragma once

#include <algorithm>
#include <cmath>
#include <random>
#include <string>
#include <vector>

#include "torsio/data/recording.hpp"

namespace torsio::testing {

/// A servo with a pendulum, in scalar code that shares nothing with the kernel.
struct Servo {
  double kt = 0.5;
  double resistance = 5.0;
  double armature = 0.002;
  double zero = 0.01;
  double coulomb = 0.015;
  double viscous = 0.004;
  double load_friction = 0.0;
  double mass_kg = 0.5;
  double length_m = 0.1;
  double supply_V = 7.4;
  double error_gain = 0.003;  ///< duty for a radian at gain 1
};

/// Goal `amplitude (sin w t + sin 2.3 w t)` at 200 Hz; the power is off in the last quarter where `is_released`.
inline Recording servo_recording(const Servo& servo, double gain, double amplitude_rad,
                                 double frequency_Hz, bool is_released, unsigned seed,
                                 double duration_s = 4.0) {
  constexpr double kPeriod_s = 0.005;
  constexpr int kSteps = 50;
  const auto count = static_cast<std::size_t>(duration_s / kPeriod_s);
  std::vector<double> goal(count);
  std::vector<double> angle(count);
  std::vector<double> duty(count);
  std::vector<double> enabled(count, 1.0);
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> jitter(-0.5, 0.5);
  const double w = 2.0 * M_PI * frequency_Hz;
  for (std::size_t n = 0; n < count; ++n) {
    const double t = static_cast<double>(n) * kPeriod_s;
    goal[n] = amplitude_rad * (std::sin(w * t) + std::sin(2.3 * w * t));
    if (is_released && 4 * n > 3 * count) enabled[n] = 0.0;
  }
  double q = 0.0;
  double v = 0.0;
  const double inertia = servo.mass_kg * servo.length_m * servo.length_m + servo.armature;
  for (std::size_t n = 0; n < count; ++n) {
    constexpr double kCount_rad = 0.00153;
    angle[n] = kCount_rad * std::round(q / kCount_rad + 0.2 * jitter(random));
    duty[n] = enabled[n] * std::clamp(gain * servo.error_gain * (goal[n] - angle[n]), -1.0, 1.0);
    for (int k = 0; k < kSteps; ++k) {
      const double dt = kPeriod_s / kSteps;
      const double share = static_cast<double>(k) / kSteps;
      const double wanted = n + 1 < count ? goal[n] + share * (goal[n + 1] - goal[n]) : goal[n];
      const double d = std::clamp(gain * servo.error_gain * (wanted - q), -1.0, 1.0);
      const double motor =
          enabled[n] * servo.kt / servo.resistance * (servo.supply_V * d - servo.kt * v);
      const double gravity = -servo.mass_kg * 9.80665 * servo.length_m * std::sin(q + servo.zero);
      const double bound = servo.coulomb + servo.load_friction * std::abs(motor - gravity) +
                           servo.viscous * std::abs(v);
      const double stop = inertia / dt * v + motor + gravity;
      v += dt / inertia * (motor + gravity - std::clamp(stop, -bound, bound));
      q += dt * v;
    }
  }
  Recording recording(
      "gain " + std::to_string(static_cast<int>(gain)) + " run " + std::to_string(seed), 200.0);
  recording.add({.name = "goal_angle_rad", .values = goal});
  recording.add({.name = "joint_angle_rad", .values = angle});
  recording.add({.name = "duty_1", .values = duty});
  recording.add({.name = "enabled_1", .values = enabled});
  recording.add_condition("kp_1", gain);
  recording.add_condition("supply_V", servo.supply_V);
  return recording;
}

inline std::vector<Recording> servo_recordings(const Servo& servo) {
  std::vector<Recording> recordings;
  unsigned seed = 1;
  for (const double gain : {100.0, 200.0, 400.0})
    for (const double frequency_Hz : {0.3, 0.8})
      recordings.push_back(
          servo_recording(servo, gain, 0.7, frequency_Hz, frequency_Hz > 0.5, seed++));
  return recordings;
}

}  // namespace torsio::testing

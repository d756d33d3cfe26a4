#pragma once

#include <cmath>
#include <cstddef>
#include <numbers>
#include <vector>

#include "torsio/arm/arm_dynamics.hpp"
#include "torsio/core/random.hpp"
#include "torsio/identify/identification.hpp"

namespace torsio::test {

inline constexpr double kMovingRate_Hz = 500.0;

/// Sums of three sines per joint, and the torques that they need: exact but for the sampling.
struct MovingArm {
  struct Options {
    double duration_s = 20.0;
    double amplitude_rad = 0.5;
    double noise_Nm = 0.0;  ///< standard deviation of the noise of each torque
    double noise_s = 0.3;   ///< its correlation time
    double dry_Nm = 0.0;    ///< friction of each bearing
    double viscous_Nms_rad = 0.0;
    std::uint64_t seed = 1;
  };

  static ArmMotion of(const ArmModel& arm, const Options& options) {
    const ArmDynamics dynamics(arm);
    const std::size_t joints = arm.joints.size();
    Random random(options.seed);
    std::vector<double> phase;
    std::vector<double> rate;
    for (std::size_t i = 0; i < 3 * joints; ++i) {
      phase.push_back(random.uniform(0.0, 2.0 * std::numbers::pi));
      rate.push_back(random.uniform(0.4, 3.0));
    }
    ArmMotion motion{.name = "sines", .sample_rate_Hz = kMovingRate_Hz};
    motion.angle_rad.resize(joints);
    motion.torque_Nm.resize(joints);
    std::vector<double> noise(joints, 0.0);
    const double keep = std::exp(-1.0 / (options.noise_s * kMovingRate_Hz));
    const auto samples = static_cast<std::size_t>(options.duration_s * kMovingRate_Hz);
    for (std::size_t n = 0; n < samples; ++n) {
      ArmDynamics::PerJoint q = {};
      ArmDynamics::PerJoint v = {};
      ArmDynamics::PerJoint a = {};
      ArmDynamics::PerJoint torque_Nm = {};
      const double t = static_cast<double>(n) / kMovingRate_Hz;
      for (std::size_t j = 0; j < joints; ++j)
        for (std::size_t k = 0; k < 3; ++k) {
          const double w = rate[3 * j + k];
          const double angle = w * t + phase[3 * j + k];
          q[j] += options.amplitude_rad * std::sin(angle);
          v[j] += options.amplitude_rad * w * std::cos(angle);
          a[j] -= options.amplitude_rad * w * w * std::sin(angle);
        }
      dynamics.inverse(q, v, a, torque_Nm);
      for (std::size_t j = 0; j < joints; ++j) {
        noise[j] = keep * noise[j] + std::sqrt(1.0 - keep * keep) * random.normal();
        motion.angle_rad[j].push_back(q[j]);
        motion.torque_Nm[j].push_back(torque_Nm[j] + options.dry_Nm * std::tanh(v[j] / 0.02) +
                                      options.viscous_Nms_rad * v[j] + options.noise_Nm * noise[j]);
      }
    }
    return motion;
  }
};

}  // namespace torsio::test

#include "sim/loops/bench_pd_loop.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "torsio/core/error.hpp"

namespace torsio {
namespace {

constexpr double kNatural_rad_s = 2.0 * std::numbers::pi * 6.0;
constexpr double kPdDamping = 0.5;

}  // namespace

BenchPdLoop::Gains BenchPdLoop::gains(const PlantParameters& plant, double load_inertia_kg_m2,
                                      double rated_torque_Nm) {
  const double ratio = total_ratio(plant);
  const double inertia_kg_m2 =
      plant.rotor_inertia_kg_m2 * ratio * ratio + plant.joint_inertia_kg_m2 + load_inertia_kg_m2;
  return {.kp_Nm_rad = inertia_kg_m2 * kNatural_rad_s * kNatural_rad_s,
          .kd_Nms_rad = 2.0 * kPdDamping * kNatural_rad_s * inertia_kg_m2,
          .torque_limit_Nm = rated_torque_Nm};
}

BenchPdLoop::BenchPdLoop(const PlantParameters& plant, const Gains& gains, double sample_rate_Hz)
    : gains_(gains),
      sample_rate_Hz_(sample_rate_Hz),
      inverse_ratio_(1.0 / total_ratio(plant)),
      current_A_Nm_(inverse_ratio_ / plant.motor.torque_constant_Nm_A) {
  const bool is_possible = gains.kp_Nm_rad >= 0.0 && gains.kd_Nms_rad >= 0.0 &&
                           gains.torque_limit_Nm > 0.0 &&
                           std::isfinite(gains.kp_Nm_rad + gains.kd_Nms_rad);
  if (is_possible) return;
  throw Error({.place = "PD loop",
               .expected = "finite gains of at least 0, and a torque limit above 0",
               .found = fmt::format("{:.4g} Nm/rad, {:.4g} Nms/rad, {:.4g} Nm", gains.kp_Nm_rad,
                                    gains.kd_Nms_rad, gains.torque_limit_Nm)});
}

void BenchPdLoop::reset() noexcept {
  torque_Nm_ = 0.0;
  is_started_ = false;
}

double BenchPdLoop::step(double wanted_rad, double rotor_angle_rad) noexcept {
  if (!std::isfinite(wanted_rad + rotor_angle_rad)) return torque_Nm_;
  const double angle_rad = rotor_angle_rad * inverse_ratio_;
  if (!is_started_) {
    last_angle_rad_ = angle_rad;
    is_started_ = true;
  }
  const double speed_rad_s = (angle_rad - last_angle_rad_) * sample_rate_Hz_;
  last_angle_rad_ = angle_rad;
  torque_Nm_ =
      std::clamp(gains_.kp_Nm_rad * (wanted_rad - angle_rad) - gains_.kd_Nms_rad * speed_rad_s,
                 -gains_.torque_limit_Nm, gains_.torque_limit_Nm);
  if (!std::isfinite(torque_Nm_)) reset();  // finite numbers, whose difference is not
  return torque_Nm_;
}

}  // namespace torsio

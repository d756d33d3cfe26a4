#include "sim/loops/bench_torque_loop.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "torsio/core/error.hpp"

namespace torsio {
namespace {

constexpr double kTorqueBandwidth_rad_s = 100.0;
constexpr double kTorqueDamping = 0.9;
constexpr double kIntegralShare = 0.2;  // share of the bandwidth
constexpr double kSpeedCutoff_Hz = 120.0;

}  // namespace

BenchTorqueLoop::BenchTorqueLoop(const PlantParameters& plant, double stiffness_Nm_rad,
                                 double sample_rate_Hz)
    : sample_rate_Hz_(sample_rate_Hz),
      inverse_ratio_(1.0 / total_ratio(plant)),
      peak_current_A_(plant.motor.peak_current_A),
      speed_filter_(kSpeedCutoff_Hz, sample_rate_Hz) {
  const double ratio = total_ratio(plant);
  const double inertia_kg_m2 = plant.rotor_inertia_kg_m2 * ratio * ratio;
  const double stiffest_Nm_rad = inertia_kg_m2 * kTorqueBandwidth_rad_s * kTorqueBandwidth_rad_s;
  if (!(stiffness_Nm_rad > 0.0 && stiffness_Nm_rad < stiffest_Nm_rad)) {
    throw Error({.place = "torque loop",
                 .problem = "no gains for this stiffness",
                 .expected = fmt::format("0 < Nm/rad < {:.4g}", stiffest_Nm_rad),
                 .found = fmt::format("{:.4g} Nm/rad", stiffness_Nm_rad)});
  }
  inverse_stiffness_ = 1.0 / stiffness_Nm_rad;
  feed_forward_A_Nm_ = 1.0 / (ratio * plant.motor.torque_constant_Nm_A);
  proportional_A_Nm_ = (stiffest_Nm_rad / stiffness_Nm_rad - 1.0) * feed_forward_A_Nm_;
  integral_A_Nm_s_ =
      kIntegralShare * kTorqueBandwidth_rad_s * (proportional_A_Nm_ + feed_forward_A_Nm_);
  derivative_As_rad_ =
      2.0 * kTorqueDamping * kTorqueBandwidth_rad_s * inertia_kg_m2 * feed_forward_A_Nm_;
}

void BenchTorqueLoop::reset() noexcept {
  speed_filter_.reset();
  integral_A_ = 0.0;
  current_A_ = 0.0;
  is_started_ = false;
}

double BenchTorqueLoop::step(double wanted_Nm, double torque_Nm, double rotor_angle_rad) noexcept {
  if (!std::isfinite(wanted_Nm + torque_Nm + rotor_angle_rad)) return current_A_;
  const double angle_rad = rotor_angle_rad * inverse_ratio_;
  if (!is_started_) {
    last_wanted_Nm_ = wanted_Nm;
    last_angle_rad_ = angle_rad;
    is_started_ = true;
  }
  const double speed = speed_filter_.step((angle_rad - last_angle_rad_) * sample_rate_Hz_);
  const double wanted_speed = (wanted_Nm - last_wanted_Nm_) * sample_rate_Hz_ * inverse_stiffness_;
  last_angle_rad_ = angle_rad;
  last_wanted_Nm_ = wanted_Nm;
  const double error_Nm = wanted_Nm - torque_Nm;
  integral_A_ = std::clamp(integral_A_ + integral_A_Nm_s_ * error_Nm / sample_rate_Hz_,
                           -peak_current_A_, peak_current_A_);
  current_A_ = feed_forward_A_Nm_ * wanted_Nm + proportional_A_Nm_ * error_Nm + integral_A_ +
               derivative_As_rad_ * (wanted_speed - speed);
  if (!std::isfinite(current_A_)) reset();  // finite numbers, but beyond what the filter holds
  return current_A_;
}

}  // namespace torsio

#include "sim/loops/bench_position_loop.hpp"

#include <algorithm>
#include <cmath>

namespace torsio {
namespace {

constexpr double kPositionGainShare = 0.32;  // share of the bandwidth
constexpr double kCutoff_Hz_s_rad = 2.4;     // cut-off of the speed's low-pass
constexpr double kHighestCutoffShare = 0.2;  // share of the sample rate

}  // namespace

BenchPositionLoop::BenchPositionLoop(const PlantParameters& plant, double sample_rate_Hz,
                                     double bandwidth_rad_s)
    : sample_rate_Hz_(sample_rate_Hz),
      inverse_ratio_(1.0 / total_ratio(plant)),
      speed_gain_A_s_rad_(plant.rotor_inertia_kg_m2 * total_ratio(plant) * bandwidth_rad_s /
                          plant.motor.torque_constant_Nm_A),
      position_gain_(kPositionGainShare * bandwidth_rad_s),
      integral_limit_(plant.motor.peak_current_A / (speed_gain_A_s_rad_ * position_gain_)),
      speed_filter_(
          std::min(kCutoff_Hz_s_rad * bandwidth_rad_s, kHighestCutoffShare * sample_rate_Hz),
          sample_rate_Hz) {}

void BenchPositionLoop::reset() noexcept {
  speed_filter_.reset();
  integral_ = 0.0;
  current_A_ = 0.0;
  is_started_ = false;
}

double BenchPositionLoop::step(double wanted_rad, double rotor_angle_rad) noexcept {
  if (!std::isfinite(wanted_rad + rotor_angle_rad)) return current_A_;
  const double angle_rad = rotor_angle_rad * inverse_ratio_;
  if (!is_started_) {
    last_wanted_rad_ = wanted_rad;
    last_angle_rad_ = angle_rad;
    is_started_ = true;
  }
  const double speed = speed_filter_.step((angle_rad - last_angle_rad_) * sample_rate_Hz_);
  const double wanted_speed = (wanted_rad - last_wanted_rad_) * sample_rate_Hz_;
  last_angle_rad_ = angle_rad;
  last_wanted_rad_ = wanted_rad;
  const double error = position_gain_ * (wanted_rad - angle_rad) + wanted_speed - speed;
  integral_ = std::clamp(integral_ + error / sample_rate_Hz_, -integral_limit_, integral_limit_);
  current_A_ = speed_gain_A_s_rad_ * (error + position_gain_ * integral_);
  if (!std::isfinite(current_A_)) reset();  // finite numbers, but beyond what the filter holds
  return current_A_;
}

}  // namespace torsio

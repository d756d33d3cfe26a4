#include "sim/loops/bench_deflection_loop.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <variant>

#include "torsio/core/error.hpp"

namespace torsio {
namespace {

constexpr double kBandwidth_rad_s = 50.0;
constexpr double kDamping = 0.9;
constexpr double kIntegralGain = 6.0;  // 1/s
constexpr double kRateCutoff_Hz = 120.0;

}  // namespace

BenchDeflectionLoop::BenchDeflectionLoop(const PlantParameters& plant, double sample_rate_Hz)
    : sample_rate_Hz_(sample_rate_Hz), rate_filter_(kRateCutoff_Hz, sample_rate_Hz) {
  const auto* const spring = std::get_if<Spring::Parameters>(&plant.second);
  if (spring == nullptr) {
    throw Error({.place = "deflection loop",
                 .expected = "a plant whose second stage is a spring",
                 .found = "another stage"});
  }
  const double stiffness_Nm_rad = spring->elastic.stiffness_Nm_rad;
  const double ratio = total_ratio(plant);
  const double inertia_kg_m2 = plant.rotor_inertia_kg_m2 * ratio * ratio;
  const double stiffest_Nm_rad = inertia_kg_m2 * kBandwidth_rad_s * kBandwidth_rad_s;
  if (!(stiffness_Nm_rad < stiffest_Nm_rad)) {
    throw Error({.place = "deflection loop",
                 .problem = "the spring alone is faster than the loop's bandwidth",
                 .expected = fmt::format("a stiffness below {:.4g} Nm/rad", stiffest_Nm_rad),
                 .found = fmt::format("{:.4g} Nm/rad", stiffness_Nm_rad)});
  }
  const double torque_per_current = ratio * plant.motor.torque_constant_Nm_A;
  proportional_A_rad_ = (stiffest_Nm_rad - stiffness_Nm_rad) / torque_per_current;
  derivative_As_rad_ = 2.0 * kDamping * kBandwidth_rad_s * inertia_kg_m2 / torque_per_current;
  feed_forward_A_rad_ = stiffness_Nm_rad / torque_per_current;
  integral_limit_rad_s_ = plant.motor.peak_current_A / (kIntegralGain * proportional_A_rad_);
}

void BenchDeflectionLoop::reset() noexcept {
  rate_filter_.reset();
  integral_rad_s_ = 0.0;
  current_A_ = 0.0;
  is_started_ = false;
}

double BenchDeflectionLoop::step(double wanted_rad, double deflection_rad) noexcept {
  if (!std::isfinite(wanted_rad + deflection_rad)) return current_A_;
  if (!is_started_) {
    last_deflection_rad_ = deflection_rad;
    is_started_ = true;
  }
  const double rate = rate_filter_.step((deflection_rad - last_deflection_rad_) * sample_rate_Hz_);
  last_deflection_rad_ = deflection_rad;
  const double reachable_rad = std::clamp(wanted_rad, -kLargest_rad, kLargest_rad);
  const double error_rad = reachable_rad - deflection_rad;
  integral_rad_s_ = std::clamp(integral_rad_s_ + error_rad / sample_rate_Hz_,
                               -integral_limit_rad_s_, integral_limit_rad_s_);
  current_A_ = proportional_A_rad_ * (error_rad + kIntegralGain * integral_rad_s_) -
               derivative_As_rad_ * rate + feed_forward_A_rad_ * reachable_rad;
  if (!std::isfinite(current_A_)) reset();  // finite numbers, but beyond what the filter holds
  return current_A_;
}

}  // namespace torsio

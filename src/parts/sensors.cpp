#include <cmath>
#include <numbers>

#include "core/checks.hpp"
#include "parts/current_sensor.hpp"
#include "parts/encoder.hpp"
#include "parts/torque_sensor.hpp"

namespace torsio {
namespace {

constexpr auto kTorqueSensor = "torque sensor";

/// The number of ticks of a time. @throws Error if it is not an integer.
std::size_t whole_ticks(double time_s, double tick_s, const std::string& what) {
  const double ticks = std::round(time_s / tick_s);
  require_parameter(std::abs(ticks * tick_s - time_s) < 1e-6 * tick_s, kTorqueSensor,
                    what + " that is a whole number of loop ticks", time_s / tick_s);
  return static_cast<std::size_t>(ticks);
}

}  // namespace

Encoder::Encoder(const Parameters& parameters, Random& random)
    : lsb_rad_(2.0 * std::numbers::pi / std::exp2(parameters.bits)),
      inverse_lsb_(1.0 / lsb_rad_),
      jitter_lsb_(parameters.jitter_lsb),
      offset_rad_(random.uniform() * lsb_rad_),
      zero_rad_(parameters.zero_rad) {
  require_parameter(parameters.bits >= 1.0 && parameters.bits <= 40.0, "encoder", "1..40 bits",
                    parameters.bits);
  require_not_negative("encoder", "jitter_lsb", parameters.jitter_lsb);
  require_parameter(std::isfinite(parameters.zero_rad), "encoder", "a finite zero_rad",
                    parameters.zero_rad);
}

CurrentSensor::CurrentSensor(const Parameters& parameters) : noise_A_(parameters.noise_A) {
  require_not_negative("current sensor", "noise_A", parameters.noise_A);
}

TorqueSensor::TorqueSensor(const Parameters& parameters, double tick_s)
    : noise_Nm_(parameters.noise_Nm) {
  require_not_negative(kTorqueSensor, "noise_Nm", parameters.noise_Nm);
  require_positive(kTorqueSensor, "sample_rate_Hz", parameters.sample_rate_Hz);
  require_not_negative(kTorqueSensor, "latency_s", parameters.latency_s);
  require_positive(kTorqueSensor, "tick_s", tick_s);
  ticks_per_sample_ = whole_ticks(1.0 / parameters.sample_rate_Hz, tick_s, "a sample period");
  latency_ticks_ = whole_ticks(parameters.latency_s, tick_s, "a latency");
  require_parameter(ticks_per_sample_ > latency_ticks_, kTorqueSensor,
                    "a latency below the sample period", parameters.latency_s);
}

void TorqueSensor::reset(double torque_Nm, Random& random) noexcept {
  phase_ = 0;
  held_Nm_ = torque_Nm + noise_Nm_ * random.normal();
  sampled_Nm_ = held_Nm_;
}

TorqueSensor::Reading TorqueSensor::step(double torque_Nm, Random& random) noexcept {
  if (phase_ == 0) sampled_Nm_ = torque_Nm + noise_Nm_ * random.normal();
  const bool is_fresh = phase_ == latency_ticks_;
  if (is_fresh) held_Nm_ = sampled_Nm_;
  phase_ = (phase_ + 1) % ticks_per_sample_;
  return {held_Nm_, is_fresh};
}

}  // namespace torsio

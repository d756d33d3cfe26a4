#pragma once

#include <cstddef>

#include "torsio/core/random.hpp"

namespace torsio {

/// A load cell that is slower than the loop around it: it samples at its own rate, delivers late,
/// and its last value is held between. Counts in ticks of the loop that reads it. Source:
/// specification 4.1.
class TorqueSensor {
 public:
  struct Parameters {
    double noise_Nm = 0.0;        ///< one standard deviation
    double sample_rate_Hz = 0.0;  ///< sample rate of the sensor
    double latency_s = 0.0;       ///< from sampling to delivery
  };
  struct Reading {
    double torque_Nm = 0.0;
    bool is_fresh = false;  ///< delivered at this tick
  };

  /// @param tick_s period at which `step` is called
  /// @throws Error if the noise or latency is negative, or the sensor's period or latency is no
  /// multiple of the tick, or the latency reaches the sensor's period.
  TorqueSensor(const Parameters& parameters, double tick_s);

  /// As if the sensor had been running at this torque for long.
  void reset(double torque_Nm, Random& random) noexcept;
  Reading step(double torque_Nm, Random& random) noexcept;

 private:
  double noise_Nm_;
  std::size_t ticks_per_sample_ = 1;
  std::size_t latency_ticks_ = 0;
  std::size_t phase_ = 0;  ///< ticks since the last sample was taken
  double sampled_Nm_ = 0.0;
  double held_Nm_ = 0.0;
};

}  // namespace torsio

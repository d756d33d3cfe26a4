#pragma once

#include <cstddef>

#include "torsio/core/matrix.hpp"
#include "torsio/estimate/estimator_settings.hpp"

namespace torsio::test {

/// Settings around any of the example models: two inputs, a deflection and its filtered rate, both
/// trained on -1..1.
inline EstimatorSettings example_settings() {
  return {
      .features = {.inputs = {"spring_deflection_rad",
                              "lowpass(rate(spring_deflection_rad), 50Hz)"},
                   .definitions = {{"spring_deflection_rad", "gear_angle_rad - joint_angle_rad"}}},
      .sample_rate_Hz = 1000.0,
      .target = "torque_Nm",
      .zeroed_channels = {"joint_angle_rad"},
      .ranges = {.lowest = {-1.0, -1.0}, .highest = {1.0, 1.0}, .margin = 0.1},
      .fallback = {.intercept = 0.5, .slope = {100.0, 2.0}, .residual_std = 3.0},
      .residuals = {.edges = {-10.0, 0.0, 10.0}, .std_dev = {1.0, 2.0}}};
}

}  // namespace torsio::test

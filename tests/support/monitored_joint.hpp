#pragma once

#include <string>
#include <utility>
#include <vector>

#include "model/linear/linear.hpp"
#include "torsio/core/matrix.hpp"
#include "torsio/estimate/monitored_torque.hpp"

namespace torsio::test {

/// A source that estimates `gain` times one expression.
inline Estimator proportional_source(const std::string& expression, double gain,
                                     double sample_rate_Hz = 1000.0,
                                     const std::string& target = "torque_Nm",
                                     double std_dev_Nm = 0.1) {
  Linear::Parameters parameters;
  parameters.coefficients.values = Matrix(1, 2);
  parameters.coefficients.values.values = {0.0, gain};
  return {{.features = {.inputs = {expression}, .definitions = {}},
           .sample_rate_Hz = sample_rate_Hz,
           .target = target,
           .zeroed_channels = {},
           .ranges = {.lowest = {-100.0}, .highest = {100.0}},
           .fallback = {.intercept = 0.0, .slope = {gain}, .residual_std = std_dev_Nm},
           .residuals = {.edges = {-1e3, 1e3}, .std_dev = {std_dev_Nm}}},
          AnyModel(Linear(parameters))};
}

/// The torque from current, gear and spring: 10 Nm/A, 500 Nm/rad and 500 Nm/rad.
inline std::vector<Estimator> joint_sources() {
  std::vector<Estimator> sources;
  sources.push_back(proportional_source("motor_current_A", 10.0));
  sources.push_back(proportional_source("motor_angle_rad / 100 - gear_angle_rad", 500.0));
  sources.push_back(proportional_source("gear_angle_rad - joint_angle_rad", 500.0));
  return sources;
}

inline RedundancySettings joint_redundancy() {
  return {.sources = {{.name = "current", .depends_on = {"current_sensor"}},
                      {.name = "gear", .depends_on = {"motor_encoder", "gear_encoder"}},
                      {.name = "spring", .depends_on = {"gear_encoder", "joint_encoder"}}},
          .correlation = {}};
}

inline MonitorSettings joint_monitor() {
  return {.sources = {"current", "gear", "spring"},
          .signals = {{.name = "gear_angle_rad", .longest_age_s = 0.005},
                      {.name = "gear_angle_rad - joint_angle_rad", .lowest = -0.1, .highest = 0.1},
                      {.name = "lowpass(joint_angle_rad, 50Hz)", .lowest = -3.0, .highest = 3.0}},
          .pairs = {{.first = 0, .second = 1, .floor_Nm = 2.0},
                    {.first = 0, .second = 2, .floor_Nm = 2.0},
                    {.first = 1, .second = 2, .floor_Nm = 2.0}},
          .correlation = {}};
}

/// As `joint_monitor`, with limits that no sound joint reaches whatever its sources estimate.
inline MonitorSettings tolerant_monitor() {
  constexpr double kWide = 1e4;
  MonitorSettings monitor = joint_monitor();
  for (PairLimits& pair : monitor.pairs) pair.floor_Nm = kWide;
  for (MonitoredSignal& signal : monitor.signals) {
    signal.lowest = -kWide;
    signal.highest = kWide;
  }
  monitor.actions.fill(MonitorAction::warn);
  return monitor;
}

/// Sources without friction.
inline TorqueSources torque_sources(std::vector<Estimator> estimators) {
  std::vector<SourceModel> models;
  for (Estimator& estimator : estimators) models.push_back({.torque = std::move(estimator)});
  return TorqueSources(std::move(models));
}

inline MonitoredTorque monitored_joint() {
  return {torque_sources(joint_sources()), joint_redundancy(), joint_monitor()};
}

}  // namespace torsio::test

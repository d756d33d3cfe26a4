#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "common/output.hpp"
#include "sim/campaign/fault_campaign.hpp"
#include "torsio/evaluate/monitor_replay.hpp"

/// The flags of `torsio monitor` for simulated joints.
struct SimulatedMonitorFlags {
  std::vector<std::string> actuators;
  std::string monitors;  ///< folder with NAME.monitor.json; empty: each is calibrated again
  double fault_free_hours = 4.0;
  double false_alarms_per_hour = 1e-4;
  std::vector<std::string> injections;
  std::string faults;
  std::string duration = "20s";
  std::uint64_t seed = 1;
  std::size_t accuracy_runs = 0;
  bool is_campaign = false;
  torsio::CampaignSettings campaign;
};

/// Calibrates the monitor of a simulated joint and writes it with its models.
void calibrate_simulated(const SimulatedMonitorFlags& flags, const std::string& output,
                         const JsonOutput& json);
/// A simulated joint at work with these faults, and what its monitor reports.
/// @param monitor_file empty: that of `monitors`, or calibrated now
[[nodiscard]] torsio::MonitorReplay replay_simulated(const SimulatedMonitorFlags& flags,
                                                     const std::string& monitor_file,
                                                     torsio::MonitorSettings& settings);
void run_campaign(const SimulatedMonitorFlags& flags, const JsonOutput& json);
/// Errors of the combined torque.
void run_accuracy(const SimulatedMonitorFlags& flags, const JsonOutput& json);

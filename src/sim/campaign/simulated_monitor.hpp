#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "sim/campaign/monitor_recipe.hpp"
#include "torsio/actuator/data_sheet.hpp"
#include "torsio/core/progress.hpp"
#include "torsio/estimate/monitored_torque.hpp"
#include "torsio/evaluate/monitor_calibration.hpp"

namespace torsio {

/// How the monitor of a simulated joint is calibrated, as on a real one: recordings at work, not
/// the truth.
struct SimulatedCalibration {
  std::uint64_t seed = 1000;
  double training_s = 2400.0;     ///< length of the training recordings together, with a load cell
  double fault_free_hours = 3.2;  ///< for the thresholds
  double false_alarms_per_hour = 1e-4;
  double least_threshold_share = 0.12;  ///< smallest threshold over the largest torque of the work
  double required_share = 0.2;          ///< likewise: the disagreement that has to be found
  /// Specimen whose spring was calibrated; the joint's own is another one, or has another variant.
  unsigned spring_serial = 3;
};

/// Identifies a calibration that is repeated instead of read from a file, for
/// `CampaignGroup::monitor_hash`: equal settings of one release give equal monitors.
[[nodiscard]] std::string calibration_hash(const SimulatedCalibration& settings);

/// Sources, their models and the limits of their monitor.
struct SimulatedMonitor {
  std::vector<FittedSource> sources;
  CalibratedMonitor calibrated;

  /// With the error bars of the calibration.
  [[nodiscard]] std::vector<SourceModel> models() const;
  [[nodiscard]] MonitoredTorque monitored() const;
};

/// Writes the monitor file and, beside it, its models as NAME.SOURCE.safetensors, NAME the part of
/// the file's name before ".monitor.json". @throws Error if one cannot be written.
void save_simulated_monitor(const std::filesystem::path& path, const SimulatedMonitor& monitor,
                            const std::string& device_serial);

/// Trains the sources of the joint on recordings at work (`duty_recording`), the spring on those of
/// another specimen, with error bars from recordings of this one at other temperatures, and chooses
/// the thresholds from further recordings. @throws Error, Cancelled.
[[nodiscard]] SimulatedMonitor calibrate_simulated(const DataSheet& joint,
                                                   const SimulatedCalibration& settings = {},
                                                   const Progress& progress = {});

}  // namespace torsio

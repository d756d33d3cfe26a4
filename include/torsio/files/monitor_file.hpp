#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "torsio/core/estimate.hpp"
#include "torsio/core/provenance.hpp"
#include "torsio/estimate/monitored_torque.hpp"
#include "torsio/safety/monitor.hpp"
#include "torsio/safety/redundancy.hpp"

namespace torsio {

/// The version of monitor files that this release writes and reads.
inline constexpr int kMonitorFormatVersion = 1;

/// A model that a monitor was calibrated with.
struct MonitoredModel {
  std::string file;  ///< relative to the folder of the monitor file
  std::string hash;  ///< `model_hash` of its bytes
  bool operator==(const MonitoredModel&) const = default;
};

/// The models of one source.
struct MonitoredSource {
  MonitoredModel torque;
  MonitoredModel friction = {};  ///< friction of a drive; without a file: none
  double error_bar_factor = 1.0;
  bool operator==(const MonitoredSource&) const = default;
};

/// Sources, limits and what the limits rest on. Plain data.
struct MonitorFile {
  std::string device_serial;            ///< actuator that was calibrated; empty: any
  std::string valid_until;              ///< the last day, as 2027-11-22; empty: no end
  std::vector<MonitoredSource> models;  ///< one for each source
  RedundancySettings redundancy;
  MonitorSettings monitor;
  double fault_free_hours = 0.0;
  double false_alarms_per_hour = kNotMeasured;  ///< for which the thresholds were chosen
  bool is_extrapolated = false;                 ///< fault_free_hours do not support that rate
  std::vector<Source> recordings;               ///< the fault-free ones
};

/// Whether a text is a day of the calendar, as 2027-11-22. Such texts compare as the days do.
[[nodiscard]] bool is_date(std::string_view text) noexcept;
/// Today in that form, by the clock of the machine (UTC).
[[nodiscard]] std::string today();

/// 16 hexadecimal digits that identify the bytes of a model file. Not cryptographic: it finds a
/// file that was replaced or changed by mistake.
[[nodiscard]] std::string model_hash(const std::filesystem::path& model);

/// Writes a monitor file (JSON, docs/robot/safety.md) completely or not at all.
void save_monitor(const std::filesystem::path& path, const MonitorFile& file);

/// @throws Error naming the entry: not JSON, another version, an entry that is missing, unknown or
/// another kind of value, a pair of sources that is missing or listed twice, or numbers that `Redundancy` or `Monitor` refuse.
[[nodiscard]] MonitorFile read_monitor(const std::filesystem::path& path);

/// The conditions under which a robot uses a monitor file.
struct MonitorFileOptions {
  double rate_Hz = kNotMeasured;  ///< rate of the loop; NaN: that of the file
  /// Serial number of the device, which the file must then state; empty: a monitor of any device is
  /// taken.
  std::string serial = {};
  std::string today = {};  ///< as 2026-11-22; empty: by the clock of the machine
};

/// Reads a monitor file and its models, for the robot.
/// @throws Error as `read_monitor` and `load_model`; also if the file belongs to another device or
/// has expired, if a model is not the one that the limits were calibrated with, or for a loop at
/// another rate, for which the limits do not hold.
[[nodiscard]] MonitoredTorque load_monitor(const std::filesystem::path& path,
                                           const MonitorFileOptions& options = {});

}  // namespace torsio

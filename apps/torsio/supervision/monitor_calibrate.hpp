#pragma once

#include <string>
#include <vector>

#include "common/data_flags.hpp"
#include "common/output.hpp"
#include "evaluate/monitor/monitor_from_models.hpp"

/// The flags of `torsio monitor --calibrate`.
struct CalibrateFlags {
  std::vector<std::string> sources;  ///< NAME=MODEL:PART+PART
  std::vector<std::string> signals;
  std::string output;
  std::string device_serial;
  std::string valid_until;
  double false_alarms_per_hour = 1.0;
  bool extrapolate = false;
  std::string least_threshold;  ///< with unit; empty: none
  std::string required;         ///< likewise
  std::string persistence;      ///< with unit; empty: that of the library
};

/// Recordings are read with the mapping of the models, unless an option gives another.
/// @throws torsio::Error if they were trained with different ones.
void use_common_mapping(DataFlags& data, const std::vector<torsio::ModelMapping>& models);

/// Writes a monitor file from fault-free recordings.
void calibrate(CalibrateFlags& flags, DataFlags& data, const JsonOutput& json);

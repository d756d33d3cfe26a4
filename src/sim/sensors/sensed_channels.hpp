#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "sim/sensors/sensor_set.hpp"
#include "torsio/actuator/data_sheet.hpp"

namespace torsio {

/// A logged channel and its field in a measurement: this table defines the log and the channel
/// names of faults.
struct SensedChannel {
  std::string_view name;
  double Measurement::*value;
  bool Measurement::*is_fresh;
  double scale = 1.0;  ///< channel = scale * measurement
};

/// What the logger of this actuator writes down; the torque is the last.
/// @param is_electrical the plant has an electrical drive, whose sensors are logged as well
[[nodiscard]] std::vector<SensedChannel> sensed_channels(const DataSheet& sheet,
                                                         bool is_electrical = false);

/// Looks up its channels with these names, in the order of the names.
/// @throws Error naming the first that this actuator's sensors do not measure.
[[nodiscard]] std::vector<SensedChannel> sensed_inputs(const DataSheet& sheet,
                                                       const std::vector<std::string>& names,
                                                       std::string_view place,
                                                       bool is_electrical = false);

}  // namespace torsio

#pragma once

#include <cstddef>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "sim/sensors/sensed_channels.hpp"
#include "sim/sensors/sensor_set.hpp"
#include "sim/sensors/truth_channels.hpp"
#include "torsio/actuator/data_sheet.hpp"
#include "torsio/data/recording.hpp"

namespace torsio {

/// What the bench of one actuator writes down: the channels of its sensors, and on request the
/// `truth_` ones.
class BenchLog {
 public:
  /// @param ticks of the bench's loop in the whole run; a logger may be slower
  /// @param command_channels what is commanded, logged after the sensors
  BenchLog(const DataSheet& sheet, std::size_t ticks, bool with_truth, bool is_electrical = false,
           const std::vector<std::string>& command_channels = {});

  /// Call at every tick. @param commanded one value at least for each of the command channels
  void add(const Measurement& measured, const BenchTruth& truth,
           std::span<const double> commanded = {});
  /// A channel whose sensor delivered for each sample has no freshness, except the load cell's.
  [[nodiscard]] Recording finish(std::string name);

 private:
  struct Sensed {
    SensedChannel source;
    Channel channel;
    bool is_fresh = false;  ///< the sensor delivered since the last sample
  };
  struct Truth {
    Channel channel;
    std::function<double(const BenchTruth&)> value;
  };

  double rate_Hz_;
  std::size_t ticks_a_sample_;
  std::size_t tick_ = 0;
  std::vector<Sensed> sensed_;  ///< the torque is the last
  std::vector<Channel> commands_;
  std::vector<Truth> truth_;
};

}  // namespace torsio

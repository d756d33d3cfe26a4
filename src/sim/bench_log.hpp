#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "torsio/actuator/data_sheet.hpp"
#include "torsio/data/recording.hpp"
#include "torsio/sim/plant.hpp"
#include "torsio/sim/sensor_set.hpp"

namespace torsio {

/// What the bench of one actuator writes down: the channels of its paper, and on request the
/// `truth_` ones. Grows by one sample a call.
class BenchLog {
 public:
  BenchLog(const DataSheet& sheet, std::size_t samples, bool with_truth);

  /// @param is_torque_fresh whether the load cell delivered since the last call
  void add(const Measurement& measured, bool is_torque_fresh, const Plant& plant, double torque_Nm);
  [[nodiscard]] Recording finish(std::string name);

 private:
  struct Sensed {
    Channel channel;
    double Measurement::*value;
    double scale = 1.0;
  };
  struct Truth {
    Channel channel;
    double (*value)(const Plant& plant);
  };
  void sense(std::string name, double Measurement::*value, double scale = 1.0);
  void tell(std::string_view name, double (*value)(const Plant& plant));
  void add_sensed_channels(const DataSheet& sheet);
  void add_truth_channels(const DataSheet& sheet);

  double rate_Hz_;
  std::vector<Sensed> sensed_;  ///< the torque is the last
  std::vector<Truth> truth_;
  std::vector<double> truth_torque_Nm_;
  std::vector<std::uint8_t> fresh_;
};

}  // namespace torsio

#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "numerics/metrics_accumulator.hpp"
#include "sim/arm/arm_bench.hpp"
#include "sim/sensors/sensed_channels.hpp"
#include "torsio/arm/arm_controller.hpp"
#include "torsio/sim/arm/arm_run.hpp"

namespace torsio {

/// What an arm's logger writes down, tick by tick, and the scores of its joints.
class ArmLog {
 public:
  /// @param has_plate the force of a plate is recorded
  ArmLog(const ArmSetup& setup, bool with_truth, bool has_plate);

  /// The sensors and the true torques at this tick, before the arm moves on.
  void see(const ArmBench& bench);
  /// The same tick with what the controller made of it.
  /// @param is_position whether the links are to be at the angles of `wanted`
  void add(const ArmBench& bench, const ArmController::Output& output, const ArmReference& wanted,
           bool is_position);
  /// The largest force of the plate in the same tick.
  void add_plate(double force_N) {
    if (has_plate_) plate_N_.push_back(force_N);
  }
  [[nodiscard]] std::size_t size() const noexcept { return ticks_; }
  void finish(ArmRun& run) &&;

 private:
  struct Column {
    std::string name;
    std::vector<double> values = {};
  };
  /// The true values of one joint at the tick that was seen.
  struct Truth {
    double angle_rad = 0.0;
    double torque_Nm = 0.0;
    double external_Nm = 0.0;
  };
  struct Joint {
    std::vector<SensedChannel> channels;
    std::vector<Column> sensed = {};
    std::vector<std::uint8_t> torque_fresh = {};
    std::vector<Column> control = {};
    Truth truth = {};
    double rating_Nm = 0.0;
    ArmJointScore score = {};
    double squared_position = 0.0;
    std::size_t positions = 0;
    double squared_torque = 0.0;
    double squared_external = 0.0;
    std::size_t scored = 0;
  };
  void score(Joint& joint, const ArmController::JointOutput& output, double wanted_rad,
             bool is_position) const;

  std::string name_;
  bool with_truth_;
  bool has_plate_;
  std::vector<double> plate_N_;
  std::vector<Joint> joints_;
  std::size_t ticks_ = 0;
};

}  // namespace torsio

#include "sim/arm/arm_log.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <utility>

#include "sim/arm/joint_channels.hpp"

namespace torsio {
namespace {

constexpr std::size_t kSettled = 500;  // ticks after which filters are no longer scored

constexpr std::array kControlNames{"wanted_angle_rad",
                                   "wanted_torque_Nm",
                                   "command_current_A",
                                   "estimated_torque_Nm",
                                   "estimated_torque_std_Nm",
                                   "external_torque_Nm",
                                   "fault_1",
                                   "truth_angle_rad",
                                   "truth_torque_Nm",
                                   "truth_external_torque_Nm"};
constexpr std::size_t kTruthNames = 3;

std::optional<double> root_mean(double squares, std::size_t count) {
  if (count == 0) return {};
  return std::sqrt(squares / static_cast<double>(count));
}

}  // namespace

ArmLog::ArmLog(const ArmSetup& setup, bool with_truth, bool has_plate)
    : name_(setup.arm.name), with_truth_(with_truth), has_plate_(has_plate) {
  for (std::size_t j = 0; j < setup.joints.size(); ++j) {
    const DataSheet& sheet = setup.joints[j].sheet;
    Joint& joint = joints_.emplace_back(Joint{.channels = sensed_channels(sheet)});
    for (const SensedChannel& channel : joint.channels)
      joint.sensed.push_back({.name = std::string(channel.name)});
    for (std::size_t i = 0; i < kControlNames.size() - (with_truth ? 0 : kTruthNames); ++i)
      joint.control.push_back({.name = kControlNames[i]});
    joint.rating_Nm = sheet.rating.torque_Nm.value;
    joint.score = {.joint = setup.arm.joints[j].name, .actuator = full_name(sheet)};
  }
}

void ArmLog::see(const ArmBench& bench) {
  for (std::size_t j = 0; j < joints_.size(); ++j)
    joints_[j].truth = {.angle_rad = bench.plant().state(j).joint_angle_rad,
                        .torque_Nm = bench.plant().torques(j).joint_Nm,
                        .external_Nm = bench.plant().external_torque(j)};
}

void ArmLog::score(Joint& joint, const ArmController::JointOutput& output, double wanted_rad,
                   bool is_position) const {
  const double torque_Nm = std::abs(joint.truth.torque_Nm);
  joint.score.largest_torque_Nm = std::max(joint.score.largest_torque_Nm, torque_Nm);
  if (output.limit != JointCascade::Limit::none) joint.score.limited_s += 1.0 / kBenchRate_Hz;
  if (ticks_ < kSettled) return;
  const auto square = [](double value) { return value * value; };
  joint.squared_torque += square(output.link_Nm - joint.truth.torque_Nm);
  joint.squared_external += square(output.external_Nm - joint.truth.external_Nm);
  ++joint.scored;
  if (!is_position) return;
  joint.squared_position += square(wanted_rad - joint.truth.angle_rad);
  ++joint.positions;
}

void ArmLog::add(const ArmBench& bench, const ArmController::Output& output,
                 const ArmReference& wanted, bool is_position) {
  for (std::size_t j = 0; j < joints_.size(); ++j) {
    Joint& joint = joints_[j];
    const Measurement& measured = bench.measured(j);
    for (std::size_t i = 0; i < joint.channels.size(); ++i)
      joint.sensed[i].values.push_back(joint.channels[i].scale * measured.*joint.channels[i].value);
    joint.torque_fresh.push_back(measured.is_torque_fresh ? 1 : 0);
    const ArmController::JointOutput& out = output.joints[j];
    const std::array<double, kControlNames.size()> row{
        wanted.position_rad[j],
        out.wanted_Nm,
        out.current_A,
        out.torque.value,
        std::isfinite(out.torque.std_dev) ? out.torque.std_dev : 0.0,
        out.external_Nm,
        static_cast<double>(out.torque.fault),
        joint.truth.angle_rad,
        joint.truth.torque_Nm,
        joint.truth.external_Nm};
    for (std::size_t i = 0; i < joint.control.size(); ++i)
      joint.control[i].values.push_back(row[i]);
    score(joint, out, wanted.position_rad[j], is_position);
  }
  ++ticks_;
}

std::string ArmRun::joint_channel(std::size_t joint, std::string_view channel) const {
  return joint_prefix(scores[joint].joint) + std::string(channel);
}

void ArmLog::finish(ArmRun& run) && {
  for (Joint& joint : joints_) {
    Recording own(joint.score.joint, kBenchRate_Hz);
    const std::string before = joint_prefix(joint.score.joint);
    for (std::size_t i = 0; i < joint.sensed.size(); ++i) {
      Channel channel{.name = joint.sensed[i].name, .values = std::move(joint.sensed[i].values)};
      if (i + 1 == joint.sensed.size()) channel.fresh = joint.torque_fresh;  // the torque's
      run.record.add({.name = before + channel.name, .values = channel.values});
      own.add(std::move(channel));
    }
    for (Column& column : joint.control) {
      // "truth_" stays in front, so that no model takes it for a measurement.
      const bool is_truth = column.name.starts_with(kTruthPrefix);
      const std::string name =
          is_truth ? std::string(kTruthPrefix) + before + column.name.substr(kTruthPrefix.size())
                   : before + column.name;
      run.record.add({.name = name, .values = column.values});
      if (is_truth) own.add({.name = column.name, .values = std::move(column.values)});
    }
    run.joints.push_back(std::move(own));
    ArmJointScore score = std::move(joint.score);
    score.position_rmse_rad = root_mean(joint.squared_position, joint.positions);
    score.torque_rmse_Nm = root_mean(joint.squared_torque, joint.scored);
    score.external_rmse_Nm = root_mean(joint.squared_external, joint.scored);
    score.largest_share = score.largest_torque_Nm / joint.rating_Nm;
    run.scores.push_back(std::move(score));
  }
  if (has_plate_) run.record.add({.name = "plate_force_N", .values = std::move(plate_N_)});
}

}  // namespace torsio

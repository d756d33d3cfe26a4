#include "sim/arm/arm_session.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "torsio/core/error.hpp"

namespace torsio {
namespace {

constexpr double kLongestStart_s = 5.0;  // until the brakes are open

}  // namespace

ArmSession::ArmSession(const ArmSetup& setup, ArmController::Settings settings, FirstStageForm form,
                       std::span<const FaultSchedule> faults, std::uint64_t seed,
                       std::span<const double> start_rad)
    : setup_(setup),
      bench_(setup, form, faults, seed, start_rad),
      controller_(std::move(settings), kBenchRate_Hz),
      commands_(setup.joints.size()),
      angle_rad_(start_rad.begin(), start_rad.end()),
      speed_rad_s_(setup.joints.size(), 0.0) {}

void ArmSession::open_brakes() {
  ArmReference hold;
  std::ranges::copy(angle_rad_, hold.position_rad.begin());
  bool is_released = false;
  for (bool is_ready = false; !is_ready;) {
    const auto& output = control(hold);
    act({});
    is_ready = output.is_ready;
    if (is_released && output.cause != ArmStopCause::none)
      throw Error(
          {.place = fmt::format("joint '{}'", setup_.arm.joints[output.joint].name),
           .problem = "the arm was stopped before it was ready: " + stop_reason(output),
           .advice = output.cause == ArmStopCause::monitor
                         ? "Calibrate its monitor with recordings of this joint in this arm."
                         : ""});
    if (time_s() > kLongestStart_s)
      throw Error({.place = setup_.arm.name,
                   .problem = fmt::format("the joints did not take over their loads within {:g} s "
                                          "after the start",
                                          kLongestStart_s)});
    if (!is_released) is_released = controller_.release();
  }
  bench_.start_clock();
}

std::string ArmSession::stop_reason(const ArmController::Output& output) const {
  if (output.cause != ArmStopCause::monitor) return std::string(name(output.cause));
  const Monitor& monitor = controller_.monitored(output.joint)->monitor();
  if (monitor.state() != Monitor::State::stopped)
    return "its monitor is not ready; while the arm holds, its sources differ or are not settled";
  return describe(monitor.reason(), monitor.settings());
}

const ArmController::Output& ArmSession::control(const ArmReference& wanted) {
  bench_.sense();
  for (std::size_t j = 0; j < angle_rad_.size(); ++j)
    if (std::isfinite(bench_.samples()[j].joint_angle_rad))
      angle_rad_[j] = bench_.samples()[j].joint_angle_rad;
  const auto& output = controller_.step(wanted, bench_.samples());
  for (std::size_t j = 0; j < commands_.size(); ++j) {
    const ArmController::JointOutput& joint = output.joints[j];
    commands_[j] = {joint.current_A, joint.is_powered, joint.is_brake_open};
    speed_rad_s_[j] = joint.speed_rad_s;
  }
  return output;
}

}  // namespace torsio

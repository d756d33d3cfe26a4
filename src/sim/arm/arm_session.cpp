#include "sim/arm/arm_session.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
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
  for (bool is_running = false; !is_running;) {
    if (time_s() > kLongestStart_s)
      throw Error({.place = setup_.arm.name,
                   .problem = fmt::format("the joints did not take over their loads within {:g} s "
                                          "after the start",
                                          kLongestStart_s)});
    const auto& output = control(hold);
    act({});
    is_running = std::ranges::all_of(
        std::span(output.joints).first(commands_.size()),
        [](const auto& joint) { return joint.phase == JointStop::Phase::running; });
    if (!is_released) is_released = controller_.release();
  }
  bench_.start_clock();
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
    MonitoredTorque* const monitored = controller_.monitored(j);
    if (monitored != nullptr && monitored->monitor().state() == Monitor::State::ready)
      monitored->monitor().arm(bench_.samples()[j].t_s);
  }
  return output;
}

}  // namespace torsio

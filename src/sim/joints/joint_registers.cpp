#include "sim/joints/joint_registers.hpp"

#include "sim/joints/linked_arm.hpp"
#include "torsio/safety/monitor.hpp"

namespace torsio {
namespace {

constexpr double kLargestGainFactor = 10.0;  // over the default

/// A register that is read by `Get`, a function of the served joint.
template <auto Get>
LinkRegister reading(ServedJoint& of, LinkRegister described) {
  described.type = LinkValue::of(Get(of)).type;
  described.get = [](const void* context) noexcept {
    return LinkValue::of(Get(*static_cast<const ServedJoint*>(context)));
  };
  described.context = &of;
  return described;
}

using Limits = LinkedJoint::Limits;

template <double Limits::*Value>
LinkRegister limit(ServedJoint& of, LinkRegister described) {
  described.access = LinkAccess::write_when_disabled;
  described.set = [](void* context, const LinkValue& value) noexcept {
    LinkedJoint& joint = *static_cast<ServedJoint*>(context)->joint;
    Limits limits = joint.limits();
    limits.*Value = value.float64;
    return joint.set_limits(limits);
  };
  return reading<[](const ServedJoint& from) { return from.joint->limits().*Value; }>(of,
                                                                                      described);
}

using Gains = JointCascade::Gains;

template <auto Value>
LinkRegister gain(ServedJoint& of, LinkRegister described) {
  Gains present = of.joint->gains();
  described.access = LinkAccess::write;
  described.lowest = 0.0;
  described.highest = kLargestGainFactor * Value(present);
  described.set = [](void* context, const LinkValue& value) noexcept {
    LinkedJoint& joint = *static_cast<ServedJoint*>(context)->joint;
    Gains gains = joint.gains();
    Value(gains) = value.float64;
    return joint.set_gains(gains);
  };
  return reading<[](const ServedJoint& from) {
    Gains gains = from.joint->gains();
    return double{Value(gains)};
  }>(of, described);
}

template <double LinkedJoint::Impedance::*Value>
LinkRegister impedance(ServedJoint& of, LinkRegister described) {
  described.access = LinkAccess::write;
  return variable_register(described, of.joint->impedance.*Value);
}

std::string_view monitor_state(const ServedJoint& of) {
  const MonitoredTorque* const monitored =
      of.joint->arm().controller().monitored(of.joint->index());
  return monitored == nullptr ? "none" : name(monitored->monitor().state());
}

void add_identity(ServedJoint& of, std::vector<LinkRegister>& all) {
  all.push_back(reading<[](const ServedJoint& from) { return from.joint->identity().actuator; }>(
      of, {.name = "actuator", .description = "actuator, variant and serial number"}));
  all.push_back(reading<[](const ServedJoint& from) { return from.joint->model(); }>(
      of, {.name = "model", .description = "model of the torque"}));
  all.push_back(reading<[](const ServedJoint& from) { return from.joint->drive().ratio; }>(
      of, {.name = "gear_ratio",
           .unit = "1",
           .description = "turns of the rotor per turn of the joint"}));
  all.push_back(reading<[](const ServedJoint& from) { return from.joint->stiffness_Nm_rad(); }>(
      of,
      {.name = "spring_stiffness_Nm_rad", .unit = "Nm/rad", .description = "of the data sheet"}));
  all.push_back(
      reading<[](const ServedJoint& from) { return from.joint->sheet().rating.torque_Nm.value; }>(
          of, {.name = "rated_torque_Nm", .unit = "Nm", .description = "of the data sheet"}));
  all.push_back(
      reading<[](const ServedJoint& from) { return from.joint->sheet().rating.speed_rad_s.value; }>(
          of, {.name = "rated_speed_rad_s", .unit = "rad/s", .description = "of the data sheet"}));
  all.push_back(
      reading<[](const ServedJoint& from) { return from.joint->drive().rated_current_A; }>(
          of, {.name = "rated_current_A", .unit = "A", .description = "of the data sheet"}));
  all.push_back(reading<[](const ServedJoint& from) { return from.joint->drive().peak_current_A; }>(
      of,
      {.name = "peak_current_A", .unit = "A", .description = "largest current of a reference"}));
}

void add_parameters(ServedJoint& of, std::vector<LinkRegister>& all) {
  const Limits& largest = of.joint->largest_limits();
  all.push_back(limit<&Limits::lowest_rad>(of, {.name = "lowest_angle_rad",
                                                .unit = "rad",
                                                .description = "lower limit of the position",
                                                .lowest = largest.lowest_rad,
                                                .highest = largest.highest_rad}));
  all.push_back(limit<&Limits::highest_rad>(of, {.name = "highest_angle_rad",
                                                 .unit = "rad",
                                                 .description = "upper limit of the position",
                                                 .lowest = largest.lowest_rad,
                                                 .highest = largest.highest_rad}));
  all.push_back(limit<&Limits::speed_rad_s>(of, {.name = "largest_speed_rad_s",
                                                 .unit = "rad/s",
                                                 .description = "limit of the speed",
                                                 .lowest = 0.0,
                                                 .highest = largest.speed_rad_s}));
  all.push_back(limit<&Limits::torque_Nm>(of, {.name = "largest_torque_Nm",
                                               .unit = "Nm",
                                               .description = "limit of the wanted torque",
                                               .lowest = 0.0,
                                               .highest = largest.torque_Nm}));
  all.push_back(gain<[](Gains& from) -> double& { return from.position_1_s; }>(
      of,
      {.name = "position_gain_1_s", .unit = "1/s", .description = "of the position controller"}));
  all.push_back(gain<[](Gains& from) -> double& { return from.velocity.proportional; }>(
      of, {.name = "velocity_gain_As_rad",
           .unit = "As/rad",
           .description = "of the velocity controller"}));
  all.push_back(gain<[](Gains& from) -> double& { return from.velocity.integral; }>(
      of,
      {.name = "velocity_integral_A_rad", .unit = "A/rad", .description = "gain of its integral"}));
  using Impedance = LinkedJoint::Impedance;
  all.push_back(impedance<&Impedance::stiffness_Nm_rad>(
      of, {.name = "impedance_stiffness_Nm_rad",
           .unit = "Nm/rad",
           .description = "until a reference has its own; its largest is that of the spring",
           .lowest = 0.0,
           .highest = of.joint->stiffness_Nm_rad()}));
  all.push_back(
      impedance<&Impedance::damping_Nms_rad>(of, {.name = "impedance_damping_Nms_rad",
                                                  .unit = "Nms/rad",
                                                  .description = "until a reference has its own",
                                                  .lowest = 0.0,
                                                  .highest = of.joint->highest_damping_Nms_rad()}));
}

void add_states(ServedJoint& of, std::vector<LinkRegister>& all) {
  all.push_back(reading<[](const ServedJoint& from) { return from.watchdog_s; }>(
      of,
      {.name = "watchdog_s", .unit = "s", .description = "longest time without a motion command"}));
  all.push_back(reading<[](const ServedJoint& from) { return name(from.joint->output().phase); }>(
      of, {.name = "stop_phase", .description = "of the brake and the stop"}));
  all.push_back(
      reading<[](const ServedJoint& from) { return name(from.joint->arm().output().cause); }>(
          of, {.name = "stop_cause", .description = "why the joint or its arm is stopped"}));
  all.push_back(reading<&monitor_state>(
      of, {.name = "monitor", .description = "state of the monitor of redundant torques"}));
  all.push_back(reading<[](const ServedJoint& from) { return from.joint->output().thermal_load; }>(
      of, {.name = "thermal_load_1",
           .unit = "1",
           .description = "of the winding: 0 cold, 1 as hot as it may be"}));
}

/// 32 bits: it wraps.
template <auto Get>
LinkRegister counter(ServedJoint& of, std::string_view name, std::string_view description) {
  return reading<[](const ServedJoint& from) {
    return from.endpoint ? static_cast<std::uint32_t>(Get(from.endpoint->counts())) : 0U;
  }>(of, {.name = name, .description = description});
}

using Counts = JointEndpoint::Counts;

void add_counters(ServedJoint& of, std::vector<LinkRegister>& all) {
  all.push_back(counter<[](const Counts& from) { return from.executed; }>(of, "executed_commands",
                                                                          "references included"));
  all.push_back(counter<[](const Counts& from) { return from.all_refused(); }>(
      of, "refused_messages", "replied to or not"));
  all.push_back(counter<[](const Counts& from) { return from.stops; }>(
      of, "stops", "messages that request one"));
  all.push_back(counter<[](const Counts& from) { return from.unknown; }>(
      of, "unknown_messages", "of another id than those of the link"));
  all.push_back(counter<[](const Counts& from) { return from.not_sent; }>(
      of, "frames_not_sent", "the line did not take them"));
}

void add_motor(ServedJoint& of, std::vector<LinkRegister>& all) {
  all.push_back(
      reading<[](const ServedJoint& from) { return from.joint->drive().torque_constant_Nm_A; }>(
          of, {.name = "torque_constant_Nm_A",
               .unit = "Nm/A",
               .description = "at the rotor, of the data sheet"}));
  all.push_back(reading<[](const ServedJoint& from) { return from.joint->drive().supply_V; }>(
      of, {.name = "supply_V", .unit = "V", .description = "of the data sheet; does not vary"}));
}

}  // namespace

std::vector<LinkRegister> joint_registers(ServedJoint& of) {
  std::vector<LinkRegister> all;
  add_identity(of, all);
  add_parameters(of, all);
  add_states(of, all);
  add_counters(of, all);
  add_motor(of, all);
  return all;
}

}  // namespace torsio

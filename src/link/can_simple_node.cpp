#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <charconv>
#include <cmath>
#include <cstring>
#include <limits>
#include <numbers>
#include <utility>

#include "core/checks.hpp"
#include "torsio/link/can_simple.hpp"

namespace torsio {
namespace {

static_assert(std::endian::native == std::endian::little, "frames have the machine's byte order");

constexpr double kTurn_rad = 2.0 * std::numbers::pi;
constexpr double kFeedForwardUnit =
    1e-3;  ///< turns/s and Nm of the 16-bit numbers of Set_Input_Pos
constexpr std::uint8_t kProtocolVersion = 2;

template <class Number>
Number number_at(std::span<const std::uint8_t> data, std::size_t offset) noexcept {
  Number value{};
  std::memcpy(&value, data.data() + offset, sizeof(value));
  return value;
}

double float_at(std::span<const std::uint8_t> data, std::size_t offset) noexcept {
  return double{number_at<float>(data, offset)};
}

/// Writes numbers one after the other.
class FrameWriter {
 public:
  FrameWriter(std::uint8_t node, CanSimpleCommand command) noexcept {
    frame_.id = can_simple_id(node, command);
  }
  template <class Number>
  FrameWriter& add(Number value) noexcept {
    std::memcpy(frame_.data.data() + frame_.size, &value, sizeof(value));
    frame_.size = static_cast<std::uint8_t>(frame_.size + sizeof(value));
    return *this;
  }
  FrameWriter& add_float(double value) noexcept { return add(static_cast<float>(value)); }
  [[nodiscard]] const CanFrame& frame() const noexcept { return frame_; }

 private:
  CanFrame frame_ = {};
};

/// Major, minor and revision of "0.2.0".
std::array<std::uint8_t, 3> version_numbers(std::string_view text) noexcept {
  std::array<std::uint8_t, 3> numbers = {};
  const char* at = text.data();
  const char* const end = at + text.size();
  for (std::uint8_t& each : numbers) {
    at = std::from_chars(at, end, each).ptr;
    if (at == end || *at != '.') break;
    ++at;
  }
  return numbers;
}

/// A command that only asks for a frame.
bool is_request(CanSimpleCommand command) noexcept {
  switch (command) {
    case CanSimpleCommand::get_version:
    case CanSimpleCommand::heartbeat:
    case CanSimpleCommand::get_error:
    case CanSimpleCommand::get_encoder_estimates:
    case CanSimpleCommand::get_iq:
    case CanSimpleCommand::get_temperature:
    case CanSimpleCommand::get_bus_voltage_current:
    case CanSimpleCommand::get_torques:
    case CanSimpleCommand::get_powers: return true;
    default: return false;
  }
}

bool is_reserved(CanSimpleCommand command) noexcept {
  switch (static_cast<std::uint8_t>(command)) {
    case 0x08:
    case 0x0A:
    case 0x10:
    case 0x1E: return true;
    default: return false;
  }
}

std::size_t shortest_length(CanSimpleCommand command) noexcept {
  switch (command) {
    case CanSimpleCommand::set_axis_state:
    case CanSimpleCommand::set_input_torque: return 4;
    case CanSimpleCommand::set_controller_mode:
    case CanSimpleCommand::set_input_pos:
    case CanSimpleCommand::set_input_vel:
    case CanSimpleCommand::set_limits: return 8;
    default: return 0;
  }
}

JointMode joint_mode(CanSimpleControlMode mode) noexcept {
  switch (mode) {
    case CanSimpleControlMode::torque: return JointMode::torque;
    case CanSimpleControlMode::velocity: return JointMode::velocity;
    default: return JointMode::position;
  }
}

bool fits_float(double value) noexcept {
  return std::abs(value) <= double{std::numeric_limits<float>::max()};
}

std::uint32_t error_of(LinkStateReason reason) noexcept {
  switch (reason) {
    case LinkStateReason::none: break;
    case LinkStateReason::requested: return CanSimpleError::kEstopRequested;
    case LinkStateReason::host_lost: return CanSimpleError::kWatchdogTimerExpired;
    case LinkStateReason::host_released: return CanSimpleError::kMissingInput;
    case LinkStateReason::clock: return CanSimpleError::kTimingError;
    case LinkStateReason::joint_fault: break;
  }
  return CanSimpleError::kSystemLevel;
}

std::uint32_t period_ticks(double tick_rate_Hz, double rate_Hz, std::string_view place,
                           std::string_view what) {
  require(rate_Hz >= 0.0 && rate_Hz <= tick_rate_Hz, ErrorPlace(place, what),
          fmt::format("0 to {} Hz", tick_rate_Hz), rate_Hz);
  if (rate_Hz == 0.0) return 0;
  return static_cast<std::uint32_t>(std::min(std::round(tick_rate_Hz / rate_Hz), 4e9));
}

}  // namespace

CanSimpleNode::CanSimpleNode(const Settings& settings, JointEndpoint& endpoint,
                             const LinkJoint& joint, const RegisterTable& registers, CanSink& bus)
    : settings_(settings),
      endpoint_(endpoint),
      joint_(joint),
      registers_(registers),
      bus_(bus),
      supply_(registers.find("supply_V")),
      torque_constant_(registers.find("torque_constant_Nm_A")),
      largest_speed_(registers.find("largest_speed_rad_s")),
      largest_torque_(registers.find("largest_torque_Nm")),
      stop_cause_(registers.find("stop_cause")),
      speed_(settings.tick_rate_Hz, settings.speed_cutoff_Hz) {
  const std::string place = fmt::format("CAN node {}", settings.node);
  require(settings.node <= kCanSimpleLastNode, place,
          fmt::format("a number of 0 to {}", kCanSimpleLastNode), fmt::format("{}", settings.node));
  require(endpoint.bus_host() != kNdlcomReserved, place, "an endpoint with a bus_host", "none");
  const auto names = joint.channels();
  const auto find = [&](std::string_view name) -> std::optional<std::size_t> {
    const auto at = std::ranges::find(names, name);
    if (at == names.end()) return std::nullopt;
    return static_cast<std::size_t>(at - names.begin());
  };
  const auto channel = [&](std::string_view name) {
    const auto found = find(name);
    require(found.has_value(), place, fmt::format("the channel {}", name), "a joint without it");
    return *found;
  };
  channels_ = {.motor_angle = channel("motor_angle_rad"),
               .motor_current = channel("motor_current_A"),
               .command_current = channel("command_current_A"),
               .torque = channel("torque_Nm"),
               .wanted_torque = channel("wanted_torque_Nm"),
               .is_ready = find("is_ready_1")};
  const auto ratio = registers.find("gear_ratio");
  require(ratio.has_value(), place, "the register gear_ratio", "a joint without it");
  gear_ratio_ = number(ratio);
  require(gear_ratio_ != 0.0 && std::isfinite(gear_ratio_), place, "a gear_ratio other than 0",
          gear_ratio_);
  status_period_ticks_ =
      period_ticks(settings.tick_rate_Hz, settings.status_rate_Hz, place, "status_rate_Hz");
  estimate_period_ticks_ =
      period_ticks(settings.tick_rate_Hz, settings.estimate_rate_Hz, place, "estimate_rate_Hz");
  // Nodes of a bus do not all send in the same tick.
  ticks_ = std::uint64_t{settings.node} * 7U;
}

double CanSimpleNode::number(std::optional<std::uint16_t> index) const noexcept {
  LinkValue value;
  if (!index || registers_.read(*index, value) != LinkRefusal::none ||
      value.type != LinkValueType::float64)
    return 0.0;
  return value.float64;
}

void CanSimpleNode::measure() noexcept {
  std::array<float, kLinkChannels> all{};
  joint_.measure(std::span(all).first(joint_.channels().size()));
  values_.position_rad = double{all[channels_.motor_angle]} / gear_ratio_;
  if (std::isfinite(values_.position_rad))
    values_.velocity_rad_s = speed_.step(values_.position_rad);
  else
    speed_.skip();
  values_.current_A = all[channels_.motor_current];
  values_.wanted_current_A = all[channels_.command_current];
  values_.torque_Nm = all[channels_.torque];
  values_.wanted_torque_Nm = all[channels_.wanted_torque];
  values_.is_ready = !channels_.is_ready || all[*channels_.is_ready] != 0.0F;
}

std::uint32_t CanSimpleNode::active_errors() const noexcept {
  const DriveState& drive = endpoint_.drive();
  switch (drive.state()) {
    case LinkDriveState::initialising: return CanSimpleError::kInitializing;
    case LinkDriveState::stop: return error_of(drive.reason());
    case LinkDriveState::fault: break;
    default: return CanSimpleError::kNone;
  }
  LinkValue cause;
  const bool is_measurement = stop_cause_ &&
                              registers_.read(*stop_cause_, cause) == LinkRefusal::none &&
                              cause.type == LinkValueType::text && cause.text == "measurement";
  return is_measurement || !std::isfinite(values_.position_rad) ? CanSimpleError::kMissingEstimate
                                                                : CanSimpleError::kSystemLevel;
}

/// After everything that may change the state, also commands of another line.
void CanSimpleNode::follow_state() noexcept {
  const LinkDriveState state = endpoint_.drive().state();
  if (state == state_) return;
  const LinkDriveState before = std::exchange(state_, state);
  waiting_since_ns_.reset();
  if (state == LinkDriveState::enabled) {
    result_ = CanSimpleResult::busy;
    disarm_reason_ = CanSimpleError::kNone;
    inputs_ = {};
  } else if (state == LinkDriveState::ready) {
    if (before == LinkDriveState::enabled) result_ = CanSimpleResult::success;
  } else {
    disarm_reason_ |= active_errors();
    result_ = CanSimpleResult::disarmed;
  }
}

void CanSimpleNode::tick(std::uint64_t now_ns) noexcept {
  measure();
  follow_state();
  if (waiting_since_ns_ && values_.is_ready) {
    const LinkRefusal refusal = send_reference(inputs_, *waiting_since_ns_, now_ns);
    waiting_since_ns_.reset();
    endpoint_.count_refused(refusal);
    if (refusal != LinkRefusal::none) inputs_ = {};
  }
  send_cyclic();
  ++ticks_;
}

/// Each frame in another tick where the period permits it. A change of the heartbeat is sent at once.
void CanSimpleNode::send_cyclic() noexcept {
  const auto is_due = [this](std::uint32_t period, std::uint64_t offset) {
    return period != 0 && (ticks_ + offset) % period == 0;
  };
  constexpr std::array kEstimates = {CanSimpleCommand::get_encoder_estimates,
                                     CanSimpleCommand::get_iq, CanSimpleCommand::get_torques};
  for (std::size_t k = 0; k < kEstimates.size(); ++k)
    if (is_due(estimate_period_ticks_, k)) static_cast<void>(reply(kEstimates[k]));
  const std::optional<CanFrame> heartbeat = frame_of(CanSimpleCommand::heartbeat);
  if (is_due(status_period_ticks_, 3) || (status_period_ticks_ != 0 && *heartbeat != heartbeat_)) {
    heartbeat_ = *heartbeat;
    static_cast<void>(reply(CanSimpleCommand::heartbeat));
  }
  if (is_due(status_period_ticks_, 4)) static_cast<void>(reply(CanSimpleCommand::get_error));
  if (is_due(status_period_ticks_, 5))
    static_cast<void>(reply(CanSimpleCommand::get_bus_voltage_current));
}

bool CanSimpleNode::reply(CanSimpleCommand command) noexcept {
  const std::optional<CanFrame> frame = frame_of(command);
  if (frame) not_sent_ += bus_.send(*frame) ? 0U : 1U;
  return frame.has_value();
}

/// @returns nothing for a command that asks for no frame, or one that is not offered
std::optional<CanFrame> CanSimpleNode::frame_of(CanSimpleCommand command) const noexcept {
  FrameWriter writer(settings_.node, command);
  switch (command) {
    case CanSimpleCommand::get_version: {
      const auto firmware = version_numbers(joint_.identity().version);
      writer.add(kProtocolVersion).add(std::uint8_t{0}).add(std::uint8_t{0}).add(std::uint8_t{0});
      for (const std::uint8_t each : firmware) writer.add(each);
      writer.add(std::uint8_t{0});
      break;
    }
    case CanSimpleCommand::heartbeat:
      writer.add(active_errors() | disarm_reason_)
          .add(endpoint_.drive().is_enabled() ? CanSimpleAxisState::closed_loop_control
                                              : CanSimpleAxisState::idle)
          .add(result_)
          .add(std::uint16_t{0});
      break;
    case CanSimpleCommand::get_error: writer.add(active_errors()).add(disarm_reason_); break;
    case CanSimpleCommand::get_encoder_estimates:
      writer.add_float(values_.position_rad / kTurn_rad)
          .add_float(values_.velocity_rad_s / kTurn_rad);
      break;
    case CanSimpleCommand::get_iq:
      writer.add(values_.wanted_current_A).add(values_.current_A);
      break;
    case CanSimpleCommand::get_torques:
      writer.add(values_.wanted_torque_Nm).add(values_.torque_Nm);
      break;
    case CanSimpleCommand::get_bus_voltage_current: {
      const double supply_V = number(supply_);
      if (!(supply_V > 0.0)) return std::nullopt;
      const double motor_W = number(torque_constant_) * double{values_.current_A} *
                             values_.velocity_rad_s * gear_ratio_;
      writer.add_float(supply_V).add_float(motor_W / supply_V);
      break;
    }
    default: return std::nullopt;
  }
  return writer.frame();
}

void CanSimpleNode::receive(const CanFrame& frame, std::uint64_t now_ns) noexcept {
  const auto command = static_cast<CanSimpleCommand>(frame.id & 0x1FU);
  LinkRefusal refusal = LinkRefusal::none;
  if (is_request(command)) {
    // A frame with data is the reply of another device that has the same number.
    if (!frame.bytes().empty())
      refusal = LinkRefusal::unknown_message;
    else if (!reply(command))
      refusal = LinkRefusal::not_supported;
  } else if (command == CanSimpleCommand::estop) {
    // Whatever its length, whoever sends it requests a stop.
    endpoint_.stop_for_bus(StopCategory::power_off, now_ns);
  } else if (frame.is_remote) {
    refusal = LinkRefusal::unknown_message;
  } else {
    const auto data = frame.bytes();
    refusal = data.size() < shortest_length(command) ? LinkRefusal::wrong_length
                                                     : execute(command, data, now_ns);
  }
  endpoint_.count_refused(refusal);
  follow_state();
}

LinkRefusal CanSimpleNode::execute(CanSimpleCommand command, std::span<const std::uint8_t> data,
                                   std::uint64_t now_ns) noexcept {
  switch (command) {
    case CanSimpleCommand::set_axis_state: return set_axis_state(data, now_ns);
    case CanSimpleCommand::set_controller_mode: return set_controller_mode(data, now_ns);
    case CanSimpleCommand::set_input_pos:
    case CanSimpleCommand::set_input_vel:
    case CanSimpleCommand::set_input_torque: return set_inputs(command, data, now_ns);
    case CanSimpleCommand::set_limits: return set_limits(data, now_ns);
    case CanSimpleCommand::clear_errors: return clear_errors(now_ns);
    default:
      return is_reserved(command) ? LinkRefusal::unknown_message : LinkRefusal::not_supported;
  }
}

LinkRefusal CanSimpleNode::change_state(LinkStateCommand command, std::uint64_t now_ns) noexcept {
  return endpoint_.execute_for_bus(LinkStateChange{.command = command}, now_ns, now_ns);
}

LinkRefusal CanSimpleNode::set_axis_state(std::span<const std::uint8_t> data,
                                          std::uint64_t now_ns) noexcept {
  const bool is_enabled = endpoint_.drive().is_enabled();
  LinkRefusal refusal = LinkRefusal::none;
  switch (number_at<std::uint32_t>(data, 0)) {
    case static_cast<std::uint32_t>(CanSimpleAxisState::idle):
      if (is_enabled) refusal = change_state(LinkStateCommand::disable, now_ns);
      break;
    case static_cast<std::uint32_t>(CanSimpleAxisState::closed_loop_control):
      refusal =
          change_state(is_enabled ? LinkStateCommand::heartbeat : LinkStateCommand::enable, now_ns);
      break;
    default: result_ = CanSimpleResult::invalid_state; return LinkRefusal::not_supported;
  }
  if (refusal == LinkRefusal::other_host)
    result_ = CanSimpleResult::cancelled;
  else if (refusal != LinkRefusal::none)
    result_ = CanSimpleResult::disarmed;
  return refusal;
}

/// Nothing moves: the joint continues from its present state until the next input. A joint that is not ready for another mode
/// than position gets it with the first input.
LinkRefusal CanSimpleNode::set_controller_mode(std::span<const std::uint8_t> data,
                                               std::uint64_t now_ns) noexcept {
  const auto wanted = number_at<std::uint32_t>(data, 0);
  if (wanted > static_cast<std::uint32_t>(CanSimpleControlMode::position))
    return LinkRefusal::unknown_value;
  const auto mode = static_cast<CanSimpleControlMode>(wanted);
  if (mode == CanSimpleControlMode::voltage ||
      number_at<std::uint32_t>(data, 4) != kCanSimplePassthrough)
    return LinkRefusal::not_supported;
  const LinkRefusal refusal =
      endpoint_.drive().is_enabled() && values_.is_ready
          ? endpoint_.execute_for_bus(LinkModeChange{.mode = joint_mode(mode)}, now_ns, now_ns)
          : change_state(LinkStateCommand::heartbeat, now_ns);
  if (refusal != LinkRefusal::none) return refusal;
  mode_ = mode;
  inputs_ = {};
  waiting_since_ns_.reset();
  return LinkRefusal::none;
}

LinkRefusal CanSimpleNode::set_inputs(CanSimpleCommand command, std::span<const std::uint8_t> data,
                                      std::uint64_t now_ns) noexcept {
  Inputs wanted = inputs_;
  switch (command) {
    case CanSimpleCommand::set_input_pos:
      wanted.position_rad = kTurn_rad * float_at(data, 0);
      wanted.velocity_rad_s = kTurn_rad * kFeedForwardUnit * number_at<std::int16_t>(data, 4);
      wanted.torque_Nm = kFeedForwardUnit * number_at<std::int16_t>(data, 6);
      break;
    case CanSimpleCommand::set_input_vel:
      wanted.velocity_rad_s = kTurn_rad * float_at(data, 0);
      wanted.torque_Nm = float_at(data, 4);
      break;
    default: wanted.torque_Nm = float_at(data, 0); break;
  }
  if (!wanted.position_rad && mode_ == CanSimpleControlMode::position)
    wanted.position_rad = values_.position_rad;
  const double position_rad = wanted.position_rad.value_or(0.0);
  if (!std::isfinite(position_rad + wanted.velocity_rad_s + wanted.torque_Nm))
    return LinkRefusal::not_finite;
  if (!fits_float(position_rad) || !fits_float(wanted.velocity_rad_s))
    return LinkRefusal::out_of_range;
  // What arrives before the brake is open is followed as soon as it is.
  const bool waits = endpoint_.drive().is_enabled() && !values_.is_ready;
  const LinkRefusal refusal = waits ? change_state(LinkStateCommand::heartbeat, now_ns)
                                    : send_reference(wanted, now_ns, now_ns);
  if (refusal != LinkRefusal::none) return refusal;
  inputs_ = wanted;
  if (waits) waiting_since_ns_ = now_ns;
  return LinkRefusal::none;
}

LinkRefusal CanSimpleNode::send_reference(const Inputs& inputs, std::uint64_t arrived_ns,
                                          std::uint64_t now_ns) noexcept {
  LinkReference reference{.deadline_ns = std::numeric_limits<std::uint64_t>::max(),
                          .mode = joint_mode(mode_),
                          .torque_Nm = static_cast<float>(inputs.torque_Nm)};
  if (mode_ != CanSimpleControlMode::torque)
    reference.velocity_rad_s = static_cast<float>(inputs.velocity_rad_s);
  if (mode_ == CanSimpleControlMode::position)
    reference.position_rad = static_cast<float>(inputs.position_rad.value_or(values_.position_rad));
  return endpoint_.execute_for_bus(reference, arrived_ns, now_ns);
}

/// A limit above that of the joint has no effect: that of the joint remains.
LinkRefusal CanSimpleNode::write_at_most(std::uint16_t index, double value,
                                         std::uint64_t now_ns) noexcept {
  const double highest = registers_.registers()[index].highest;
  return endpoint_.execute_for_bus(
      LinkRegisterWrite{.index = index, .value = LinkValue::of(std::min(value, highest))}, now_ns,
      now_ns);
}

LinkRefusal CanSimpleNode::set_limits(std::span<const std::uint8_t> data,
                                      std::uint64_t now_ns) noexcept {
  if (!largest_speed_ || !largest_torque_ || !torque_constant_) return LinkRefusal::not_supported;
  const double speed_rad_s = kTurn_rad * float_at(data, 0);
  const double current_A = float_at(data, 4);
  if (std::isnan(speed_rad_s) || std::isnan(current_A)) return LinkRefusal::not_finite;
  if (!(speed_rad_s > 0.0 && current_A > 0.0)) return LinkRefusal::out_of_range;
  const double torque_Nm = current_A * std::abs(number(torque_constant_) * gear_ratio_);
  const LinkRefusal refusal = write_at_most(*largest_speed_, speed_rad_s, now_ns);
  return refusal == LinkRefusal::none ? write_at_most(*largest_torque_, torque_Nm, now_ns)
                                      : refusal;
}

/// Ends a fault, then a stop.
LinkRefusal CanSimpleNode::clear_errors(std::uint64_t now_ns) noexcept {
  LinkRefusal refusal = LinkRefusal::none;
  if (endpoint_.drive().state() == LinkDriveState::fault)
    refusal = change_state(LinkStateCommand::reset_fault, now_ns);
  if (refusal == LinkRefusal::none && endpoint_.drive().state() == LinkDriveState::stop)
    refusal = change_state(LinkStateCommand::disable, now_ns);
  if (refusal != LinkRefusal::none) return refusal;
  follow_state();
  disarm_reason_ = CanSimpleError::kNone;
  if (result_ == CanSimpleResult::disarmed) result_ = CanSimpleResult::success;
  return LinkRefusal::none;
}

}  // namespace torsio

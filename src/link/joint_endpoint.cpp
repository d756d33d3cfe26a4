#include "torsio/link/joint_endpoint.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/checks.hpp"

namespace torsio {
namespace {

constexpr std::string_view kJointPlace = "joint endpoint";

/// The first reasons of `LinkRefusal` are those of the guard.
LinkRefusal link_refusal(CommandGuard::Refusal refusal) noexcept {
  static_assert(static_cast<int>(CommandGuard::Refusal::deadline) ==
                static_cast<int>(LinkRefusal::deadline));
  return static_cast<LinkRefusal>(refusal);
}

JointReference joint_reference(const LinkReference& message) noexcept {
  return {.mode = message.mode,
          .position_rad = double{message.position_rad},
          .velocity_rad_s = double{message.velocity_rad_s},
          .torque_Nm = double{message.torque_Nm},
          .current_A = double{message.current_A},
          .stiffness_Nm_rad = double{message.stiffness_Nm_rad},
          .damping_Nms_rad = double{message.damping_Nms_rad},
          .deflection_rad = double{message.deflection_rad}};
}

template <class Message>
CommandGuard::Command guard_command(const Message& message, LinkRoute route) noexcept {
  CommandGuard::Command command{.route = route,
                                .sequence = message.seal.sequence,
                                .clock_ns = message.seal.clock_ns,
                                .is_intact = true};
  if constexpr (std::is_same_v<Message, LinkReference>) command.deadline_ns = message.deadline_ns;
  return command;
}

/// References and heartbeats are not confirmed: the telemetry shows what they do.
template <class Message>
bool is_confirmed(const Message& message) noexcept {
  if constexpr (std::is_same_v<Message, LinkStateChange>)
    return message.command != LinkStateCommand::heartbeat;
  else
    return !std::is_same_v<Message, LinkReference>;
}

}  // namespace

JointEndpoint::JointEndpoint(const Settings& settings, LinkJoint& joint,
                             const RegisterTable& registers, LinkSink& sink)
    : settings_(settings),
      joint_(joint),
      registers_(registers),
      sink_(sink),
      decoder_(settings.rules),
      guard_({.watchdog_s = settings.watchdog_s}),
      line_(settings.line_B_s) {
  require(settings.id != kNdlcomReserved && settings.id != kNdlcomBroadcast, kJointPlace,
          "an id of 1 to 254", fmt::format("{}", settings.id));
  require(settings.bus_host != kNdlcomBroadcast && settings.bus_host != settings.id, kJointPlace,
          "another id of the host of the bus than 255 and that of the joint",
          fmt::format("{}", settings.bus_host));
  require_positive(kJointPlace, "the rate of the ticks", settings.tick_rate_Hz);
  require(settings.line_B_s > 0.0, kJointPlace, "a line with more than 0 bytes per second",
          settings.line_B_s);
  require(joint.channels().size() <= kLinkChannels, kJointPlace,
          fmt::format("at most {} channels", kLinkChannels),
          fmt::format("{}", joint.channels().size()));
}

void JointEndpoint::receive(std::span<const std::uint8_t> bytes, std::uint64_t now_ns) noexcept {
  while (const auto frame = decoder_.next(bytes)) take(*frame, now_ns);
}

void JointEndpoint::take(const NdlcomFrame& frame, std::uint64_t now_ns) noexcept {
  if (frame.receiver != settings_.id && frame.receiver != kNdlcomBroadcast) {
    ++counts_.to_others;
    return;
  }
  if (frame.sender == kNdlcomReserved || frame.sender == kNdlcomBroadcast ||
      frame.sender == settings_.id || frame.sender == settings_.bus_host) {
    ++counts_.without_sender;
    return;
  }
  received_.add(frame.sender, frame.receiver, frame.counter);
  const std::uint8_t id = frame.payload.empty() ? std::uint8_t{0} : frame.payload[0];
  if (frame.receiver == kNdlcomBroadcast && id != LinkStop::kId) {
    ++counts_.broadcasts;
    return;
  }
  const bool is_known = visit_type_to_joint(id, [&]<class Message>(std::type_identity<Message>) {
    take_message<Message>(frame, now_ns);
  });
  if (is_known) return;
  ++counts_.unknown;
  if (guard_.controlling_host() == frame.sender)
    refuse_to(frame.sender, id, 0, LinkRefusal::unknown_message);
}

bool JointEndpoint::may_control(std::uint8_t host) const noexcept {
  return guard_.controlling_host() == host || guard_.controlling_host() == kNdlcomReserved;
}

template <class Message>
void JointEndpoint::take_message(const NdlcomFrame& frame, std::uint64_t now_ns) noexcept {
  Context context{.route = {.receiver = frame.receiver, .sender = frame.sender}, .now_ns = now_ns};
  // The sender of a damaged command may be another one than its header states: no reply.
  if (Message::kIsCommand && !is_intact_command(context.route, frame.payload)) {
    static_cast<void>(guard_.accept({.route = context.route}, now_ns));
    ++counts_.refused[static_cast<std::size_t>(LinkRefusal::checksum)];
    return;
  }
  Message message;
  LinkRefusal refusal = decode_payload(frame.payload, message);
  if (refusal != LinkRefusal::none) {
    // Whatever layout it has, whoever sends it requests a stop.
    if (std::is_same_v<Message, LinkStop>)
      stop(LinkStateReason::requested, settings_.lost_category, now_ns);
    finish(message, context, refusal);
    return;
  }
  if constexpr (Message::kIsCommand)
    refusal = guarded(message, context);
  else
    refusal = execute(message, context);
  finish(message, context, refusal);
}

template <class Message>
LinkRefusal JointEndpoint::guarded(const Message& message, Context& context) noexcept {
  const CommandGuard::Command command = guard_command(message, context.route);
  const LinkRefusal refusal = link_refusal(guard_.accept(command, context.now_ns));
  if (refusal != LinkRefusal::none) return refusal;
  last_host_ = context.route.sender;
  const LinkRefusal result = execute(message, context);
  if (result != LinkRefusal::none) return result;
  ++counts_.executed;
  bool is_motion = std::is_same_v<Message, LinkReference>;
  if constexpr (std::is_same_v<Message, LinkStateChange>)
    is_motion = message.command == LinkStateCommand::enable ||
                message.command == LinkStateCommand::heartbeat;
  if (is_motion) guard_.extend(command);
  return result;
}

template <class Message>
LinkRefusal JointEndpoint::guarded_for_bus(Message message, std::uint64_t arrived_ns,
                                           std::uint64_t now_ns) noexcept {
  message.seal = {.sequence = ++bus_sequence_, .clock_ns = arrived_ns};
  Context context{.route = {.receiver = settings_.id, .sender = settings_.bus_host},
                  .now_ns = now_ns};
  return guarded(message, context);
}

LinkRefusal JointEndpoint::execute_for_bus(const LinkStateChange& message, std::uint64_t arrived_ns,
                                           std::uint64_t now_ns) noexcept {
  return guarded_for_bus(message, arrived_ns, now_ns);
}
LinkRefusal JointEndpoint::execute_for_bus(const LinkReference& message, std::uint64_t arrived_ns,
                                           std::uint64_t now_ns) noexcept {
  return guarded_for_bus(message, arrived_ns, now_ns);
}
LinkRefusal JointEndpoint::execute_for_bus(const LinkModeChange& message, std::uint64_t arrived_ns,
                                           std::uint64_t now_ns) noexcept {
  return guarded_for_bus(message, arrived_ns, now_ns);
}
LinkRefusal JointEndpoint::execute_for_bus(const LinkRegisterWrite& message,
                                           std::uint64_t arrived_ns,
                                           std::uint64_t now_ns) noexcept {
  return guarded_for_bus(message, arrived_ns, now_ns);
}

void JointEndpoint::stop_for_bus(StopCategory category, std::uint64_t now_ns) noexcept {
  Context context{.route = {.receiver = settings_.id, .sender = settings_.bus_host},
                  .now_ns = now_ns};
  static_cast<void>(execute(LinkStop{.category = static_cast<std::uint8_t>(category)}, context));
}

template <class Message>
void JointEndpoint::finish(const Message& message, const Context& context,
                           LinkRefusal refusal) noexcept {
  const std::uint8_t host = context.route.sender;
  if (refusal == LinkRefusal::none) {
    if constexpr (Message::kIsCommand)
      if (!context.has_replied && is_confirmed(message))
        send(host, LinkDone{.message = Message::kId,
                            .sequence = message.seal.sequence,
                            .clock_ns = context.now_ns});
    return;
  }
  ++counts_.refused[static_cast<std::size_t>(refusal)];
  if (context.has_replied || !may_control(host)) return;
  std::uint64_t sequence = 0;
  if constexpr (Message::kIsCommand) sequence = message.seal.sequence;
  double lowest = 0.0;
  double highest = 0.0;
  if constexpr (std::is_same_v<Message, LinkRegisterWrite>)
    if (refusal == LinkRefusal::out_of_range) {
      lowest = registers_.registers()[message.index].lowest;
      highest = registers_.registers()[message.index].highest;
    }
  refuse_to(host, Message::kId, sequence, refusal, lowest, highest);
}

void JointEndpoint::refuse_to(std::uint8_t host, std::uint8_t message, std::uint64_t sequence,
                              LinkRefusal reason, double lowest, double highest) noexcept {
  send(host, LinkRefused{.message = message,
                         .reason = reason,
                         .sequence = sequence,
                         .lowest = lowest,
                         .highest = highest});
}

void JointEndpoint::send_payload(std::uint8_t host,
                                 std::span<const std::uint8_t> payload) noexcept {
  if (host == settings_.bus_host) return;
  std::array<std::uint8_t, kNdlcomMaxEncodedBytes> frame;
  const std::size_t size = encode_ndlcom(
      {.receiver = host, .sender = settings_.id, .counter = sent_.next(host), .payload = payload},
      frame);
  if (payload.empty() || !sink_.send(std::span(frame).first(size))) ++counts_.not_sent;
}

void JointEndpoint::send_state(std::uint8_t host, std::uint64_t now_ns) noexcept {
  if (host == kNdlcomReserved) return;
  send(host, LinkState{.clock_ns = now_ns,
                       .state = drive_.state(),
                       .reason = drive_.reason(),
                       .controlling_host = guard_.controlling_host()});
}

/// The joint is called even where the state stays: its category may be lower than that of the stop before.
void JointEndpoint::stop(LinkStateReason reason, StopCategory category,
                         std::uint64_t now_ns) noexcept {
  guard_.watch(false);
  const bool has_changed = drive_.stop(reason);
  joint_.stop(category);
  if (has_changed) send_state(last_host_, now_ns);
}

void JointEndpoint::tick(std::uint64_t now_ns) noexcept {
  if (drive_.state() == LinkDriveState::initialising && joint_.is_initialised())
    drive_.initialised();
  const bool is_backwards = now_ns < last_tick_ns_;
  last_tick_ns_ = now_ns;
  if (guard_.step(now_ns) && drive_.is_enabled())
    stop(is_backwards ? LinkStateReason::clock : LinkStateReason::host_lost,
         settings_.lost_category, now_ns);
  if (joint_.has_fault() && drive_.fault()) {
    guard_.watch(false);
    joint_.disable();
    send_state(last_host_, now_ns);
  }
  const LinkStateReason own_stop = joint_.own_stop();
  if (own_stop != LinkStateReason::none && drive_.is_enabled()) {
    guard_.watch(false);
    drive_.stop(own_stop);
    send_state(last_host_, now_ns);
  }
  poll_upload();
  send_telemetry(now_ns);
}

LinkRefusal JointEndpoint::execute(const LinkPing& message, Context& context) noexcept {
  send(context.route.sender, LinkPong{.token = message.token, .clock_ns = context.now_ns});
  return LinkRefusal::none;
}

LinkRefusal JointEndpoint::execute(const LinkInformationRequest& /*message*/,
                                   Context& context) noexcept {
  const LinkJoint::Identity identity = joint_.identity();
  send(context.route.sender,
       LinkInformation{
           .clock_ns = context.now_ns,
           .state = drive_.state(),
           .registers = static_cast<std::uint16_t>(registers_.size()),
           .channels = static_cast<std::uint8_t>(joint_.channels().size()),
           .watchdog_ms = static_cast<std::uint16_t>(std::lround(1e3 * settings_.watchdog_s)),
           .name = identity.name,
           .version = identity.version,
           .serial = identity.serial,
           .actuator = identity.actuator});
  return LinkRefusal::none;
}

LinkRefusal JointEndpoint::execute(const LinkRegisterRead& message, Context& context) noexcept {
  LinkRegisterValue reply{.index = message.index};
  const LinkRefusal refusal = registers_.read(message.index, reply.value);
  if (refusal == LinkRefusal::none) send(context.route.sender, reply);
  return refusal;
}

LinkRefusal JointEndpoint::execute(const LinkRegisterDescribe& message, Context& context) noexcept {
  LinkRegisterDescription reply;
  const LinkRefusal refusal = registers_.describe(message.index, reply);
  if (refusal == LinkRefusal::none) send(context.route.sender, reply);
  return refusal;
}

LinkRefusal JointEndpoint::execute(const LinkRegisterWrite& message,
                                   Context& /*context*/) noexcept {
  return registers_.write(message.index, message.value, drive_.is_disabled());
}

LinkRefusal JointEndpoint::execute(const LinkStateChange& message, Context& context) noexcept {
  if (message.command == LinkStateCommand::release) {
    if (drive_.is_enabled())
      stop(LinkStateReason::host_released, settings_.lost_category, context.now_ns);
    guard_.release(context.now_ns);
    return LinkRefusal::none;
  }
  const DriveState before = drive_;
  const LinkRefusal refusal =
      drive_.request(message.command, joint_.is_at_rest(), joint_.has_fault());
  if (refusal != LinkRefusal::none || drive_.state() == before.state()) return refusal;
  if (message.command == LinkStateCommand::enable) {
    const LinkRefusal objection = joint_.enable();
    if (objection != LinkRefusal::none) {
      drive_ = before;
      return objection;
    }
  } else {
    joint_.disable();
  }
  guard_.watch(drive_.is_enabled());
  return LinkRefusal::none;
}

LinkRefusal JointEndpoint::execute(const LinkReference& message, Context& /*context*/) noexcept {
  return drive_.is_enabled() ? joint_.apply(joint_reference(message))
                             : LinkRefusal::not_in_this_state;
}

LinkRefusal JointEndpoint::execute(const LinkModeChange& message, Context& /*context*/) noexcept {
  return joint_.change_mode(message.mode);
}

LinkRefusal JointEndpoint::execute(const LinkStop& message, Context& context) noexcept {
  ++counts_.stops;
  constexpr auto kLast = static_cast<std::uint8_t>(StopCategory::ramp_and_hold);
  stop(LinkStateReason::requested,
       message.category <= kLast ? static_cast<StopCategory>(message.category)
                                 : StopCategory::power_off,
       context.now_ns);
  // All joints would reply to a broadcast at once, on a bus that only one can use.
  if (context.route.receiver != kNdlcomBroadcast) send_state(context.route.sender, context.now_ns);
  return LinkRefusal::none;
}

LinkRefusal JointEndpoint::execute(const LinkZero& message, Context& /*context*/) noexcept {
  if (!drive_.is_disabled()) return LinkRefusal::only_when_disabled;
  return message.channel < joint_.channels().size() ? joint_.zero(message.channel, message.value)
                                                    : LinkRefusal::out_of_range;
}

LinkRefusal JointEndpoint::execute(const LinkInjectFault& message, Context& /*context*/) noexcept {
  return joint_.inject_fault(message);
}

}  // namespace torsio

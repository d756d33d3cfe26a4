// Written by tools/link_messages from share/torsio/link/messages.yaml; change that file instead.

#include "torsio/link/link_messages.hpp"

#include <array>
#include <limits>

#include "link/message_frame.hpp"

namespace torsio {

std::size_t encode_payload(const LinkPing& message, LinkRoute route,
                           std::span<std::uint8_t> out) noexcept {
  detail::PayloadWriter writer(out);
  detail::begin_payload(writer, message);
  writer.add(message.token);
  return detail::end_payload<LinkPing>(writer, route);
}

LinkRefusal decode_payload(std::span<const std::uint8_t> payload, LinkPing& message) noexcept {
  const LinkRefusal problem = detail::open_payload(payload, message);
  if (problem != LinkRefusal::none) return problem;
  detail::PayloadReader reader(payload);
  reader.read(message.token);
  return reader.result();
}

std::size_t encode_payload(const LinkPong& message, LinkRoute route,
                           std::span<std::uint8_t> out) noexcept {
  detail::PayloadWriter writer(out);
  detail::begin_payload(writer, message);
  writer.add(message.token);
  writer.add(message.clock_ns);
  return detail::end_payload<LinkPong>(writer, route);
}

LinkRefusal decode_payload(std::span<const std::uint8_t> payload, LinkPong& message) noexcept {
  const LinkRefusal problem = detail::open_payload(payload, message);
  if (problem != LinkRefusal::none) return problem;
  detail::PayloadReader reader(payload);
  reader.read(message.token);
  reader.read(message.clock_ns);
  return reader.result();
}

std::size_t encode_payload(const LinkInformationRequest& message, LinkRoute route,
                           std::span<std::uint8_t> out) noexcept {
  detail::PayloadWriter writer(out);
  detail::begin_payload(writer, message);
  return detail::end_payload<LinkInformationRequest>(writer, route);
}

LinkRefusal decode_payload(std::span<const std::uint8_t> payload,
                           LinkInformationRequest& message) noexcept {
  const LinkRefusal problem = detail::open_payload(payload, message);
  if (problem != LinkRefusal::none) return problem;
  detail::PayloadReader reader(payload);
  return reader.result();
}

std::size_t encode_payload(const LinkInformation& message, LinkRoute route,
                           std::span<std::uint8_t> out) noexcept {
  detail::PayloadWriter writer(out);
  detail::begin_payload(writer, message);
  writer.add(message.clock_ns);
  writer.add(message.state);
  writer.add(message.registers);
  writer.add(message.channels);
  writer.add(message.watchdog_ms);
  writer.add_text(message.name, 48);
  writer.add_text(message.version, 32);
  writer.add_text(message.serial, 48);
  writer.add_text(message.actuator, 48);
  return detail::end_payload<LinkInformation>(writer, route);
}

LinkRefusal decode_payload(std::span<const std::uint8_t> payload,
                           LinkInformation& message) noexcept {
  const LinkRefusal problem = detail::open_payload(payload, message);
  if (problem != LinkRefusal::none) return problem;
  detail::PayloadReader reader(payload);
  reader.read(message.clock_ns);
  reader.read(message.state, 5);
  reader.read(message.registers);
  reader.read(message.channels);
  reader.read(message.watchdog_ms);
  reader.read_text(message.name, 48);
  reader.read_text(message.version, 32);
  reader.read_text(message.serial, 48);
  reader.read_text(message.actuator, 48);
  return reader.result();
}

std::size_t encode_payload(const LinkRegisterRead& message, LinkRoute route,
                           std::span<std::uint8_t> out) noexcept {
  detail::PayloadWriter writer(out);
  detail::begin_payload(writer, message);
  writer.add(message.index);
  return detail::end_payload<LinkRegisterRead>(writer, route);
}

LinkRefusal decode_payload(std::span<const std::uint8_t> payload,
                           LinkRegisterRead& message) noexcept {
  const LinkRefusal problem = detail::open_payload(payload, message);
  if (problem != LinkRefusal::none) return problem;
  detail::PayloadReader reader(payload);
  reader.read(message.index);
  return reader.result();
}

std::size_t encode_payload(const LinkRegisterValue& message, LinkRoute route,
                           std::span<std::uint8_t> out) noexcept {
  detail::PayloadWriter writer(out);
  detail::begin_payload(writer, message);
  writer.add(message.index);
  writer.add(message.value);
  return detail::end_payload<LinkRegisterValue>(writer, route);
}

LinkRefusal decode_payload(std::span<const std::uint8_t> payload,
                           LinkRegisterValue& message) noexcept {
  const LinkRefusal problem = detail::open_payload(payload, message);
  if (problem != LinkRefusal::none) return problem;
  detail::PayloadReader reader(payload);
  reader.read(message.index);
  reader.read(message.value);
  return reader.result();
}

std::size_t encode_payload(const LinkRegisterDescribe& message, LinkRoute route,
                           std::span<std::uint8_t> out) noexcept {
  detail::PayloadWriter writer(out);
  detail::begin_payload(writer, message);
  writer.add(message.index);
  return detail::end_payload<LinkRegisterDescribe>(writer, route);
}

LinkRefusal decode_payload(std::span<const std::uint8_t> payload,
                           LinkRegisterDescribe& message) noexcept {
  const LinkRefusal problem = detail::open_payload(payload, message);
  if (problem != LinkRefusal::none) return problem;
  detail::PayloadReader reader(payload);
  reader.read(message.index);
  return reader.result();
}

std::size_t encode_payload(const LinkRegisterDescription& message, LinkRoute route,
                           std::span<std::uint8_t> out) noexcept {
  detail::PayloadWriter writer(out);
  detail::begin_payload(writer, message);
  writer.add(message.index);
  writer.add(message.count);
  writer.add(message.type);
  writer.add(message.access);
  writer.add(message.is_persistent);
  writer.add(message.lowest);
  writer.add(message.highest);
  writer.add_text(message.name, 48);
  writer.add_text(message.unit, 16);
  writer.add_text(message.description, 150);
  return detail::end_payload<LinkRegisterDescription>(writer, route);
}

LinkRefusal decode_payload(std::span<const std::uint8_t> payload,
                           LinkRegisterDescription& message) noexcept {
  const LinkRefusal problem = detail::open_payload(payload, message);
  if (problem != LinkRefusal::none) return problem;
  detail::PayloadReader reader(payload);
  reader.read(message.index);
  reader.read(message.count);
  reader.read(message.type, 5);
  reader.read(message.access, 3);
  reader.read(message.is_persistent);
  reader.read(message.lowest);
  reader.read(message.highest);
  reader.read_text(message.name, 48);
  reader.read_text(message.unit, 16);
  reader.read_text(message.description, 150);
  return reader.result();
}

std::size_t encode_payload(const LinkRegisterWrite& message, LinkRoute route,
                           std::span<std::uint8_t> out) noexcept {
  detail::PayloadWriter writer(out);
  detail::begin_payload(writer, message);
  writer.add(message.index);
  writer.add(message.value);
  return detail::end_payload<LinkRegisterWrite>(writer, route);
}

LinkRefusal decode_payload(std::span<const std::uint8_t> payload,
                           LinkRegisterWrite& message) noexcept {
  const LinkRefusal problem = detail::open_payload(payload, message);
  if (problem != LinkRefusal::none) return problem;
  detail::PayloadReader reader(payload);
  reader.read(message.index);
  reader.read(message.value);
  return reader.result();
}

std::size_t encode_payload(const LinkStateChange& message, LinkRoute route,
                           std::span<std::uint8_t> out) noexcept {
  detail::PayloadWriter writer(out);
  detail::begin_payload(writer, message);
  writer.add(message.command);
  return detail::end_payload<LinkStateChange>(writer, route);
}

LinkRefusal decode_payload(std::span<const std::uint8_t> payload,
                           LinkStateChange& message) noexcept {
  const LinkRefusal problem = detail::open_payload(payload, message);
  if (problem != LinkRefusal::none) return problem;
  detail::PayloadReader reader(payload);
  reader.read(message.command, 5);
  return reader.result();
}

std::size_t encode_payload(const LinkState& message, LinkRoute route,
                           std::span<std::uint8_t> out) noexcept {
  detail::PayloadWriter writer(out);
  detail::begin_payload(writer, message);
  writer.add(message.clock_ns);
  writer.add(message.state);
  writer.add(message.reason);
  writer.add(message.controlling_host);
  return detail::end_payload<LinkState>(writer, route);
}

LinkRefusal decode_payload(std::span<const std::uint8_t> payload, LinkState& message) noexcept {
  const LinkRefusal problem = detail::open_payload(payload, message);
  if (problem != LinkRefusal::none) return problem;
  detail::PayloadReader reader(payload);
  reader.read(message.clock_ns);
  reader.read(message.state, 5);
  reader.read(message.reason, 6);
  reader.read(message.controlling_host);
  return reader.result();
}

std::size_t encode_payload(const LinkReference& message, LinkRoute route,
                           std::span<std::uint8_t> out) noexcept {
  detail::PayloadWriter writer(out);
  detail::begin_payload(writer, message);
  writer.add(message.deadline_ns);
  writer.add(message.mode);
  writer.add(message.position_rad);
  writer.add(message.velocity_rad_s);
  writer.add(message.torque_Nm);
  writer.add(message.current_A);
  writer.add(message.stiffness_Nm_rad);
  writer.add(message.damping_Nms_rad);
  writer.add(message.deflection_rad);
  return detail::end_payload<LinkReference>(writer, route);
}

LinkRefusal decode_payload(std::span<const std::uint8_t> payload, LinkReference& message) noexcept {
  const LinkRefusal problem = detail::open_payload(payload, message);
  if (problem != LinkRefusal::none) return problem;
  detail::PayloadReader reader(payload);
  reader.read(message.deadline_ns);
  reader.read(message.mode, 6);
  reader.read_finite(message.position_rad);
  reader.read_finite(message.velocity_rad_s);
  reader.read_finite(message.torque_Nm);
  reader.read_finite(message.current_A);
  reader.read_finite(message.stiffness_Nm_rad);
  reader.read_finite(message.damping_Nms_rad);
  reader.read_finite(message.deflection_rad);
  return reader.result();
}

std::size_t encode_payload(const LinkModeChange& message, LinkRoute route,
                           std::span<std::uint8_t> out) noexcept {
  detail::PayloadWriter writer(out);
  detail::begin_payload(writer, message);
  writer.add(message.mode);
  return detail::end_payload<LinkModeChange>(writer, route);
}

LinkRefusal decode_payload(std::span<const std::uint8_t> payload,
                           LinkModeChange& message) noexcept {
  const LinkRefusal problem = detail::open_payload(payload, message);
  if (problem != LinkRefusal::none) return problem;
  detail::PayloadReader reader(payload);
  reader.read(message.mode, 6);
  return reader.result();
}

std::size_t encode_payload(const LinkStop& message, LinkRoute route,
                           std::span<std::uint8_t> out) noexcept {
  detail::PayloadWriter writer(out);
  detail::begin_payload(writer, message);
  writer.add(message.category);
  return detail::end_payload<LinkStop>(writer, route);
}

LinkRefusal decode_payload(std::span<const std::uint8_t> payload, LinkStop& message) noexcept {
  const LinkRefusal problem = detail::open_payload(payload, message);
  if (problem != LinkRefusal::none) return problem;
  detail::PayloadReader reader(payload);
  reader.read(message.category);
  return reader.result();
}

std::size_t encode_payload(const LinkSubscribe& message, LinkRoute route,
                           std::span<std::uint8_t> out) noexcept {
  detail::PayloadWriter writer(out);
  detail::begin_payload(writer, message);
  writer.add(message.mask);
  writer.add(message.rate_Hz);
  writer.add(message.lifetime_s);
  return detail::end_payload<LinkSubscribe>(writer, route);
}

LinkRefusal decode_payload(std::span<const std::uint8_t> payload, LinkSubscribe& message) noexcept {
  const LinkRefusal problem = detail::open_payload(payload, message);
  if (problem != LinkRefusal::none) return problem;
  detail::PayloadReader reader(payload);
  reader.read(message.mask);
  reader.read_finite(message.rate_Hz);
  reader.read_finite(message.lifetime_s);
  return reader.result();
}

std::size_t encode_payload(const LinkSubscription& message, LinkRoute route,
                           std::span<std::uint8_t> out) noexcept {
  detail::PayloadWriter writer(out);
  detail::begin_payload(writer, message);
  writer.add(message.refusal);
  writer.add(message.mask);
  writer.add(message.rate_Hz);
  writer.add(message.asked_B_s);
  writer.add(message.available_B_s);
  return detail::end_payload<LinkSubscription>(writer, route);
}

LinkRefusal decode_payload(std::span<const std::uint8_t> payload,
                           LinkSubscription& message) noexcept {
  const LinkRefusal problem = detail::open_payload(payload, message);
  if (problem != LinkRefusal::none) return problem;
  detail::PayloadReader reader(payload);
  reader.read(message.refusal, 24);
  reader.read(message.mask);
  reader.read(message.rate_Hz);
  reader.read(message.asked_B_s);
  reader.read(message.available_B_s);
  return reader.result();
}

std::size_t encode_payload(const LinkTelemetry& message, LinkRoute route,
                           std::span<std::uint8_t> out) noexcept {
  detail::PayloadWriter writer(out);
  detail::begin_payload(writer, message);
  writer.add(message.time_ns);
  writer.add(message.sequence);
  writer.add(message.mask);
  writer.add(message.values);
  return detail::end_payload<LinkTelemetry>(writer, route);
}

LinkRefusal decode_payload(std::span<const std::uint8_t> payload, LinkTelemetry& message) noexcept {
  const LinkRefusal problem = detail::open_payload(payload, message);
  if (problem != LinkRefusal::none) return problem;
  detail::PayloadReader reader(payload);
  reader.read(message.time_ns);
  reader.read(message.sequence);
  reader.read(message.mask);
  reader.read(message.values);
  return reader.result();
}

std::size_t encode_payload(const LinkChannelDescribe& message, LinkRoute route,
                           std::span<std::uint8_t> out) noexcept {
  detail::PayloadWriter writer(out);
  detail::begin_payload(writer, message);
  writer.add(message.index);
  return detail::end_payload<LinkChannelDescribe>(writer, route);
}

LinkRefusal decode_payload(std::span<const std::uint8_t> payload,
                           LinkChannelDescribe& message) noexcept {
  const LinkRefusal problem = detail::open_payload(payload, message);
  if (problem != LinkRefusal::none) return problem;
  detail::PayloadReader reader(payload);
  reader.read(message.index);
  return reader.result();
}

std::size_t encode_payload(const LinkChannelDescription& message, LinkRoute route,
                           std::span<std::uint8_t> out) noexcept {
  detail::PayloadWriter writer(out);
  detail::begin_payload(writer, message);
  writer.add(message.index);
  writer.add(message.count);
  writer.add_text(message.name, 48);
  return detail::end_payload<LinkChannelDescription>(writer, route);
}

LinkRefusal decode_payload(std::span<const std::uint8_t> payload,
                           LinkChannelDescription& message) noexcept {
  const LinkRefusal problem = detail::open_payload(payload, message);
  if (problem != LinkRefusal::none) return problem;
  detail::PayloadReader reader(payload);
  reader.read(message.index);
  reader.read(message.count);
  reader.read_text(message.name, 48);
  return reader.result();
}

std::size_t encode_payload(const LinkUploadBegin& message, LinkRoute route,
                           std::span<std::uint8_t> out) noexcept {
  detail::PayloadWriter writer(out);
  detail::begin_payload(writer, message);
  writer.add(message.size);
  writer.add(message.crc);
  writer.add_text(message.actuator, 48);
  return detail::end_payload<LinkUploadBegin>(writer, route);
}

LinkRefusal decode_payload(std::span<const std::uint8_t> payload,
                           LinkUploadBegin& message) noexcept {
  const LinkRefusal problem = detail::open_payload(payload, message);
  if (problem != LinkRefusal::none) return problem;
  detail::PayloadReader reader(payload);
  reader.read(message.size);
  reader.read(message.crc);
  reader.read_text(message.actuator, 48);
  return reader.result();
}

std::size_t encode_payload(const LinkUploadChunk& message, LinkRoute route,
                           std::span<std::uint8_t> out) noexcept {
  detail::PayloadWriter writer(out);
  detail::begin_payload(writer, message);
  writer.add(message.offset);
  writer.add_bytes(message.data);
  return detail::end_payload<LinkUploadChunk>(writer, route);
}

LinkRefusal decode_payload(std::span<const std::uint8_t> payload,
                           LinkUploadChunk& message) noexcept {
  const LinkRefusal problem = detail::open_payload(payload, message);
  if (problem != LinkRefusal::none) return problem;
  detail::PayloadReader reader(payload);
  reader.read(message.offset);
  reader.read_bytes(message.data);
  return reader.result();
}

std::size_t encode_payload(const LinkUploadCommit& message, LinkRoute route,
                           std::span<std::uint8_t> out) noexcept {
  detail::PayloadWriter writer(out);
  detail::begin_payload(writer, message);
  writer.add(message.crc);
  return detail::end_payload<LinkUploadCommit>(writer, route);
}

LinkRefusal decode_payload(std::span<const std::uint8_t> payload,
                           LinkUploadCommit& message) noexcept {
  const LinkRefusal problem = detail::open_payload(payload, message);
  if (problem != LinkRefusal::none) return problem;
  detail::PayloadReader reader(payload);
  reader.read(message.crc);
  return reader.result();
}

std::size_t encode_payload(const LinkUploadAbort& message, LinkRoute route,
                           std::span<std::uint8_t> out) noexcept {
  detail::PayloadWriter writer(out);
  detail::begin_payload(writer, message);
  return detail::end_payload<LinkUploadAbort>(writer, route);
}

LinkRefusal decode_payload(std::span<const std::uint8_t> payload,
                           LinkUploadAbort& message) noexcept {
  const LinkRefusal problem = detail::open_payload(payload, message);
  if (problem != LinkRefusal::none) return problem;
  detail::PayloadReader reader(payload);
  return reader.result();
}

std::size_t encode_payload(const LinkUpload& message, LinkRoute route,
                           std::span<std::uint8_t> out) noexcept {
  detail::PayloadWriter writer(out);
  detail::begin_payload(writer, message);
  writer.add(message.state);
  writer.add(message.refusal);
  writer.add(message.received);
  return detail::end_payload<LinkUpload>(writer, route);
}

LinkRefusal decode_payload(std::span<const std::uint8_t> payload, LinkUpload& message) noexcept {
  const LinkRefusal problem = detail::open_payload(payload, message);
  if (problem != LinkRefusal::none) return problem;
  detail::PayloadReader reader(payload);
  reader.read(message.state, 5);
  reader.read(message.refusal, 24);
  reader.read(message.received);
  return reader.result();
}

std::size_t encode_payload(const LinkZero& message, LinkRoute route,
                           std::span<std::uint8_t> out) noexcept {
  detail::PayloadWriter writer(out);
  detail::begin_payload(writer, message);
  writer.add(message.channel);
  writer.add(message.value);
  return detail::end_payload<LinkZero>(writer, route);
}

LinkRefusal decode_payload(std::span<const std::uint8_t> payload, LinkZero& message) noexcept {
  const LinkRefusal problem = detail::open_payload(payload, message);
  if (problem != LinkRefusal::none) return problem;
  detail::PayloadReader reader(payload);
  reader.read(message.channel);
  reader.read_finite(message.value);
  return reader.result();
}

std::size_t encode_payload(const LinkInjectFault& message, LinkRoute route,
                           std::span<std::uint8_t> out) noexcept {
  detail::PayloadWriter writer(out);
  detail::begin_payload(writer, message);
  writer.add_text(message.fault, 32);
  writer.add(message.channel);
  writer.add(message.magnitude);
  writer.add(message.duration_s);
  return detail::end_payload<LinkInjectFault>(writer, route);
}

LinkRefusal decode_payload(std::span<const std::uint8_t> payload,
                           LinkInjectFault& message) noexcept {
  const LinkRefusal problem = detail::open_payload(payload, message);
  if (problem != LinkRefusal::none) return problem;
  detail::PayloadReader reader(payload);
  reader.read_text(message.fault, 32);
  reader.read(message.channel);
  reader.read_finite(message.magnitude);
  reader.read_finite(message.duration_s);
  return reader.result();
}

std::size_t encode_payload(const LinkRefused& message, LinkRoute route,
                           std::span<std::uint8_t> out) noexcept {
  detail::PayloadWriter writer(out);
  detail::begin_payload(writer, message);
  writer.add(message.message);
  writer.add(message.reason);
  writer.add(message.sequence);
  writer.add(message.lowest);
  writer.add(message.highest);
  return detail::end_payload<LinkRefused>(writer, route);
}

LinkRefusal decode_payload(std::span<const std::uint8_t> payload, LinkRefused& message) noexcept {
  const LinkRefusal problem = detail::open_payload(payload, message);
  if (problem != LinkRefusal::none) return problem;
  detail::PayloadReader reader(payload);
  reader.read(message.message);
  reader.read(message.reason, 24);
  reader.read(message.sequence);
  reader.read(message.lowest);
  reader.read(message.highest);
  return reader.result();
}

std::size_t encode_payload(const LinkDone& message, LinkRoute route,
                           std::span<std::uint8_t> out) noexcept {
  detail::PayloadWriter writer(out);
  detail::begin_payload(writer, message);
  writer.add(message.message);
  writer.add(message.sequence);
  writer.add(message.clock_ns);
  return detail::end_payload<LinkDone>(writer, route);
}

LinkRefusal decode_payload(std::span<const std::uint8_t> payload, LinkDone& message) noexcept {
  const LinkRefusal problem = detail::open_payload(payload, message);
  if (problem != LinkRefusal::none) return problem;
  detail::PayloadReader reader(payload);
  reader.read(message.message);
  reader.read(message.sequence);
  reader.read(message.clock_ns);
  return reader.result();
}

std::string_view link_message_name(std::uint8_t id) noexcept {
  switch (id) {
    case LinkPing::kId: return "LinkPing";
    case LinkPong::kId: return "LinkPong";
    case LinkInformationRequest::kId: return "LinkInformationRequest";
    case LinkInformation::kId: return "LinkInformation";
    case LinkRegisterRead::kId: return "LinkRegisterRead";
    case LinkRegisterValue::kId: return "LinkRegisterValue";
    case LinkRegisterDescribe::kId: return "LinkRegisterDescribe";
    case LinkRegisterDescription::kId: return "LinkRegisterDescription";
    case LinkRegisterWrite::kId: return "LinkRegisterWrite";
    case LinkStateChange::kId: return "LinkStateChange";
    case LinkState::kId: return "LinkState";
    case LinkReference::kId: return "LinkReference";
    case LinkModeChange::kId: return "LinkModeChange";
    case LinkStop::kId: return "LinkStop";
    case LinkSubscribe::kId: return "LinkSubscribe";
    case LinkSubscription::kId: return "LinkSubscription";
    case LinkTelemetry::kId: return "LinkTelemetry";
    case LinkChannelDescribe::kId: return "LinkChannelDescribe";
    case LinkChannelDescription::kId: return "LinkChannelDescription";
    case LinkUploadBegin::kId: return "LinkUploadBegin";
    case LinkUploadChunk::kId: return "LinkUploadChunk";
    case LinkUploadCommit::kId: return "LinkUploadCommit";
    case LinkUploadAbort::kId: return "LinkUploadAbort";
    case LinkUpload::kId: return "LinkUpload";
    case LinkZero::kId: return "LinkZero";
    case LinkInjectFault::kId: return "LinkInjectFault";
    case LinkRefused::kId: return "LinkRefused";
    case LinkDone::kId: return "LinkDone";
    default: return {};
  }
}

bool is_link_command(std::uint8_t id) noexcept {
  switch (id) {
    case LinkPing::kId: return LinkPing::kIsCommand;
    case LinkPong::kId: return LinkPong::kIsCommand;
    case LinkInformationRequest::kId: return LinkInformationRequest::kIsCommand;
    case LinkInformation::kId: return LinkInformation::kIsCommand;
    case LinkRegisterRead::kId: return LinkRegisterRead::kIsCommand;
    case LinkRegisterValue::kId: return LinkRegisterValue::kIsCommand;
    case LinkRegisterDescribe::kId: return LinkRegisterDescribe::kIsCommand;
    case LinkRegisterDescription::kId: return LinkRegisterDescription::kIsCommand;
    case LinkRegisterWrite::kId: return LinkRegisterWrite::kIsCommand;
    case LinkStateChange::kId: return LinkStateChange::kIsCommand;
    case LinkState::kId: return LinkState::kIsCommand;
    case LinkReference::kId: return LinkReference::kIsCommand;
    case LinkModeChange::kId: return LinkModeChange::kIsCommand;
    case LinkStop::kId: return LinkStop::kIsCommand;
    case LinkSubscribe::kId: return LinkSubscribe::kIsCommand;
    case LinkSubscription::kId: return LinkSubscription::kIsCommand;
    case LinkTelemetry::kId: return LinkTelemetry::kIsCommand;
    case LinkChannelDescribe::kId: return LinkChannelDescribe::kIsCommand;
    case LinkChannelDescription::kId: return LinkChannelDescription::kIsCommand;
    case LinkUploadBegin::kId: return LinkUploadBegin::kIsCommand;
    case LinkUploadChunk::kId: return LinkUploadChunk::kIsCommand;
    case LinkUploadCommit::kId: return LinkUploadCommit::kIsCommand;
    case LinkUploadAbort::kId: return LinkUploadAbort::kIsCommand;
    case LinkUpload::kId: return LinkUpload::kIsCommand;
    case LinkZero::kId: return LinkZero::kIsCommand;
    case LinkInjectFault::kId: return LinkInjectFault::kIsCommand;
    case LinkRefused::kId: return LinkRefused::kIsCommand;
    case LinkDone::kId: return LinkDone::kIsCommand;
    default: return false;
  }
}

std::string_view name(LinkDriveState value) noexcept {
  constexpr std::array<std::string_view, kLinkDriveStates> kTexts{"initialising", "ready",
                                                                  "enabled", "fault", "stop"};
  return kTexts[static_cast<std::size_t>(value)];
}

std::string_view meaning(LinkDriveState value) noexcept {
  constexpr std::array<std::string_view, kLinkDriveStates> kTexts{
      "the joint starts; it cannot be enabled", "no current flows; it can be enabled",
      "references are executed", "no current flows until the fault is reset",
      "a stop is executed, or has ended; latched until it is disabled"};
  return kTexts[static_cast<std::size_t>(value)];
}

std::string_view name(LinkStateCommand value) noexcept {
  constexpr std::array<std::string_view, kLinkStateCommands> kTexts{
      "heartbeat", "enable", "disable", "reset_fault", "release"};
  return kTexts[static_cast<std::size_t>(value)];
}

std::string_view meaning(LinkStateCommand value) noexcept {
  constexpr std::array<std::string_view, kLinkStateCommands> kTexts{
      "nothing changes; the motion continues for the time of the watchdog", "ready -> enabled",
      "enabled or stop -> ready", "fault -> ready, if its cause has ended",
      "the host gives up control; an enabled joint stops"};
  return kTexts[static_cast<std::size_t>(value)];
}

std::string_view name(LinkStateReason value) noexcept {
  constexpr std::array<std::string_view, kLinkStateReasons> kTexts{
      "none", "requested", "host_lost", "host_released", "clock", "joint_fault"};
  return kTexts[static_cast<std::size_t>(value)];
}

std::string_view meaning(LinkStateReason value) noexcept {
  constexpr std::array<std::string_view, kLinkStateReasons> kTexts{
      "it has not been in a fault or a stop",
      "a host requested it",
      "no motion command within the time of the watchdog",
      "the controlling host gave up control while the joint was enabled",
      "the clock of the joint ran backwards",
      "the joint detected a fault"};
  return kTexts[static_cast<std::size_t>(value)];
}

std::string_view name(LinkValueType value) noexcept {
  constexpr std::array<std::string_view, kLinkValueTypes> kTexts{"boolean", "int32", "uint32",
                                                                 "float64", "text"};
  return kTexts[static_cast<std::size_t>(value)];
}

std::string_view meaning(LinkValueType value) noexcept {
  constexpr std::array<std::string_view, kLinkValueTypes> kTexts{
      "one byte, 0 or 1", "four bytes, two's complement", "four bytes", "eight bytes, IEEE 754",
      "one byte with the length, then UTF-8"};
  return kTexts[static_cast<std::size_t>(value)];
}

std::string_view name(LinkAccess value) noexcept {
  constexpr std::array<std::string_view, kLinkAccesss> kTexts{"read", "write",
                                                              "write_when_disabled"};
  return kTexts[static_cast<std::size_t>(value)];
}

std::string_view meaning(LinkAccess value) noexcept {
  constexpr std::array<std::string_view, kLinkAccesss> kTexts{
      "never", "always", "not while the joint is enabled or stops"};
  return kTexts[static_cast<std::size_t>(value)];
}

std::string_view name(LinkRefusal value) noexcept {
  constexpr std::array<std::string_view, kLinkRefusals> kTexts{"none",
                                                               "checksum",
                                                               "broadcast",
                                                               "from_future",
                                                               "too_old",
                                                               "other_host",
                                                               "repeated",
                                                               "deadline",
                                                               "unknown_message",
                                                               "wrong_version",
                                                               "wrong_length",
                                                               "unknown_value",
                                                               "not_finite",
                                                               "unknown_register",
                                                               "wrong_type",
                                                               "out_of_range",
                                                               "read_only",
                                                               "only_when_disabled",
                                                               "not_in_this_state",
                                                               "not_supported",
                                                               "too_many_subscribers",
                                                               "line_too_slow",
                                                               "upload_out_of_order",
                                                               "upload_rejected"};
  return kTexts[static_cast<std::size_t>(value)];
}

std::string_view meaning(LinkRefusal value) noexcept {
  constexpr std::array<std::string_view, kLinkRefusals> kTexts{
      "it was executed",
      "the CRC-32 is wrong",
      "only a stop may be sent to every joint",
      "it carries a time that the clock of the joint has not reached",
      "it is older than the time of the watchdog, or than the end of the last control",
      "another host is in control",
      "its sequence is not above that of the last accepted command",
      "it arrived after its own deadline",
      "no message has this id",
      "the layout has another version",
      "the payload has another length than its layout",
      "an enumeration has no such value",
      "a number is NaN or infinite",
      "no register has this index",
      "the register has another type",
      "the value is outside the limits",
      "the register cannot be written",
      "the joint is enabled: disable it first",
      "the state of the joint does not permit it",
      "this joint does not offer it",
      "every subscription is in use",
      "the line cannot carry the telemetry",
      "the part does not follow the one before",
      "the joint cannot use what was uploaded"};
  return kTexts[static_cast<std::size_t>(value)];
}

std::string_view name(LinkUploadState value) noexcept {
  constexpr std::array<std::string_view, kLinkUploadStates> kTexts{"idle", "receiving", "complete",
                                                                   "committed", "rejected"};
  return kTexts[static_cast<std::size_t>(value)];
}

std::string_view meaning(LinkUploadState value) noexcept {
  constexpr std::array<std::string_view, kLinkUploadStates> kTexts{
      "there is none", "parts are missing", "every byte has arrived", "the joint uses it",
      "the joint cannot use it"};
  return kTexts[static_cast<std::size_t>(value)];
}

}  // namespace torsio

#pragma once

// Written by tools/link_messages from share/torsio/link/messages.yaml; change that file instead.

#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>
#include <type_traits>

#include "torsio/control/joint_cascade.hpp"
#include "torsio/core/realtime.hpp"
#include "torsio/link/command_guard.hpp"
#include "torsio/link/link_enumerations.hpp"
#include "torsio/link/link_value.hpp"

namespace torsio {

// The first byte of a payload is the id of its message, the second the version of its layout; numbers have their low
// byte first. Byte by byte: docs/robot/link_messages.md. The layouts are torsio's own, since those of NDLCom's users are
// not public. Texts and bytes of a decoded message refer to its payload.

/// Asks for a sign of life and the clock.
struct LinkPing {
  static constexpr std::uint8_t kId = 0x01;
  static constexpr std::uint8_t kVersion = 1;
  static constexpr bool kIsCommand = false;
  std::uint32_t token = 0;  ///< comes back unchanged
};

/// Reply to a ping.
struct LinkPong {
  static constexpr std::uint8_t kId = 0x02;
  static constexpr std::uint8_t kVersion = 1;
  static constexpr bool kIsCommand = false;
  std::uint32_t token = 0;     ///< the same number as in the ping
  std::uint64_t clock_ns = 0;  ///< clock of the joint
};

/// Asks what the joint is.
struct LinkInformationRequest {
  static constexpr std::uint8_t kId = 0x03;
  static constexpr std::uint8_t kVersion = 1;
  static constexpr bool kIsCommand = false;
};

/// What the joint is.
struct LinkInformation {
  static constexpr std::uint8_t kId = 0x04;
  static constexpr std::uint8_t kVersion = 1;
  static constexpr bool kIsCommand = false;
  std::uint64_t clock_ns = 0;      ///< clock of the joint
  LinkDriveState state = {};       ///< state of the drive
  std::uint16_t registers = 0;     ///< number of registers
  std::uint8_t channels = 0;       ///< number of channels of the telemetry
  std::uint16_t watchdog_ms = 0;   ///< time after which a silent host has lost the joint
  std::string_view name = {};      ///< name of the joint
  std::string_view version = {};   ///< version of its software
  std::string_view serial = {};    ///< serial number
  std::string_view actuator = {};  ///< type of the actuator
};

/// Asks for the value of a register.
struct LinkRegisterRead {
  static constexpr std::uint8_t kId = 0x10;
  static constexpr std::uint8_t kVersion = 1;
  static constexpr bool kIsCommand = false;
  std::uint16_t index = 0;  ///< from 0 on
};

/// The value of a register.
struct LinkRegisterValue {
  static constexpr std::uint8_t kId = 0x11;
  static constexpr std::uint8_t kVersion = 1;
  static constexpr bool kIsCommand = false;
  std::uint16_t index = 0;  ///< from 0 on
  LinkValue value = {};     ///< present value
};

/// Asks for the description of a register. All of them: from index 0 on until the count of the reply.
struct LinkRegisterDescribe {
  static constexpr std::uint8_t kId = 0x12;
  static constexpr std::uint8_t kVersion = 1;
  static constexpr bool kIsCommand = false;
  std::uint16_t index = 0;  ///< from 0 on
};

/// The description of a register.
struct LinkRegisterDescription {
  static constexpr std::uint8_t kId = 0x13;
  static constexpr std::uint8_t kVersion = 1;
  static constexpr bool kIsCommand = false;
  std::uint16_t index = 0;            ///< from 0 on
  std::uint16_t count = 0;            ///< number of registers
  LinkValueType type = {};            ///< type
  LinkAccess access = {};             ///< when it may be written
  std::uint8_t is_persistent = 0;     ///< 1: it keeps its value without power
  double lowest = 0.0;                ///< least value that may be written; of a number
  double highest = 0.0;               ///< largest value that may be written; of a number
  std::string_view name = {};         ///< name, unique in the joint
  std::string_view unit = {};         ///< unit, as in a channel's name
  std::string_view description = {};  ///< one sentence
};

/// Writes a register.
struct LinkRegisterWrite {
  static constexpr std::uint8_t kId = 0x14;
  static constexpr std::uint8_t kVersion = 1;
  static constexpr bool kIsCommand = true;
  CommandSeal seal = {};
  std::uint16_t index = 0;  ///< from 0 on
  LinkValue value = {};     ///< new value
};

/// Changes the state of the drive, or keeps it alive.
struct LinkStateChange {
  static constexpr std::uint8_t kId = 0x20;
  static constexpr std::uint8_t kVersion = 1;
  static constexpr bool kIsCommand = true;
  CommandSeal seal = {};
  LinkStateCommand command = {};  ///< what is requested
};

/// State of the drive: the reply to a stop, and sent at each change.
struct LinkState {
  static constexpr std::uint8_t kId = 0x21;
  static constexpr std::uint8_t kVersion = 1;
  static constexpr bool kIsCommand = false;
  std::uint64_t clock_ns = 0;         ///< clock of the joint
  LinkDriveState state = {};          ///< state
  LinkStateReason reason = {};        ///< cause of the last fault or stop
  std::uint8_t controlling_host = 0;  ///< 0: none
};

/// Reference of the controllers. A mode ignores the numbers that it does not use, but each must be finite.
struct LinkReference {
  static constexpr std::uint8_t kId = 0x22;
  static constexpr std::uint8_t kVersion = 1;
  static constexpr bool kIsCommand = true;
  CommandSeal seal = {};
  std::uint64_t deadline_ns =
      0;  ///< clock of the joint after which the reference is refused, and the joint stops without another one
  JointMode mode = {};            ///< mode of the controllers
  float position_rad = 0.0F;      ///< position, impedance
  float velocity_rad_s = 0.0F;    ///< velocity; feed-forward in position, impedance
  float torque_Nm = 0.0F;         ///< torque; feed-forward in position, velocity, impedance
  float current_A = 0.0F;         ///< current; feed-forward in every other mode
  float stiffness_Nm_rad = 0.0F;  ///< impedance
  float damping_Nms_rad = 0.0F;   ///< impedance
  float deflection_rad = 0.0F;    ///< deflection of the spring
};

/// Changes the mode without a step: the joint continues from its present state until the next reference.
struct LinkModeChange {
  static constexpr std::uint8_t kId = 0x23;
  static constexpr std::uint8_t kVersion = 1;
  static constexpr bool kIsCommand = true;
  CommandSeal seal = {};
  JointMode mode = {};  ///< mode of the controllers
};

/// Stops the joint, from any host, at any time, in every state; may be sent to all joints. Nothing but a stop can come of a repeated or late one.
struct LinkStop {
  static constexpr std::uint8_t kId = 0x24;
  static constexpr std::uint8_t kVersion = 1;
  static constexpr bool kIsCommand = false;
  std::uint8_t category = 0;  ///< stop category of IEC 60204-1: 0, 1 or 2; any other is 0
};

/// Asks for telemetry. A host has one subscription per joint, the last one; mask 0 ends it.
struct LinkSubscribe {
  static constexpr std::uint8_t kId = 0x30;
  static constexpr std::uint8_t kVersion = 1;
  static constexpr bool kIsCommand = false;
  std::uint32_t mask = 0;   ///< bit n: channel n
  float rate_Hz = 0.0F;     ///< the joint rounds it to a whole number of its periods
  float lifetime_s = 0.0F;  ///< after this time it ends unless it is renewed; at most 60
};

/// Reply to a subscription, also to one that the line cannot carry.
struct LinkSubscription {
  static constexpr std::uint8_t kId = 0x31;
  static constexpr std::uint8_t kVersion = 1;
  static constexpr bool kIsCommand = false;
  LinkRefusal refusal = {};    ///< none: telemetry follows
  std::uint32_t mask = 0;      ///< bit n: channel n
  float rate_Hz = 0.0F;        ///< after rounding
  float asked_B_s = 0.0F;      ///< all subscriptions together, escapes included
  float available_B_s = 0.0F;  ///< that the line carries
};

/// Channels of one tick.
struct LinkTelemetry {
  static constexpr std::uint8_t kId = 0x32;
  static constexpr std::uint8_t kVersion = 1;
  static constexpr bool kIsCommand = false;
  std::uint64_t time_ns = 0;   ///< clock of the joint at the tick
  std::uint32_t sequence = 0;  ///< per subscription, from 0 on, without a gap
  std::uint32_t mask = 0;      ///< bit n: channel n
  LinkFloats values = {};      ///< in the order of the bits
};

/// Asks for the description of a channel.
struct LinkChannelDescribe {
  static constexpr std::uint8_t kId = 0x33;
  static constexpr std::uint8_t kVersion = 1;
  static constexpr bool kIsCommand = false;
  std::uint8_t index = 0;  ///< from 0 on
};

/// The description of a channel.
struct LinkChannelDescription {
  static constexpr std::uint8_t kId = 0x34;
  static constexpr std::uint8_t kVersion = 1;
  static constexpr bool kIsCommand = false;
  std::uint8_t index = 0;      ///< from 0 on
  std::uint8_t count = 0;      ///< number of channels
  std::string_view name = {};  ///< name with its unit, as in a recording
};

/// Begins the upload of a model file; one that was begun before is discarded.
struct LinkUploadBegin {
  static constexpr std::uint8_t kId = 0x40;
  static constexpr std::uint8_t kVersion = 1;
  static constexpr bool kIsCommand = true;
  CommandSeal seal = {};
  std::uint32_t size = 0;          ///< the whole file
  std::uint32_t crc = 0;           ///< CRC-32 of the whole file
  std::string_view actuator = {};  ///< type of the actuator for which it was fitted
};

/// Part of the file, at most 200 bytes, in order.
struct LinkUploadChunk {
  static constexpr std::uint8_t kId = 0x41;
  static constexpr std::uint8_t kVersion = 1;
  static constexpr bool kIsCommand = true;
  CommandSeal seal = {};
  std::uint32_t offset = 0;                 ///< where it begins
  std::span<const std::uint8_t> data = {};  ///< the bytes
};

/// The joint checks the file and uses it from then on, without a step in the torque.
struct LinkUploadCommit {
  static constexpr std::uint8_t kId = 0x42;
  static constexpr std::uint8_t kVersion = 1;
  static constexpr bool kIsCommand = true;
  CommandSeal seal = {};
  std::uint32_t crc = 0;  ///< CRC-32 of the whole file
};

/// Discards the upload.
struct LinkUploadAbort {
  static constexpr std::uint8_t kId = 0x43;
  static constexpr std::uint8_t kVersion = 1;
  static constexpr bool kIsCommand = true;
  CommandSeal seal = {};
};

/// State of the upload: the reply to each of its commands.
struct LinkUpload {
  static constexpr std::uint8_t kId = 0x44;
  static constexpr std::uint8_t kVersion = 1;
  static constexpr bool kIsCommand = false;
  LinkUploadState state = {};  ///< state
  LinkRefusal refusal = {};    ///< none: all is well
  std::uint32_t received = 0;  ///< the next part begins here
};

/// Makes the present value of a channel this value.
struct LinkZero {
  static constexpr std::uint8_t kId = 0x50;
  static constexpr std::uint8_t kVersion = 1;
  static constexpr bool kIsCommand = true;
  CommandSeal seal = {};
  std::uint8_t channel = 0;  ///< index of the channel
  double value = 0.0;        ///< in the unit of the channel
};

/// Injects a fault into a simulated joint; a real one refuses it.
struct LinkInjectFault {
  static constexpr std::uint8_t kId = 0x51;
  static constexpr std::uint8_t kVersion = 1;
  static constexpr bool kIsCommand = true;
  CommandSeal seal = {};
  std::string_view fault = {};  ///< name of the fault; empty: end all
  std::uint8_t channel = 0;     ///< index of the channel
  double magnitude = 0.0;       ///< in the unit of the fault
  float duration_s = 0.0F;      ///< 0: until it is ended
};

/// Why a request or command was not executed.
struct LinkRefused {
  static constexpr std::uint8_t kId = 0x60;
  static constexpr std::uint8_t kVersion = 1;
  static constexpr bool kIsCommand = false;
  std::uint8_t message = 0;    ///< id of the request
  LinkRefusal reason = {};     ///< why
  std::uint64_t sequence = 0;  ///< the command's; 0 for a request
  double lowest = 0.0;         ///< out of range: the least value
  double highest = 0.0;        ///< out of range: the largest value
};

/// A command was executed. There is none for references and heartbeats.
struct LinkDone {
  static constexpr std::uint8_t kId = 0x61;
  static constexpr std::uint8_t kVersion = 1;
  static constexpr bool kIsCommand = false;
  std::uint8_t message = 0;    ///< id of the command
  std::uint64_t sequence = 0;  ///< the command's
  std::uint64_t clock_ns = 0;  ///< clock of the joint
};

/// Writes a payload; a command with its CRC-32, for which `route` is needed. Too long a text is cut off.
/// @returns the number of bytes; 0 if `out` or a payload is too short
[[nodiscard]] std::size_t encode_payload(const LinkPing& message, LinkRoute route,
                                         std::span<std::uint8_t> out) noexcept TORSIO_REALTIME;
[[nodiscard]] std::size_t encode_payload(const LinkPong& message, LinkRoute route,
                                         std::span<std::uint8_t> out) noexcept TORSIO_REALTIME;
[[nodiscard]] std::size_t encode_payload(const LinkInformationRequest& message, LinkRoute route,
                                         std::span<std::uint8_t> out) noexcept TORSIO_REALTIME;
[[nodiscard]] std::size_t encode_payload(const LinkInformation& message, LinkRoute route,
                                         std::span<std::uint8_t> out) noexcept TORSIO_REALTIME;
[[nodiscard]] std::size_t encode_payload(const LinkRegisterRead& message, LinkRoute route,
                                         std::span<std::uint8_t> out) noexcept TORSIO_REALTIME;
[[nodiscard]] std::size_t encode_payload(const LinkRegisterValue& message, LinkRoute route,
                                         std::span<std::uint8_t> out) noexcept TORSIO_REALTIME;
[[nodiscard]] std::size_t encode_payload(const LinkRegisterDescribe& message, LinkRoute route,
                                         std::span<std::uint8_t> out) noexcept TORSIO_REALTIME;
[[nodiscard]] std::size_t encode_payload(const LinkRegisterDescription& message, LinkRoute route,
                                         std::span<std::uint8_t> out) noexcept TORSIO_REALTIME;
[[nodiscard]] std::size_t encode_payload(const LinkRegisterWrite& message, LinkRoute route,
                                         std::span<std::uint8_t> out) noexcept TORSIO_REALTIME;
[[nodiscard]] std::size_t encode_payload(const LinkStateChange& message, LinkRoute route,
                                         std::span<std::uint8_t> out) noexcept TORSIO_REALTIME;
[[nodiscard]] std::size_t encode_payload(const LinkState& message, LinkRoute route,
                                         std::span<std::uint8_t> out) noexcept TORSIO_REALTIME;
[[nodiscard]] std::size_t encode_payload(const LinkReference& message, LinkRoute route,
                                         std::span<std::uint8_t> out) noexcept TORSIO_REALTIME;
[[nodiscard]] std::size_t encode_payload(const LinkModeChange& message, LinkRoute route,
                                         std::span<std::uint8_t> out) noexcept TORSIO_REALTIME;
[[nodiscard]] std::size_t encode_payload(const LinkStop& message, LinkRoute route,
                                         std::span<std::uint8_t> out) noexcept TORSIO_REALTIME;
[[nodiscard]] std::size_t encode_payload(const LinkSubscribe& message, LinkRoute route,
                                         std::span<std::uint8_t> out) noexcept TORSIO_REALTIME;
[[nodiscard]] std::size_t encode_payload(const LinkSubscription& message, LinkRoute route,
                                         std::span<std::uint8_t> out) noexcept TORSIO_REALTIME;
[[nodiscard]] std::size_t encode_payload(const LinkTelemetry& message, LinkRoute route,
                                         std::span<std::uint8_t> out) noexcept TORSIO_REALTIME;
[[nodiscard]] std::size_t encode_payload(const LinkChannelDescribe& message, LinkRoute route,
                                         std::span<std::uint8_t> out) noexcept TORSIO_REALTIME;
[[nodiscard]] std::size_t encode_payload(const LinkChannelDescription& message, LinkRoute route,
                                         std::span<std::uint8_t> out) noexcept TORSIO_REALTIME;
[[nodiscard]] std::size_t encode_payload(const LinkUploadBegin& message, LinkRoute route,
                                         std::span<std::uint8_t> out) noexcept TORSIO_REALTIME;
[[nodiscard]] std::size_t encode_payload(const LinkUploadChunk& message, LinkRoute route,
                                         std::span<std::uint8_t> out) noexcept TORSIO_REALTIME;
[[nodiscard]] std::size_t encode_payload(const LinkUploadCommit& message, LinkRoute route,
                                         std::span<std::uint8_t> out) noexcept TORSIO_REALTIME;
[[nodiscard]] std::size_t encode_payload(const LinkUploadAbort& message, LinkRoute route,
                                         std::span<std::uint8_t> out) noexcept TORSIO_REALTIME;
[[nodiscard]] std::size_t encode_payload(const LinkUpload& message, LinkRoute route,
                                         std::span<std::uint8_t> out) noexcept TORSIO_REALTIME;
[[nodiscard]] std::size_t encode_payload(const LinkZero& message, LinkRoute route,
                                         std::span<std::uint8_t> out) noexcept TORSIO_REALTIME;
[[nodiscard]] std::size_t encode_payload(const LinkInjectFault& message, LinkRoute route,
                                         std::span<std::uint8_t> out) noexcept TORSIO_REALTIME;
[[nodiscard]] std::size_t encode_payload(const LinkRefused& message, LinkRoute route,
                                         std::span<std::uint8_t> out) noexcept TORSIO_REALTIME;
[[nodiscard]] std::size_t encode_payload(const LinkDone& message, LinkRoute route,
                                         std::span<std::uint8_t> out) noexcept TORSIO_REALTIME;

/// Reads a payload with this id. The CRC-32 of a command is not checked: `is_intact_command`.
/// @returns `none`, or why it is not such a message; `message` may then have been changed in part
[[nodiscard]] LinkRefusal decode_payload(std::span<const std::uint8_t> payload,
                                         LinkPing& message) noexcept TORSIO_REALTIME;
[[nodiscard]] LinkRefusal decode_payload(std::span<const std::uint8_t> payload,
                                         LinkPong& message) noexcept TORSIO_REALTIME;
[[nodiscard]] LinkRefusal decode_payload(std::span<const std::uint8_t> payload,
                                         LinkInformationRequest& message) noexcept TORSIO_REALTIME;
[[nodiscard]] LinkRefusal decode_payload(std::span<const std::uint8_t> payload,
                                         LinkInformation& message) noexcept TORSIO_REALTIME;
[[nodiscard]] LinkRefusal decode_payload(std::span<const std::uint8_t> payload,
                                         LinkRegisterRead& message) noexcept TORSIO_REALTIME;
[[nodiscard]] LinkRefusal decode_payload(std::span<const std::uint8_t> payload,
                                         LinkRegisterValue& message) noexcept TORSIO_REALTIME;
[[nodiscard]] LinkRefusal decode_payload(std::span<const std::uint8_t> payload,
                                         LinkRegisterDescribe& message) noexcept TORSIO_REALTIME;
[[nodiscard]] LinkRefusal decode_payload(std::span<const std::uint8_t> payload,
                                         LinkRegisterDescription& message) noexcept TORSIO_REALTIME;
[[nodiscard]] LinkRefusal decode_payload(std::span<const std::uint8_t> payload,
                                         LinkRegisterWrite& message) noexcept TORSIO_REALTIME;
[[nodiscard]] LinkRefusal decode_payload(std::span<const std::uint8_t> payload,
                                         LinkStateChange& message) noexcept TORSIO_REALTIME;
[[nodiscard]] LinkRefusal decode_payload(std::span<const std::uint8_t> payload,
                                         LinkState& message) noexcept TORSIO_REALTIME;
[[nodiscard]] LinkRefusal decode_payload(std::span<const std::uint8_t> payload,
                                         LinkReference& message) noexcept TORSIO_REALTIME;
[[nodiscard]] LinkRefusal decode_payload(std::span<const std::uint8_t> payload,
                                         LinkModeChange& message) noexcept TORSIO_REALTIME;
[[nodiscard]] LinkRefusal decode_payload(std::span<const std::uint8_t> payload,
                                         LinkStop& message) noexcept TORSIO_REALTIME;
[[nodiscard]] LinkRefusal decode_payload(std::span<const std::uint8_t> payload,
                                         LinkSubscribe& message) noexcept TORSIO_REALTIME;
[[nodiscard]] LinkRefusal decode_payload(std::span<const std::uint8_t> payload,
                                         LinkSubscription& message) noexcept TORSIO_REALTIME;
[[nodiscard]] LinkRefusal decode_payload(std::span<const std::uint8_t> payload,
                                         LinkTelemetry& message) noexcept TORSIO_REALTIME;
[[nodiscard]] LinkRefusal decode_payload(std::span<const std::uint8_t> payload,
                                         LinkChannelDescribe& message) noexcept TORSIO_REALTIME;
[[nodiscard]] LinkRefusal decode_payload(std::span<const std::uint8_t> payload,
                                         LinkChannelDescription& message) noexcept TORSIO_REALTIME;
[[nodiscard]] LinkRefusal decode_payload(std::span<const std::uint8_t> payload,
                                         LinkUploadBegin& message) noexcept TORSIO_REALTIME;
[[nodiscard]] LinkRefusal decode_payload(std::span<const std::uint8_t> payload,
                                         LinkUploadChunk& message) noexcept TORSIO_REALTIME;
[[nodiscard]] LinkRefusal decode_payload(std::span<const std::uint8_t> payload,
                                         LinkUploadCommit& message) noexcept TORSIO_REALTIME;
[[nodiscard]] LinkRefusal decode_payload(std::span<const std::uint8_t> payload,
                                         LinkUploadAbort& message) noexcept TORSIO_REALTIME;
[[nodiscard]] LinkRefusal decode_payload(std::span<const std::uint8_t> payload,
                                         LinkUpload& message) noexcept TORSIO_REALTIME;
[[nodiscard]] LinkRefusal decode_payload(std::span<const std::uint8_t> payload,
                                         LinkZero& message) noexcept TORSIO_REALTIME;
[[nodiscard]] LinkRefusal decode_payload(std::span<const std::uint8_t> payload,
                                         LinkInjectFault& message) noexcept TORSIO_REALTIME;
[[nodiscard]] LinkRefusal decode_payload(std::span<const std::uint8_t> payload,
                                         LinkRefused& message) noexcept TORSIO_REALTIME;
[[nodiscard]] LinkRefusal decode_payload(std::span<const std::uint8_t> payload,
                                         LinkDone& message) noexcept TORSIO_REALTIME;

/// "LinkPing"; empty if no message has this id.
[[nodiscard]] std::string_view link_message_name(std::uint8_t id) noexcept;
/// Whether messages with this id have a seal and a CRC-32.
[[nodiscard]] bool is_link_command(std::uint8_t id) noexcept TORSIO_REALTIME;

/// Calls visit(std::type_identity<Message>()) for the message to a joint that has this id. @returns whether there is one
template <class Visit>
bool visit_type_to_joint(std::uint8_t id, Visit&& visit) {
  switch (id) {
    case LinkPing::kId: visit(std::type_identity<LinkPing>()); return true;
    case LinkInformationRequest::kId:
      visit(std::type_identity<LinkInformationRequest>());
      return true;
    case LinkRegisterRead::kId: visit(std::type_identity<LinkRegisterRead>()); return true;
    case LinkRegisterDescribe::kId: visit(std::type_identity<LinkRegisterDescribe>()); return true;
    case LinkRegisterWrite::kId: visit(std::type_identity<LinkRegisterWrite>()); return true;
    case LinkStateChange::kId: visit(std::type_identity<LinkStateChange>()); return true;
    case LinkReference::kId: visit(std::type_identity<LinkReference>()); return true;
    case LinkModeChange::kId: visit(std::type_identity<LinkModeChange>()); return true;
    case LinkStop::kId: visit(std::type_identity<LinkStop>()); return true;
    case LinkSubscribe::kId: visit(std::type_identity<LinkSubscribe>()); return true;
    case LinkChannelDescribe::kId: visit(std::type_identity<LinkChannelDescribe>()); return true;
    case LinkUploadBegin::kId: visit(std::type_identity<LinkUploadBegin>()); return true;
    case LinkUploadChunk::kId: visit(std::type_identity<LinkUploadChunk>()); return true;
    case LinkUploadCommit::kId: visit(std::type_identity<LinkUploadCommit>()); return true;
    case LinkUploadAbort::kId: visit(std::type_identity<LinkUploadAbort>()); return true;
    case LinkZero::kId: visit(std::type_identity<LinkZero>()); return true;
    case LinkInjectFault::kId: visit(std::type_identity<LinkInjectFault>()); return true;
    default: return false;
  }
}

/// Calls visit(std::type_identity<Message>()) for the message to a host that has this id. @returns whether there is one
template <class Visit>
bool visit_type_to_host(std::uint8_t id, Visit&& visit) {
  switch (id) {
    case LinkPong::kId: visit(std::type_identity<LinkPong>()); return true;
    case LinkInformation::kId: visit(std::type_identity<LinkInformation>()); return true;
    case LinkRegisterValue::kId: visit(std::type_identity<LinkRegisterValue>()); return true;
    case LinkRegisterDescription::kId:
      visit(std::type_identity<LinkRegisterDescription>());
      return true;
    case LinkState::kId: visit(std::type_identity<LinkState>()); return true;
    case LinkSubscription::kId: visit(std::type_identity<LinkSubscription>()); return true;
    case LinkTelemetry::kId: visit(std::type_identity<LinkTelemetry>()); return true;
    case LinkChannelDescription::kId:
      visit(std::type_identity<LinkChannelDescription>());
      return true;
    case LinkUpload::kId: visit(std::type_identity<LinkUpload>()); return true;
    case LinkRefused::kId: visit(std::type_identity<LinkRefused>()); return true;
    case LinkDone::kId: visit(std::type_identity<LinkDone>()); return true;
    default: return false;
  }
}

}  // namespace torsio

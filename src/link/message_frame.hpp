#pragma once

#include "link/payload_bytes.hpp"
#include "torsio/link/command_guard.hpp"

// What is the same in all payloads: id, version, and the seal and CRC-32 of a command.

namespace torsio::detail {

template <class Message>
void begin_payload(PayloadWriter& writer, const Message& message) noexcept {
  writer.add(Message::kId);
  writer.add(Message::kVersion);
  if constexpr (Message::kIsCommand) {
    writer.add(message.seal.sequence);
    writer.add(message.seal.clock_ns);
  }
}

template <class Message>
std::size_t end_payload(PayloadWriter& writer, [[maybe_unused]] LinkRoute route) noexcept {
  if constexpr (Message::kIsCommand) writer.add(command_checksum(route, writer.written()));
  return writer.size();
}

/// Takes from the payload what is the same in all, so that the fields are left.
template <class Message>
LinkRefusal open_payload(std::span<const std::uint8_t>& payload, Message& message) noexcept {
  if (payload.size() < 2) return LinkRefusal::wrong_length;
  if (payload[0] != Message::kId) return LinkRefusal::unknown_message;
  if (payload[1] != Message::kVersion) return LinkRefusal::wrong_version;
  payload = payload.subspan(2);
  if constexpr (Message::kIsCommand) {
    if (payload.size() < kCommandBytes - 2) return LinkRefusal::wrong_length;
    PayloadReader reader(payload);
    reader.read(message.seal.sequence);
    reader.read(message.seal.clock_ns);
    payload = payload.subspan(sizeof(std::uint64_t) * 2, payload.size() + 2 - kCommandBytes);
  }
  return LinkRefusal::none;
}

}  // namespace torsio::detail

#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "torsio/core/realtime.hpp"
#include "torsio/link/can_bus.hpp"

// Frames as python-can packs them for its `udp_multicast` (can.interfaces.udp_multicast.utils): a MessagePack map with the
// fields of a can.Message. Neither function uses the heap or throws, so that a loop can call them.

namespace torsio::detail {

inline constexpr std::size_t kLongestCanDatagram = 192;

/// @returns the number of bytes written
std::size_t encode_can_datagram(const CanFrame& frame,
                                std::span<std::uint8_t, kLongestCanDatagram> out) noexcept
    TORSIO_REALTIME;

/// @returns whether the bytes are exactly one map that describes a valid frame of CAN 2.0. Fields without a meaning for one
/// (timestamp, channel) may have any number, text or nil; as in python-can an id without `is_extended_id` has 29 bits.
[[nodiscard]] bool decode_can_datagram(std::span<const std::uint8_t> bytes,
                                       CanFrame& frame) noexcept TORSIO_REALTIME;

}  // namespace torsio::detail

#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

namespace torsio {

inline constexpr std::size_t kCanDataBytes = 8;
inline constexpr std::uint32_t kCanHighestId = 0x7FF;                ///< an id has 11 bits
inline constexpr std::uint32_t kCanHighestExtendedId = 0x1FFF'FFFF;  ///< a long id has 29 bits

/// A frame of CAN 2.0; CAN FD is not used.
struct CanFrame {
  std::uint32_t id = 0;
  bool is_extended = false;  ///< the id has 29 bits, not 11
  bool is_remote = false;    ///< asks for a frame of this id, without data
  bool is_error = false;     ///< an error of the bus, not a message
  std::uint8_t size = 0;  ///< bytes of the data, 0 to 8; of a remote frame the number it asks for
  std::array<std::uint8_t, kCanDataBytes> data = {};

  [[nodiscard]] std::span<const std::uint8_t> bytes() const noexcept {
    return std::span(data).first(is_remote ? 0 : std::min<std::size_t>(size, kCanDataBytes));
  }
  bool operator==(const CanFrame&) const = default;
};

/// Where frames go: a bus, or a test.
class CanSink {
 public:
  virtual ~CanSink() = default;
  /// @returns false if the frame could not be sent; it is then lost, and counted
  virtual bool send(const CanFrame& frame) noexcept = 0;
};

/// A CAN bus, or its replacement. Never waits; uses no heap after it was opened. Frames that it has sent itself are not
/// received. Closed by its destructor.
class CanBus : public CanSink {
 public:
  struct Counts {
    std::uint64_t malformed = 0;  ///< datagrams that are not a frame of CAN 2.0
    std::uint64_t foreign = 0;    ///< datagrams from an address that is not permitted
    std::uint64_t not_sent = 0;
  };

  CanBus() = default;
  CanBus(const CanBus&) = delete;
  CanBus& operator=(const CanBus&) = delete;

  /// @returns whether a frame has arrived. False also after some datagrams that were only counted: none keeps a loop for long.
  [[nodiscard]] virtual bool receive(CanFrame& frame) noexcept = 0;
  /// For poll(2).
  [[nodiscard]] virtual int descriptor() const noexcept = 0;
  /// "udp_multicast:239.74.163.2:43113", "socketcan:can0"
  [[nodiscard]] virtual std::string place() const = 0;

  [[nodiscard]] const Counts& counts() const noexcept { return counts_; }

 protected:
  Counts& count() noexcept { return counts_; }

 private:
  Counts counts_ = {};
};

/// The interface `udp_multicast` of python-can over IPv4: each frame is a datagram to a group, a dictionary in MessagePack.
/// Group and port are python-can's own defaults for IPv4.
struct CanMulticastSettings {
  std::string group = "239.74.163.2";  ///< 224.0.0.0 to 239.255.255.255, in numbers
  std::uint16_t port = 43113;
  /// Other machines whose frames are accepted, IPv4 in numbers. With none, frames are sent to and accepted from this machine only;
  /// else they are sent to the local network (TTL 1). Addresses can be forged: this does not authenticate a host.
  std::vector<std::string> allowed = {};
};
/// @throws Error with what to do if the group is not a multicast address, the port is 0, an address is not one, or the network
/// does not permit it
[[nodiscard]] std::unique_ptr<CanBus> open_can_multicast(const CanMulticastSettings& settings);

/// A CAN interface of Linux, as "can0". Its bit rate is set with `ip link`.
/// @throws Error with what to do if there is none of that name, it is not up, or this system is not Linux
[[nodiscard]] std::unique_ptr<CanBus> open_socketcan(const std::string& interface);

}  // namespace torsio

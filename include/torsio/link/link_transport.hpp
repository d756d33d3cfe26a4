#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "torsio/link/joint_endpoint.hpp"

namespace torsio {

/// Carries the bytes of frames. Never waits, but for `wait`. Closed by its destructor; a process that is killed leaves nothing
/// that prevents the next start.
class LinkTransport : public LinkSink {
 public:
  struct Counts {
    std::uint64_t foreign = 0;  ///< datagrams from an address that is not on the list
    std::uint64_t not_sent =
        0;  ///< frames that did not fit: the other side does not read, or the line is too slow
  };

  LinkTransport() = default;
  LinkTransport(const LinkTransport&) = delete;
  LinkTransport& operator=(const LinkTransport&) = delete;

  /// @returns the number of bytes that have arrived, one datagram at most, of which the rest is lost if it is longer than
  /// `out`; 0: none. Parts of frames are usual.
  [[nodiscard]] virtual std::size_t receive(std::span<std::uint8_t> out) noexcept = 0;
  /// @returns whether bytes have arrived, or may have, within this time [ns]
  [[nodiscard]] bool wait(std::int64_t longest_ns) const noexcept;
  /// For poll(2).
  [[nodiscard]] virtual int descriptor() const noexcept = 0;
  /// Where the other side finds it: "127.0.0.1:34001", a path.
  [[nodiscard]] virtual std::string place() const = 0;
  /// Bytes per second that it carries; infinite if it does not limit them: `JointEndpoint::Settings::line_B_s`.
  [[nodiscard]] virtual double line_B_s() const noexcept;

  [[nodiscard]] const Counts& counts() const noexcept { return counts_; }

 protected:
  Counts& count() noexcept { return counts_; }

 private:
  Counts counts_ = {};
};

inline constexpr std::uint16_t kNdlcomHostPort = 34000;
inline constexpr std::uint16_t kNdlcomJointPort = 34001;

struct UdpAddress {
  std::string address = "127.0.0.1";  ///< IPv4, in numbers
  std::uint16_t port = 0;
};

/// UDP over IPv4, a datagram per frame. What a sender receives in return goes to the port of its entry in `peers`, not to the
/// port from which it sent; as on a bus every peer gets every frame.
struct UdpSettings {
  /// The interface and port on which to listen. Port 0: any free one.
  UdpAddress listen = {.port = kNdlcomJointPort};
  /// The only addresses from which datagrams are accepted. Addresses can be forged: this does not authenticate a host.
  std::vector<UdpAddress> peers = {{.port = kNdlcomHostPort}};
};
/// @throws Error with what to do if an address is not one, there is no peer, the port is in use, or listening is not permitted
[[nodiscard]] std::unique_ptr<LinkTransport> open_udp(const UdpSettings& settings);

/// Datagrams between two sockets of the file system, which only this user can open.
struct UnixSettings {
  std::string path = {};  ///< this side's; at most 107 bytes
  std::string peer = {};
};
/// @throws Error if a path is too long, its folder cannot be written, or another process listens there
[[nodiscard]] std::unique_ptr<LinkTransport> open_unix(const UnixSettings& settings);

struct SerialSettings {
  std::string device = {};  ///< "/dev/ttyUSB0"
  double baud =
      921600.0;  ///< any whole number from 115 200 to 8 000 000 that the driver has (termios2)
};
/// A serial line, raw, 8N1, without flow control, for this process alone.
/// @throws Error if the device cannot be opened, is in use, is not a serial line, or does not have this rate
[[nodiscard]] std::unique_ptr<LinkTransport> open_serial(const SerialSettings& settings);

/// A pseudo-terminal: other programs open it as a serial line.
struct PseudoTerminalSettings {
  std::string link = {};   ///< a symbolic link to it is made here; empty: none
  double baud = 921600.0;  ///< paced by a `TokenBucket`, since a pseudo-terminal has no rate
};
/// @throws Error if there is none left, or another process has made the link
[[nodiscard]] std::unique_ptr<LinkTransport> open_pseudo_terminal(
    const PseudoTerminalSettings& settings);

}  // namespace torsio

#include "torsio/link/joint_line.hpp"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <netinet/in.h>
#include <sys/socket.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <thread>

#include "core/checks.hpp"
#include "link/descriptor.hpp"
#include "torsio/link/host_endpoint.hpp"

namespace torsio {
namespace {

constexpr std::uint8_t kLastJoint = 253;
/// What 253 pings need at 115 200 baud.
constexpr int kLongestQueueMs = 400;

/// The address of the interface through which the joints are reached: that of a socket which is connected to them.
std::string own_address(const JointLine& line) {
  sockaddr_in other{};
  other.sin_family = AF_INET;
  other.sin_port = htons(line.port);
  if (::inet_pton(AF_INET, line.host.c_str(), &other.sin_addr) != 1)
    refuse("UDP: the address of the joints", "an IPv4 address in numbers", "'" + line.host + "'");
  const detail::Descriptor probe(::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0));
  sockaddr_in own{};
  socklen_t size = sizeof(own);
  if (::connect(probe.number(), reinterpret_cast<const sockaddr*>(&other), sizeof(other)) != 0 ||
      ::getsockname(probe.number(), reinterpret_cast<sockaddr*>(&own), &size) != 0)
    detail::refuse_system(name(line), "cannot be reached", errno,
                          "`ip route get " + line.host + "` shows the route to it.");
  std::array<char, INET_ADDRSTRLEN> text{};
  ::inet_ntop(AF_INET, &own.sin_addr, text.data(), text.size());
  return text.data();
}

void ping_all(LinkTransport& line, std::uint8_t host_id) {
  int waits = kLongestQueueMs;
  for (std::uint8_t joint = 1; joint <= kLastJoint; ++joint) {
    if (joint == host_id) continue;
    HostEndpoint host({.id = host_id, .joint = joint});
    std::array<std::uint8_t, kNdlcomMaxEncodedBytes> frame;
    const std::size_t size = host.build(LinkPing{.token = joint}, frame);
    // A serial line takes a part of them at once; the others wait until there is space.
    while (!line.send(std::span(frame).first(size)) && waits-- > 0)
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
}

}  // namespace

std::string name(const JointLine& line) {
  if (!line.unix_path.empty()) return line.unix_path;
  if (!line.serial.empty()) return line.serial;
  return fmt::format("{}:{}", line.host, line.port);
}

std::unique_ptr<LinkTransport> open_joint_line(const JointLine& line) {
  if (!line.unix_path.empty() && !line.serial.empty())
    throw UsageError({.place = "line to the joints",
                      .expected = "a path of a socket or a serial device",
                      .found = fmt::format("'{}' and '{}'", line.unix_path, line.serial)});
  if (!line.unix_path.empty())
    return open_unix({.path = line.unix_path + ".host", .peer = line.unix_path});
  if (!line.serial.empty()) return open_serial({.device = line.serial, .baud = line.baud});
  return open_udp({.listen = {.address = own_address(line), .port = line.host_port},
                   .peers = {{.address = line.host, .port = line.port}}});
}

std::vector<std::uint8_t> find_joints(LinkTransport& line, std::uint8_t host_id, double wait_s) {
  std::array<bool, 256> has_replied{};
  NdlcomDecoder decoder;
  const auto receive = [&] {
    std::array<std::uint8_t, 2048> buffer;
    for (std::size_t size = 0; (size = line.receive(buffer)) > 0;) {
      std::span<const std::uint8_t> bytes = std::span(buffer).first(size);
      while (const auto frame = decoder.next(bytes)) {
        const bool is_pong = frame->receiver == host_id && !frame->payload.empty() &&
                             frame->payload[0] == LinkPong::kId;
        has_replied[frame->sender] = has_replied[frame->sender] || is_pong;
      }
    }
  };
  ping_all(line, host_id);
  const std::int64_t end_ns = detail::monotonic_ns() + static_cast<std::int64_t>(1e9 * wait_s);
  receive();
  for (std::int64_t left_ns = 0; (left_ns = end_ns - detail::monotonic_ns()) > 0; receive())
    static_cast<void>(line.wait(left_ns));
  std::vector<std::uint8_t> found;
  for (std::size_t id = 1; id <= kLastJoint; ++id)
    if (has_replied[id]) found.push_back(static_cast<std::uint8_t>(id));
  return found;
}

}  // namespace torsio

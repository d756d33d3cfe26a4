// CAN frames in datagrams to a multicast group, as python-can's `udp_multicast` sends them.
#include <arpa/inet.h>
#include <fmt/format.h>
#include <ifaddrs.h>
#include <netinet/in.h>
#include <sys/socket.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <vector>

#include "core/checks.hpp"
#include "link/can_datagram.hpp"
#include "link/descriptor.hpp"
#include "torsio/link/can_bus.hpp"

namespace torsio {
namespace {

using detail::Descriptor;

/// Datagrams that one call of `receive` looks at: the bus returns also what this side has sent.
constexpr int kCanDatagramsPerCall = 16;

in_addr ipv4_address(const std::string& text, const std::string& place, std::string_view what) {
  in_addr made{};
  if (::inet_pton(AF_INET, text.c_str(), &made) != 1) refuse(place, what, "'" + text + "'");
  return made;
}

sockaddr_in socket_address(in_addr address, std::uint16_t port) noexcept {
  sockaddr_in made{};
  made.sin_family = AF_INET;
  made.sin_port = htons(port);
  made.sin_addr = address;
  return made;
}

sockaddr* as_any(sockaddr_in& address) noexcept { return reinterpret_cast<sockaddr*>(&address); }

/// Addresses of the interfaces of this machine.
std::vector<in_addr_t> own_addresses(const std::string& place) {
  ifaddrs* first = nullptr;
  if (::getifaddrs(&first) != 0)
    detail::refuse_system(place, "the addresses of this machine are not known", errno);
  const std::unique_ptr<ifaddrs, decltype(&::freeifaddrs)> owner(first, ::freeifaddrs);
  std::vector<in_addr_t> all;
  for (const ifaddrs* each = first; each != nullptr; each = each->ifa_next)
    if (each->ifa_addr != nullptr && each->ifa_addr->sa_family == AF_INET)
      all.push_back(reinterpret_cast<const sockaddr_in*>(each->ifa_addr)->sin_addr.s_addr);
  return all;
}

Descriptor new_socket(const std::string& place) {
  Descriptor made(::socket(AF_INET, SOCK_DGRAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0));
  if (!made.is_open()) detail::refuse_system(place, "no socket can be made", errno);
  return made;
}

template <class Value>
void set_option(const Descriptor& socket, int level, int option, const Value& value,
                const std::string& place, std::string_view problem, std::string_view advice = {}) {
  if (::setsockopt(socket.number(), level, option, &value, sizeof(value)) != 0)
    detail::refuse_system(place, problem, errno, advice);
}

class CanMulticast : public CanBus {
 public:
  explicit CanMulticast(const CanMulticastSettings& settings)
      : place_(fmt::format("udp_multicast:{}:{}", settings.group, settings.port)) {
    const in_addr group =
        ipv4_address(settings.group, place_, "a group, 224.0.0.0 to 239.255.255.255 in numbers");
    require(IN_MULTICAST(ntohl(group.s_addr)), place_,
            "a group, 224.0.0.0 to 239.255.255.255 in numbers", "'" + settings.group + "'");
    require(settings.port != 0, place_, "a port of 1 to 65535", "0");
    permitted_ = own_addresses(place_);
    for (const std::string& each : settings.allowed)
      permitted_.push_back(ipv4_address(each, place_, "an IPv4 address in numbers").s_addr);
    group_ = socket_address(group, settings.port);
    open_receiver(group);
    open_sender(settings.allowed.empty() ? 0 : 1);
  }

  bool receive(CanFrame& frame) noexcept override {
    for (int n = 0; n < kCanDatagramsPerCall; ++n) {
      sockaddr_in from{};
      socklen_t size = sizeof(from);
      // With MSG_TRUNC the length is that of the datagram, also of one that is longer than the space for it.
      const ssize_t got = ::recvfrom(receiver_.number(), bytes_.data(), bytes_.size(), MSG_TRUNC,
                                     as_any(from), &size);
      if (got < 0 && errno == EINTR) continue;
      if (got < 0) return false;
      if (from.sin_port == own_.sin_port && from.sin_addr.s_addr == own_.sin_addr.s_addr) continue;
      if (std::ranges::find(permitted_, from.sin_addr.s_addr) == permitted_.end()) {
        ++count().foreign;
        continue;
      }
      const auto length = static_cast<std::size_t>(got);
      if (length <= bytes_.size() &&
          detail::decode_can_datagram(std::span(bytes_).first(length), frame))
        return true;
      ++count().malformed;
    }
    return false;
  }

  bool send(const CanFrame& frame) noexcept override {
    std::array<std::uint8_t, detail::kLongestCanDatagram> datagram;
    const std::size_t size = detail::encode_can_datagram(frame, datagram);
    const bool is_sent =
        ::send(sender_.number(), datagram.data(), size, MSG_NOSIGNAL) == static_cast<ssize_t>(size);
    count().not_sent += is_sent ? 0U : 1U;
    return is_sent;
  }

  int descriptor() const noexcept override { return receiver_.number(); }
  std::string place() const override { return place_; }

 private:
  /// Programs that use a group share its port.
  void open_receiver(in_addr group) {
    receiver_ = new_socket(place_);
    set_option(receiver_, SOL_SOCKET, SO_REUSEADDR, 1, place_, "the port cannot be shared");
    if (::bind(receiver_.number(), as_any(group_), sizeof(group_)) != 0)
      detail::refuse_system(
          place_, "cannot listen", errno,
          "A program that does not share this port uses it: choose another, as in "
          "udp_multicast:239.74.163.2:43114, for all programs on the bus.");
    ip_mreq request{};
    request.imr_multiaddr = group;
    request.imr_interface.s_addr = htonl(INADDR_ANY);
    set_option(receiver_, IPPROTO_IP, IP_ADD_MEMBERSHIP, request, place_,
               "the group cannot be joined",
               "Multicast needs a route, as that of a default gateway (`ip route`).");
  }
  /// Another socket than that of the receiver, since its port distinguishes the frames of this side.
  void open_sender(int hops) {
    sender_ = new_socket(place_);
    set_option(sender_, IPPROTO_IP, IP_MULTICAST_TTL, hops, place_, "its range cannot be set");
    set_option(sender_, IPPROTO_IP, IP_MULTICAST_LOOP, 1, place_,
               "programs of this machine cannot be reached");
    if (::connect(sender_.number(), as_any(group_), sizeof(group_)) != 0)
      detail::refuse_system(place_, "cannot send", errno,
                            "Multicast needs a route, as that of a default gateway (`ip route`).");
    socklen_t size = sizeof(own_);
    if (::getsockname(sender_.number(), as_any(own_), &size) != 0)
      detail::refuse_system(place_, "its own address is not known", errno);
  }

  std::string place_;
  std::vector<in_addr_t> permitted_ = {};
  sockaddr_in group_ = {};
  sockaddr_in own_ = {};
  Descriptor receiver_ = Descriptor();
  Descriptor sender_ = Descriptor();
  std::array<std::uint8_t, 1024> bytes_ = {};
};

}  // namespace

std::unique_ptr<CanBus> open_can_multicast(const CanMulticastSettings& settings) {
  return std::make_unique<CanMulticast>(settings);
}

}  // namespace torsio

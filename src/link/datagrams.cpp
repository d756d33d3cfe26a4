// Transports with a datagram per frame: UDP and sockets of the file system.
#include <arpa/inet.h>
#include <fmt/format.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>

#include "core/checks.hpp"
#include "link/descriptor.hpp"
#include "torsio/link/link_transport.hpp"

namespace torsio {
namespace {

using detail::Descriptor;

sockaddr_in socket_address(const UdpAddress& address, std::string_view what) {
  sockaddr_in made{};
  made.sin_family = AF_INET;
  made.sin_port = htons(address.port);
  if (::inet_pton(AF_INET, address.address.c_str(), &made.sin_addr) != 1)
    refuse(fmt::format("UDP: {}", what), "an IPv4 address in numbers", "'" + address.address + "'");
  return made;
}

const sockaddr* as_general(const sockaddr_in& address) noexcept {
  return reinterpret_cast<const sockaddr*>(&address);
}
const sockaddr* as_general(const sockaddr_un& address) noexcept {
  return reinterpret_cast<const sockaddr*>(&address);
}

std::string address_text(const sockaddr_in& address) {
  std::array<char, INET_ADDRSTRLEN> text{};
  ::inet_ntop(AF_INET, &address.sin_addr, text.data(), text.size());
  return fmt::format("{}:{}", text.data(), ntohs(address.sin_port));
}

/// For a host that is late: a third of a second of twelve joints at 1 kHz. The system gives at most net.core.rmem_max.
constexpr int kReceiveBuffer_B = 4 << 20;

Descriptor datagram_socket(int family, const std::string& place) {
  Descriptor made(::socket(family, SOCK_DGRAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0));
  if (!made.is_open()) detail::refuse_system(place, "no socket can be made", errno);
  // Refused or limited: then late datagrams are lost, and counted.
  static_cast<void>(::setsockopt(made.number(), SOL_SOCKET, SO_RCVBUF, &kReceiveBuffer_B,
                                 sizeof(kReceiveBuffer_B)));
  return made;
}

std::string_view advice_for_bind(int error_number) noexcept {
  if (error_number == EADDRINUSE)
    return "Another process listens on this port: end it, or choose another port (`ss -ulpn` lists "
           "them).";
  if (error_number == EADDRNOTAVAIL)
    return "No interface of this machine has that address (`ip address` lists them).";
  if (error_number == EACCES) return "Ports below 1024 need a permission: choose a higher one.";
  return "Choose another address or port.";
}

class UdpTransport : public LinkTransport {
 public:
  explicit UdpTransport(const UdpSettings& settings) {
    const sockaddr_in listen = socket_address(settings.listen, "the address to listen on");
    require(!settings.peers.empty(), "UDP", "at least one peer", "none");
    for (const UdpAddress& peer : settings.peers) {
      peers_.push_back(socket_address(peer, "the address of a peer"));
      require(peer.port != 0, "UDP: a peer", "a port of 1 to 65535", "0");
      if (peer.port == settings.listen.port && peer.address == settings.listen.address)
        refuse("UDP: a peer", "another port than that of this side",
               fmt::format("{} for both", peer.port));
    }
    const std::string place = "UDP " + address_text(listen);
    socket_ = datagram_socket(AF_INET, place);
    if (::bind(socket_.number(), as_general(listen), sizeof(listen)) != 0) {
      const int error_number = errno;
      detail::refuse_system(place, "cannot listen", error_number, advice_for_bind(error_number));
    }
  }

  std::size_t receive(std::span<std::uint8_t> out) noexcept override {
    for (;;) {
      sockaddr_in from{};
      socklen_t size = sizeof(from);
      const ssize_t got = ::recvfrom(socket_.number(), out.data(), out.size(), 0,
                                     reinterpret_cast<sockaddr*>(&from), &size);
      if (got < 0 && errno == EINTR) continue;
      if (got < 0) return 0;
      const bool is_peer = std::ranges::any_of(peers_, [&](const sockaddr_in& peer) {
        return peer.sin_addr.s_addr == from.sin_addr.s_addr;
      });
      if (is_peer && got > 0) return static_cast<std::size_t>(got);
      count().foreign += is_peer ? 0U : 1U;
    }
  }

  bool send(std::span<const std::uint8_t> frame) noexcept override {
    bool is_sent = true;
    for (const sockaddr_in& peer : peers_)
      is_sent = ::sendto(socket_.number(), frame.data(), frame.size(), MSG_NOSIGNAL,
                         as_general(peer), sizeof(peer)) == static_cast<ssize_t>(frame.size()) &&
                is_sent;
    count().not_sent += is_sent ? 0U : 1U;
    return is_sent;
  }

  int descriptor() const noexcept override { return socket_.number(); }
  std::string place() const override {
    sockaddr_in bound{};
    socklen_t size = sizeof(bound);
    ::getsockname(socket_.number(), reinterpret_cast<sockaddr*>(&bound), &size);
    return address_text(bound);
  }

 private:
  Descriptor socket_;
  std::vector<sockaddr_in> peers_;
};

sockaddr_un unix_address(const std::string& path) {
  sockaddr_un made{};
  made.sun_family = AF_UNIX;
  require(!path.empty() && path.size() < sizeof(made.sun_path), "Unix socket",
          fmt::format("a path of 1 to {} bytes", sizeof(made.sun_path) - 1),
          fmt::format("{}: '{}'", path.size(), path));
  std::memcpy(made.sun_path, path.data(), path.size());
  return made;
}

class UnixTransport : public LinkTransport {
 public:
  explicit UnixTransport(const UnixSettings& settings) : peer_(unix_address(settings.peer)) {
    const sockaddr_un own = unix_address(settings.path);
    require(settings.path != settings.peer, "Unix socket", "two paths",
            "'" + settings.path + "' for both");
    path_ = detail::OwnedPath(settings.path);
    socket_ = datagram_socket(AF_UNIX, settings.path);
    // The mode of the socket's file is set before it exists under its name.
    if (::fchmod(socket_.number(), S_IRUSR | S_IWUSR) != 0 ||
        ::bind(socket_.number(), as_general(own), sizeof(own)) != 0)
      detail::refuse_system(settings.path, "cannot listen", errno,
                            "Choose a path in a folder that you may write.");
  }

  std::size_t receive(std::span<std::uint8_t> out) noexcept override {
    for (;;) {
      const ssize_t got = ::recv(socket_.number(), out.data(), out.size(), 0);
      if (got > 0) return static_cast<std::size_t>(got);
      if (got == 0) continue;
      if (errno != EINTR) return 0;
    }
  }
  bool send(std::span<const std::uint8_t> frame) noexcept override {
    const bool is_sent =
        ::sendto(socket_.number(), frame.data(), frame.size(), MSG_NOSIGNAL, as_general(peer_),
                 sizeof(peer_)) == static_cast<ssize_t>(frame.size());
    count().not_sent += is_sent ? 0U : 1U;
    return is_sent;
  }

  int descriptor() const noexcept override { return socket_.number(); }
  std::string place() const override { return path_.text(); }

 private:
  sockaddr_un peer_;
  detail::OwnedPath path_;
  Descriptor socket_;
};

}  // namespace

std::unique_ptr<LinkTransport> open_udp(const UdpSettings& settings) {
  return std::make_unique<UdpTransport>(settings);
}

std::unique_ptr<LinkTransport> open_unix(const UnixSettings& settings) {
  return std::make_unique<UnixTransport>(settings);
}

}  // namespace torsio

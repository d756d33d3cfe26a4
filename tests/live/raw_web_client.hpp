#pragma once

#include <arpa/inet.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <thread>
#include <utility>

namespace torsio::test {

/// Until `is_done()`, for half a minute at most. @returns whether it is
template <class IsDone>
bool wait_until(const IsDone& is_done) {
  const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(30);
  while (!is_done() && std::chrono::steady_clock::now() < end)
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  return is_done();
}

/// A client of HTTP and WebSocket of the bytes that a test gives it: also wrong and half ones.
class RawWebClient {
 public:
  struct Handshake {
    std::string path = "/";
    std::string subprotocol = "echo";
    std::string host = {};    ///< empty: 127.0.0.1 with the port
    std::string origin = {};  ///< empty: none
    std::string more = {};    ///< further headers, each with its end of line
  };
  struct Frame {
    int opcode = 0;  ///< 1 text, 2 binary, 8 close, 9 ping
    std::string payload = {};
  };

  explicit RawWebClient(std::uint16_t port, int receive_buffer_B = 0)
      : port_(port), socket_(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
    if (receive_buffer_B > 0)
      ::setsockopt(socket_, SOL_SOCKET, SO_RCVBUF, &receive_buffer_B, sizeof(receive_buffer_B));
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(port);
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    if (::connect(socket_, reinterpret_cast<const sockaddr*>(&address), sizeof(address)) != 0)
      close();
  }
  RawWebClient(RawWebClient&& other) noexcept
      : port_(other.port_),
        socket_(std::exchange(other.socket_, -1)),
        received_(std::move(other.received_)) {}
  RawWebClient& operator=(RawWebClient&&) = delete;
  ~RawWebClient() { close(); }

  void close() {
    if (socket_ >= 0) ::close(socket_);
    socket_ = -1;
  }
  void send(std::string_view bytes) const {
    while (!bytes.empty()) {
      const ssize_t sent = ::send(socket_, bytes.data(), bytes.size(), MSG_NOSIGNAL);
      if (sent <= 0) return;
      bytes.remove_prefix(static_cast<std::size_t>(sent));
    }
  }
  /// @returns the status and headers of the response; empty if the connection was closed
  std::string request(std::string_view text) {
    send(text);
    while (received_.find("\r\n\r\n") == std::string::npos)
      if (!receive()) return {};
    const std::size_t end = received_.find("\r\n\r\n") + 4;
    std::string headers = received_.substr(0, end);
    received_.erase(0, end);
    return headers;
  }
  std::string get(const std::string& path, const std::string& host = "localhost") {
    return request("GET " + path + " HTTP/1.1\r\nHost: " + host + "\r\n\r\n");
  }
  /// @returns the status, 101 for an open WebSocket; 0 if the connection was closed
  int open(const Handshake& handshake) {
    const std::string host =
        handshake.host.empty() ? "127.0.0.1:" + std::to_string(port_) : handshake.host;
    std::string text =
        "GET " + handshake.path + " HTTP/1.1\r\nHost: " + host +
        "\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
        "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\nSec-WebSocket-Version: 13\r\n";
    if (!handshake.subprotocol.empty())
      text += "Sec-WebSocket-Protocol: " + handshake.subprotocol + "\r\n";
    if (!handshake.origin.empty()) text += "Origin: " + handshake.origin + "\r\n";
    response_ = request(text + handshake.more + "\r\n");
    return response_.size() < 12 ? 0 : std::stoi(response_.substr(9, 3));
  }
  /// Sends a frame, masked with zeros.
  void send_frame(int opcode, std::string_view payload, bool is_final = true) const {
    std::string frame;
    frame += static_cast<char>((is_final ? 0x80 : 0) | opcode);
    if (payload.size() < 126) {
      frame += static_cast<char>(0x80 | payload.size());
    } else {
      frame += static_cast<char>(0x80 | 127);
      for (int shift = 56; shift >= 0; shift -= 8)
        frame += static_cast<char>(payload.size() >> shift & 0xFF);
    }
    frame += std::string(4, '\0');
    send(frame + std::string(payload));
  }
  /// The next frame; none if the connection was closed, or nothing has come for ten seconds.
  std::optional<Frame> frame() {
    while (true) {
      if (const auto size = frame_size(); size && received_.size() >= *size) {
        const std::size_t payload = payload_size();
        Frame found{.opcode = received_[0] & 0x0F,
                    .payload = received_.substr(*size - payload, payload)};
        received_.erase(0, *size);
        return found;
      }
      if (!receive()) return std::nullopt;
    }
  }
  /// Reads until the server closes. @returns whether it did within this time
  bool is_closed_within(std::chrono::milliseconds time) {
    const auto end = std::chrono::steady_clock::now() + time;
    while (std::chrono::steady_clock::now() < end) {
      const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(
          end - std::chrono::steady_clock::now());
      if (!is_readable(static_cast<int>(left.count()))) continue;
      if (!receive()) return true;
    }
    return false;
  }
  /// Reads `size` bytes of what follows the headers.
  std::string content(std::size_t size) {
    while (received_.size() < size)
      if (!receive()) break;
    return std::exchange(received_, {});
  }
  [[nodiscard]] bool is_connected() const { return socket_ >= 0; }
  [[nodiscard]] const std::string& response() const { return response_; }

 private:
  [[nodiscard]] bool is_readable(int wait_ms) const {
    pollfd poll_for{.fd = socket_, .events = POLLIN, .revents = 0};
    return ::poll(&poll_for, 1, wait_ms) > 0;
  }
  bool receive() {
    if (socket_ < 0 || !is_readable(10'000)) return false;
    std::string buffer(65536, '\0');
    const ssize_t size = ::recv(socket_, buffer.data(), buffer.size(), 0);
    if (size <= 0) return false;
    received_.append(buffer, 0, static_cast<std::size_t>(size));
    return true;
  }
  [[nodiscard]] std::size_t byte(std::size_t index) const {
    return static_cast<unsigned char>(received_[index]);
  }
  [[nodiscard]] std::size_t payload_size() const {
    const std::size_t first = byte(1) & 0x7FU;
    if (first < 126) return first;
    std::size_t size = 0;
    for (std::size_t n = 0; n < (first == 126 ? 2U : 8U); ++n) size = size << 8U | byte(2 + n);
    return size;
  }
  [[nodiscard]] std::optional<std::size_t> frame_size() const {
    if (received_.size() < 2) return std::nullopt;
    const std::size_t first = byte(1) & 0x7FU;
    std::size_t header = 2;
    if (first == 126) header = 4;
    if (first == 127) header = 10;
    if (received_.size() < header) return std::nullopt;
    return header + payload_size();
  }

  std::uint16_t port_;
  int socket_;
  std::string received_ = {};
  std::string response_ = {};
};

}  // namespace torsio::test

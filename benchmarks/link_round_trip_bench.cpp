#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <memory>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include "free_port.hpp"
#include "rows.hpp"
#include "torsio/link.hpp"

namespace torsio::bench {
namespace {

constexpr int kRoundTrips = 20000;
constexpr std::uint8_t kEcho = 'E';  // no frame begins with it
constexpr std::int64_t kPatience_ns = 100'000'000;
constexpr std::string_view kRegisterText =
    "a text of 59 bytes, so that the reply has 64 bytes in all ..";

using Datagram = std::array<std::uint8_t, 2 * kNdlcomMaxEncodedBytes>;

/// A joint that does nothing but to be there.
class BenchJoint : public LinkJoint {
 public:
  Identity identity() const noexcept override { return {}; }
  bool is_initialised() const noexcept override { return true; }
  bool is_at_rest() const noexcept override { return true; }
  bool has_fault() const noexcept override { return false; }
  LinkRefusal enable() noexcept override { return LinkRefusal::none; }
  void disable() noexcept override {}
  void stop(StopCategory /*category*/) noexcept override {}
  LinkRefusal apply(const JointReference& /*reference*/) noexcept override {
    return LinkRefusal::none;
  }
  LinkRefusal change_mode(JointMode /*mode*/) noexcept override { return LinkRefusal::none; }
  std::span<const std::string_view> channels() const noexcept override { return {}; }
  void measure(std::span<float> /*values*/) const noexcept override {}
};

/// Replies to registers' reads by the endpoint, and to anything else with as many bytes as such a reply has.
void serve(LinkTransport& transport, std::size_t reply_bytes, const std::atomic<bool>& is_over) {
  BenchJoint joint;
  const std::array registers{
      LinkRegister{.name = "text", .type = LinkValueType::text, .get = [](const void*) noexcept {
                     return LinkValue::of(kRegisterText);
                   }}};
  const RegisterTable table(registers);
  JointEndpoint endpoint({.id = 1}, joint, table, transport);
  Datagram bytes{};
  const Datagram echo{kEcho};
  std::uint64_t now_ns = 1;
  while (!is_over) {
    if (!transport.wait(kPatience_ns)) continue;
    const std::size_t got = transport.receive(bytes);
    if (got == 0) continue;
    if (bytes[0] == kEcho)
      transport.send(std::span(echo).first(reply_bytes));
    else
      endpoint.receive(std::span(bytes).first(got), ++now_ns);
  }
}

/// @returns the time [s] until something came back
double round_trip(LinkTransport& transport, std::span<const std::uint8_t> request, Datagram& reply,
                  std::size_t& size) {
  const auto start = std::chrono::steady_clock::now();
  transport.send(request);
  size = 0;
  for (int n = 0; n < 20 && size == 0; ++n)
    if (transport.wait(kPatience_ns)) size = transport.receive(reply);
  if (size == 0) throw std::runtime_error("link_round_trip: there was no reply");
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

double median_us(std::vector<double>& seconds) {
  std::ranges::nth_element(seconds,
                           seconds.begin() + static_cast<std::ptrdiff_t>(seconds.size() / 2));
  return 1e6 * seconds[seconds.size() / 2];
}

}  // namespace

/// A register's read over UDP between two threads, encoding and decoding at both ends included; the floor is the same
/// exchange of bytes without them, in turn with it. Medians.
Row link_round_trip() {
  const UdpAddress host_address{.port = free_port()};
  const UdpAddress joint_address{.port = free_port()};
  const auto host_side = open_udp({.listen = host_address, .peers = {joint_address}});
  const auto joint_side = open_udp({.listen = joint_address, .peers = {host_address}});
  constexpr std::size_t kReplyBytes = 72;
  std::atomic<bool> is_over = false;
  std::jthread joint([&] { serve(*joint_side, kReplyBytes, is_over); });
  const struct End {
    std::atomic<bool>& is_over;
    ~End() { is_over = true; }
  } end{is_over};

  HostEndpoint host({.id = 200, .joint = 1});
  Datagram request{};
  Datagram reply{};
  Datagram echo{kEcho};
  std::vector<double> link_s;
  std::vector<double> bare_s;
  std::size_t values = 0;
  for (int n = 0; n < kRoundTrips; ++n) {
    std::size_t size = 0;
    const auto start = std::chrono::steady_clock::now();
    const std::size_t bytes = host.build(LinkRegisterRead{.index = 0}, request);
    const std::chrono::duration<double> built = std::chrono::steady_clock::now() - start;
    const double sent_s = round_trip(*host_side, std::span(request).first(bytes), reply, size);
    const auto arrived = std::chrono::steady_clock::now();
    host.receive(std::span(reply).first(size), [&]<class Message>(const Message& message) {
      if constexpr (std::is_same_v<Message, LinkRegisterValue>)
        values += message.value.text == kRegisterText ? 1 : 0;
    });
    const std::chrono::duration<double> decoded = std::chrono::steady_clock::now() - arrived;
    link_s.push_back(built.count() + sent_s + decoded.count());
    bare_s.push_back(round_trip(*host_side, std::span(echo).first(bytes), reply, size));
  }
  if (values != kRoundTrips) throw std::runtime_error("link_round_trip: replies are missing");
  return {.value = median_us(link_s), .unit = "us", .floor = median_us(bare_s)};
}

}  // namespace torsio::bench

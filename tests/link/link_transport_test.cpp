#include "torsio/link/link_transport.hpp"

#include <arpa/inet.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <filesystem>
#include <limits>
#include <string>

#include "link/recording_joint.hpp"
#include "support/error_message.hpp"
#include "support/temporary_folder.hpp"

namespace torsio {
namespace {

using test::LinkBytes;
using testing::AllOf;
using testing::HasSubstr;

constexpr std::int64_t kPatience_ns = 2'000'000'000;

/// A socket that is not the library's.
class PlainSocket {
 public:
  explicit PlainSocket(const char* address = "127.0.0.1")
      : number_(::socket(AF_INET, SOCK_DGRAM, 0)) {
    sockaddr_in own{};
    own.sin_family = AF_INET;
    ::inet_pton(AF_INET, address, &own.sin_addr);
    EXPECT_EQ(::bind(number_, reinterpret_cast<const sockaddr*>(&own), sizeof(own)), 0);
    socklen_t size = sizeof(own);
    ::getsockname(number_, reinterpret_cast<sockaddr*>(&own), &size);
    port = ntohs(own.sin_port);
    const timeval patience{.tv_sec = 2, .tv_usec = 0};
    ::setsockopt(number_, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof(patience));
  }
  ~PlainSocket() { ::close(number_); }
  PlainSocket(const PlainSocket&) = delete;
  PlainSocket& operator=(const PlainSocket&) = delete;

  void send(const LinkBytes& bytes, std::uint16_t to) const {
    sockaddr_in other{};
    other.sin_family = AF_INET;
    other.sin_port = htons(to);
    ::inet_pton(AF_INET, "127.0.0.1", &other.sin_addr);
    EXPECT_EQ(::sendto(number_, bytes.data(), bytes.size(), 0,
                       reinterpret_cast<const sockaddr*>(&other), sizeof(other)),
              static_cast<ssize_t>(bytes.size()));
  }
  LinkBytes receive(int flags = 0) const {
    LinkBytes bytes(2048);
    const ssize_t got = ::recv(number_, bytes.data(), bytes.size(), flags);
    bytes.resize(got > 0 ? static_cast<std::size_t>(got) : 0);
    return bytes;
  }

  std::uint16_t port = 0;

 private:
  int number_;
};

std::uint16_t port_of(const LinkTransport& transport) {
  const std::string place = transport.place();
  return static_cast<std::uint16_t>(std::stoi(place.substr(place.find(':') + 1)));
}

LinkBytes received_by(LinkTransport& transport, std::int64_t patience_ns = kPatience_ns) {
  LinkBytes bytes(2048);
  std::size_t got = transport.receive(bytes);
  if (got == 0 && transport.wait(patience_ns)) got = transport.receive(bytes);
  bytes.resize(got);
  return bytes;
}

/// All that arrives until `size` bytes have.
LinkBytes received_by(LinkTransport& transport, std::size_t size) {
  LinkBytes all;
  while (all.size() < size) {
    const LinkBytes more = received_by(transport);
    if (more.empty()) break;
    all.insert(all.end(), more.begin(), more.end());
  }
  return all;
}

TEST(UdpTransport, RepliesToTheListedPortAndNotToThatOfTheSender) {
  const PlainSocket host;
  const PlainSocket other_port;
  const auto joint = open_udp({.listen = {.port = 0}, .peers = {{.port = host.port}}});
  other_port.send({1, 2, 3}, port_of(*joint));
  EXPECT_EQ(received_by(*joint), (LinkBytes{1, 2, 3}));
  EXPECT_TRUE(joint->send(LinkBytes{4, 5}));
  EXPECT_EQ(host.receive(), (LinkBytes{4, 5}));
  EXPECT_TRUE(other_port.receive(MSG_DONTWAIT).empty());
  EXPECT_EQ(joint->line_B_s(), std::numeric_limits<double>::infinity());
}

TEST(UdpTransport, DiscardsWhatComesFromAnAddressThatIsNotListed) {
  const PlainSocket host;
  const PlainSocket stranger("127.0.0.2");
  const auto joint = open_udp({.listen = {.port = 0}, .peers = {{.port = host.port}}});
  stranger.send({9}, port_of(*joint));
  host.send({1}, port_of(*joint));
  EXPECT_EQ(received_by(*joint), LinkBytes{1});
  EXPECT_EQ(joint->counts().foreign, 1U);
}

TEST(UdpTransport, RefusesAPortInUseAndWrongAddressesWithAdvice) {
  const auto first = open_udp({.listen = {.port = 0}, .peers = {{.port = 9}}});
  const std::uint16_t port = port_of(*first);
  const auto message = [](const UdpSettings& settings) {
    return test::error_message([&] { static_cast<void>(open_udp(settings)); });
  };
  EXPECT_THAT(message({.listen = {.port = port}, .peers = {{.port = 9}}}),
              AllOf(HasSubstr("UDP 127.0.0.1:" + std::to_string(port) + ": cannot listen"),
                    HasSubstr("Another process listens on this port")));
  EXPECT_THAT(message({.listen = {.address = "localhost"}}),
              HasSubstr("expected an IPv4 address in numbers, found 'localhost'"));
  EXPECT_THAT(message({.listen = {.address = "192.0.2.1", .port = 0}, .peers = {{.port = 9}}}),
              HasSubstr("No interface of this machine has that address"));
  EXPECT_THAT(message({.peers = {}}), HasSubstr("at least one peer, found none"));
  EXPECT_THAT(message({.listen = {.port = 0}, .peers = {{.port = 0}}}),
              HasSubstr("a port of 1 to 65535"));
  EXPECT_THAT(message({.listen = {.port = 5000}, .peers = {{.port = 5000}}}),
              HasSubstr("5000 for both"));
}

TEST(UdpTransport, CarriesAJointAndItsHost) {
  const PlainSocket host_socket;
  const auto transport = open_udp({.listen = {.port = 0}, .peers = {{.port = host_socket.port}}});
  test::RecordingJoint joint;
  const RegisterTable table({});
  JointEndpoint endpoint({.id = 1}, joint, table, *transport);
  HostEndpoint host({.id = 200});
  LinkBytes frame(kNdlcomMaxEncodedBytes);
  frame.resize(host.build(LinkPing{.token = 5}, frame));
  host_socket.send(frame, port_of(*transport));
  endpoint.receive(received_by(*transport), 123456);
  host.receive(host_socket.receive(), [](const auto&) {});
  EXPECT_EQ(host.clock_ns(), 123456U);
}

TEST(UnixTransport, CarriesFramesInBothDirections) {
  const TemporaryFolder folder;
  const auto joint = open_unix({.path = folder.path("joint"), .peer = folder.path("host")});
  EXPECT_FALSE(joint->send(LinkBytes{1})) << "the host is not there yet";
  const auto host = open_unix({.path = folder.path("host"), .peer = folder.path("joint")});
  EXPECT_TRUE(joint->send(LinkBytes{1, 2}));
  EXPECT_EQ(received_by(*host), (LinkBytes{1, 2}));
  EXPECT_TRUE(host->send(LinkBytes{3}));
  EXPECT_EQ(received_by(*joint), LinkBytes{3});
  EXPECT_EQ(joint->counts().not_sent, 1U);
  const auto mode = std::filesystem::status(folder.path("joint")).permissions();
  EXPECT_EQ(mode & std::filesystem::perms::others_all, std::filesystem::perms::none);
  EXPECT_EQ(mode & std::filesystem::perms::group_all, std::filesystem::perms::none);
}

TEST(UnixTransport, DoesNotWaitForAHostThatStopsReading) {
  const TemporaryFolder folder;
  const auto joint = open_unix({.path = folder.path("joint"), .peer = folder.path("host")});
  const auto host = open_unix({.path = folder.path("host"), .peer = folder.path("joint")});
  bool is_full = false;
  for (int n = 0; n < 10000 && !is_full; ++n) is_full = !joint->send(LinkBytes(500));
  EXPECT_TRUE(is_full);
}

TEST(UnixTransport, RefusesAPathInUseAndStartsAgainAfterAKill) {
  const TemporaryFolder folder;
  const UnixSettings settings{.path = folder.path("joint"), .peer = folder.path("host")};
  int ready[2];
  ASSERT_EQ(::pipe(ready), 0);
  const pid_t child = ::fork();
  if (child == 0) {
    const auto transport = open_unix(settings);
    static_cast<void>(::write(ready[1], "x", 1) == 1);
    for (;;) ::pause();
  }
  char byte = 0;
  ASSERT_EQ(::read(ready[0], &byte, 1), 1);
  EXPECT_THAT(test::error_message([&] { static_cast<void>(open_unix(settings)); }),
              HasSubstr("another process uses it"));
  ::kill(child, SIGKILL);
  ::waitpid(child, nullptr, 0);
  EXPECT_TRUE(std::filesystem::exists(settings.path));
  EXPECT_EQ(test::error_message([&] { static_cast<void>(open_unix(settings)); }), "");
  ::close(ready[0]);
  ::close(ready[1]);
}

TEST(UnixTransport, RefusesPathsThatItCannotUse) {
  const TemporaryFolder folder;
  const std::string mine = folder.file("mine", "data");
  const auto message = [&](const std::string& path) {
    return test::error_message(
        [&] { static_cast<void>(open_unix({.path = path, .peer = folder.path("host")})); });
  };
  EXPECT_THAT(message(mine), HasSubstr("it is neither a socket nor a link"));
  EXPECT_TRUE(std::filesystem::exists(mine));
  EXPECT_THAT(message(std::string(200, 'x')), HasSubstr("a path of 1 to 107 bytes"));
  EXPECT_THAT(message(folder.path("none/joint")), HasSubstr("its lock cannot be made"));
}

TEST(PseudoTerminal, IsASerialLineForAnotherProgram) {
  const TemporaryFolder folder;
  const auto joint = open_pseudo_terminal({.link = folder.path("tty"), .baud = 8e6});
  EXPECT_TRUE(std::filesystem::is_symlink(folder.path("tty")));
  EXPECT_EQ(joint->line_B_s(), 8e5);
  const auto host = open_serial({.device = folder.path("tty"), .baud = 921600.0});
  LinkBytes all(256);
  for (std::size_t k = 0; k < all.size(); ++k)
    all[k] = static_cast<std::uint8_t>(k);  // and no byte is changed
  EXPECT_TRUE(host->send(all));
  EXPECT_EQ(received_by(*joint, all.size()), all);
  EXPECT_TRUE(joint->send(all));
  EXPECT_EQ(received_by(*host, all.size()), all);
  EXPECT_THAT(test::error_message(
                  [&] { static_cast<void>(open_pseudo_terminal({.link = folder.path("tty")})); }),
              HasSubstr("another process uses it"));
}

TEST(PseudoTerminal, SendsNoFasterThanItsRateAndCompletesFrames) {
  const auto joint = open_pseudo_terminal({.baud = 115200.0});
  const auto host = open_serial({.device = joint->place(), .baud = 115200.0});
  std::size_t taken = 0;
  const auto start = std::chrono::steady_clock::now();
  for (int n = 0; n < 100; ++n)
    if (joint->send(LinkBytes(100, static_cast<std::uint8_t>(n)))) taken += 100;
  const std::chrono::duration<double> span = std::chrono::steady_clock::now() - start;
  EXPECT_GE(taken, 4000U);
  EXPECT_LE(static_cast<double>(taken), 4096.0 + 11520.0 * span.count() + 1.0);
  EXPECT_EQ(joint->counts().not_sent, 100U - taken / 100U);
  const LinkBytes all = received_by(*host, taken);
  EXPECT_EQ(all.size(), taken);
}

TEST(SerialLine, NeverSendsPartOfAFrameOnly) {
  const auto joint = open_pseudo_terminal({.baud = 8e6});
  const auto host = open_serial({.device = joint->place(), .baud = 8e6});
  LinkBytes expected;
  LinkBytes arrived;
  LinkBytes part(100);
  for (int round = 0; round < 50; ++round) {
    for (int n = 0; n < 200; ++n) {
      const LinkBytes frame(301, static_cast<std::uint8_t>(7 * round + n));
      if (host->send(frame)) expected.insert(expected.end(), frame.begin(), frame.end());
    }
    while (const std::size_t got = joint->receive(part))
      arrived.insert(arrived.end(), part.begin(), part.begin() + static_cast<std::ptrdiff_t>(got));
  }
  EXPECT_GT(host->counts().not_sent, 0U) << "the line was never full";
  while (arrived.size() < expected.size()) {
    static_cast<void>(host->receive(part));  // sends the rest of the last frame
    const LinkBytes more = received_by(*joint);
    if (more.empty()) break;
    arrived.insert(arrived.end(), more.begin(), more.end());
  }
  EXPECT_EQ(arrived, expected);
}

TEST(SerialLine, RefusesWhatIsNotOneOrHasNotTheRate) {
  const auto message = [](const SerialSettings& settings) {
    return test::error_message([&] { static_cast<void>(open_serial(settings)); });
  };
  EXPECT_THAT(message({.device = "/dev/null"}), HasSubstr("it is not a serial line"));
  EXPECT_THAT(message({.device = "/dev/ttyNONE7"}), HasSubstr("Is the adapter connected?"));
  for (const double baud : {9600.0, 9e6, 115200.5, std::numeric_limits<double>::quiet_NaN()})
    EXPECT_THAT(message({.device = "/dev/null", .baud = baud}),
                HasSubstr("a whole rate of 115200 to 8000000 baud"));
}

}  // namespace
}  // namespace torsio

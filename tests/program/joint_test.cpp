// `torsio joint` as a process: driven over a Unix socket and UDP, ended by signals, started again after SIGKILL.
#include <gmock/gmock.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <csignal>
#include <functional>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <thread>
#include <type_traits>

#include "program/program.hpp"
#include "torsio/link.hpp"

namespace torsio::test {
namespace {

using testing::HasSubstr;
using DaemonClock = std::chrono::steady_clock;
using std::chrono::milliseconds;

constexpr auto kLongest = std::chrono::seconds(30);  // with sanitizers on a busy machine
/// A busy machine delays this process, too; the watchdog of a robot is shorter.
constexpr const char* kPatient = " --watchdog 2s";

class JointDaemon : public Program {
 protected:
  void TearDown() override {
    if (child_ > 0) end(SIGKILL);
  }
  void start(const std::string& arguments) {
    const std::string line = "cd '" + folder_.path("") + "' && exec " + TORSIO_PROGRAM + " joint " +
                             arguments + kPatient + " >out.txt 2>err.txt </dev/null";
    child_ = ::fork();
    ASSERT_GE(child_, 0);
    if (child_ == 0) {
      ::execl("/bin/sh", "sh", "-c", line.c_str(), nullptr);
      ::_exit(127);
    }
    ASSERT_TRUE(waits_for([this] {
      return contents("out.txt").find(": ready") != std::string::npos;
    })) << contents("err.txt");
  }
  /// @returns the status of the process
  int end(int signal) {
    ::kill(child_, signal);
    int status = 0;
    ::waitpid(child_, &status, 0);
    child_ = 0;
    return status;
  }
  static bool waits_for(const std::function<bool()>& is_so) {
    const auto latest = DaemonClock::now() + kLongest;
    while (!is_so()) {
      if (DaemonClock::now() > latest) return false;
      std::this_thread::sleep_for(milliseconds(2));
    }
    return true;
  }

  /// Sends until the reply arrives. @returns it
  template <class Reply, class Message>
  std::optional<Reply> ask(LinkTransport& line, HostEndpoint& host, const Message& message) {
    std::optional<Reply> reply;
    std::array<std::uint8_t, kNdlcomMaxEncodedBytes> frame;
    std::array<std::uint8_t, 2048> bytes;
    static_cast<void>(waits_for([&] {
      line.send(std::span(frame).first(host.build(LinkPing{.token = ++token_}, frame)));
      std::this_thread::sleep_for(milliseconds(10));
      while (const std::size_t size = line.receive(bytes))
        host.receive(std::span(bytes).first(size), [](const auto&) {});
      line.send(std::span(frame).first(host.build(message, frame)));
      for (int n = 0; n < 50 && !reply; ++n) {
        std::this_thread::sleep_for(milliseconds(2));
        while (const std::size_t size = line.receive(bytes))
          host.receive(std::span(bytes).first(size), [&]<class Received>(const Received& received) {
            if constexpr (std::is_same_v<Received, Reply>) reply = received;
          });
      }
      return reply.has_value();
    }));
    return reply;
  }
  std::unique_ptr<LinkTransport> host_line() {
    return open_unix({.path = folder_.path("joint.host"), .peer = folder_.path("joint")});
  }

  ::pid_t child_ = 0;
  std::uint32_t token_ = 0;
};

TEST_F(JointDaemon, IsEnabledOverASocketAndStopsInOrderOnASignal) {
  start("dfki-28#03 --unix joint");
  auto line = host_line();
  HostEndpoint host({.id = 200});
  const auto done =
      ask<LinkDone>(*line, host, LinkStateChange{.command = LinkStateCommand::enable});
  ASSERT_TRUE(done);
  EXPECT_TRUE(waits_for(
      [this] { return contents("out.txt").find("joint 1: enabled") != std::string::npos; }));
  const int status = end(SIGTERM);
  EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 0);
  const std::string out = contents("out.txt");
  EXPECT_THAT(out, HasSubstr("joint 1: dfki-28#03"));
  EXPECT_THAT(out, HasSubstr("host 200 in control"));
  EXPECT_THAT(out, HasSubstr("joint 1: stop: requested"));
  EXPECT_THAT(out, HasSubstr("CPU time of a cycle"));
}

TEST_F(JointDaemon, IsStartedAgainAfterItWasKilled) {
  for (int n = 0; n < 2; ++n) {
    start("dfki-28 --unix joint");
    auto line = host_line();
    HostEndpoint host({.id = 200});
    ASSERT_TRUE(ask<LinkPong>(*line, host, LinkPing{.token = 9}));
    const int status = end(SIGKILL);
    EXPECT_TRUE(WIFSIGNALED(status));
  }
}

TEST_F(JointDaemon, StatesThatItsPortIsInUse) {
  const auto other = open_udp({.listen = {.port = 0}, .peers = {{.port = 9}}});
  const std::string place = other->place();
  const Outcome outcome = torsio("joint --port " + place.substr(place.find(':') + 1));
  EXPECT_EQ(outcome.exit_code, kWorkFailed);
  EXPECT_THAT(outcome.err, HasSubstr("Another process listens on this port"));
}

TEST_F(JointDaemon, RefusesToListenToEveryone) {
  const Outcome outcome = torsio("joint --listen 0.0.0.0");
  EXPECT_EQ(outcome.exit_code, kCallWasWrong);
  EXPECT_THAT(outcome.err, HasSubstr("--allow ADDRESS"));
  EXPECT_THAT(outcome.err, HasSubstr("no authentication"));
}

TEST_F(JointDaemon, RefusesWrongCalls) {
  for (const char* arguments : {"dfki-29",
                                "0=dfki-28",
                                "255=dfki-28",
                                "dfki-28,file=m",
                                "1=dfki-28 1=dfki-50",
                                "dfki-28 --arm arm6",
                                "--arm arm6 --link-mass 1kg",
                                "dfki-28 --link-mass 50kg",
                                "--unix a --serial-line b",
                                "--baud 9600",
                                "--fast --realtime",
                                "--duration 0s",
                                "--watchdog 1us",
                                "--fault 2:gear_angle=freeze@3s",
                                "--fault gear_angle=freeze@3s",
                                "--allow 10.0.0.300 --listen 127.0.0.1",
                                "--can virtual:can0",
                                "--can socketcan",
                                "--can socketcan:nocan7",
                                "--can udp_multicast:127.0.0.1",
                                "--can udp_multicast::0",
                                "--can-rate 10Hz",
                                "63=dfki-28 --can udp_multicast"})
    EXPECT_THAT(shell(std::string("timeout 20 {torsio} joint ") + arguments).exit_code,
                testing::AnyOf(kWorkFailed, kCallWasWrong))
        << arguments;
}

TEST_F(JointDaemon, RunsOnASimulatedClockAndWritesItsSummary) {
  const Outcome outcome =
      torsio("joint 1=dfki-28 7=dfki-50 --unix joint --fast --duration 2s --json -");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const auto document = nlohmann::json::parse(outcome.out);
  EXPECT_EQ(document.at("schema_version"), 1);
  EXPECT_EQ(document.at("joints").size(), 2U);
  EXPECT_EQ(document.at("joints")[1].at("id"), 7);
  EXPECT_GE(document.at("cycles"), 2000);
  EXPECT_EQ(document.at("late_cycles"), 0);
}

TEST_F(JointDaemon, DrivesAnArmOverUdp) {
  std::array<std::string, 2> ports;
  for (std::string& port : ports) {
    const std::string place = open_udp({.listen = {.port = 0}, .peers = {{.port = 9}}})->place();
    port = place.substr(place.find(':') + 1);
  }
  start("--arm arm6 --port " + ports[0] + " --host-port " + ports[1]);
  const auto line =
      open_udp({.listen = {.port = static_cast<std::uint16_t>(std::stoi(ports[1]))},
                .peers = {{.port = static_cast<std::uint16_t>(std::stoi(ports[0]))}}});
  HostEndpoint host({.id = 200, .joint = 6});
  const auto information = ask<LinkInformation>(*line, host, LinkInformationRequest{});
  ASSERT_TRUE(information);
  EXPECT_EQ(information->watchdog_ms, 2000);
  EXPECT_GT(information->registers, 20);
}

}  // namespace
}  // namespace torsio::test

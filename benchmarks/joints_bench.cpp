#include <algorithm>
#include <array>
#include <cstdint>
#include <deque>
#include <memory>
#include <stdexcept>
#include <utility>
#include <vector>

#include "free_port.hpp"
#include "rows.hpp"
#include "torsio/link.hpp"
#include "torsio/realtime/realtime_loop.hpp"
#include "torsio/sim/joints/joint_server.hpp"
#include "torsio/sim/joints/single_joint.hpp"

namespace torsio::bench {
namespace {

constexpr std::uint8_t kJoints = 12;
constexpr std::uint8_t kHost = 254;
constexpr int kCycles = 10000;
constexpr double kPeriod_s = 3e-4;  // shorter than a tick, which changes nothing for the joints
constexpr std::uint64_t kTick_ns = 1'000'000;
constexpr std::array kActuators = {"dfki-300", "dfki-300", "dfki-120",
                                   "dfki-50",  "dfki-28",  "dfki-28"};

/// Twelve joints on UDP and a host that drives and observes them all at 1 kHz.
class DrivenJoints {
 public:
  DrivenJoints() {
    for (std::uint8_t n = 0; n < kJoints; ++n)
      hosts_.emplace_back(
          HostEndpoint::Settings{.id = kHost, .joint = static_cast<std::uint8_t>(n + 1)});
    run(100);
    for (HostEndpoint& host : hosts_)
      send(host, LinkSubscribe{.mask = 0x3FF, .rate_Hz = 1000.0F, .lifetime_s = 60.0F});
    run(100);
    for (HostEndpoint& host : hosts_)
      send(host, LinkStateChange{.command = LinkStateCommand::enable});
    for (int n = 0; n < 1000; ++n) {
      for (HostEndpoint& host : hosts_)
        send(host, LinkStateChange{.command = LinkStateCommand::heartbeat});
      run(1);
    }
  }

  DurationHistogram drive() {
    cpu_time_ = {};
    // With the priority of the program's own loop, if that is permitted.
    RealtimeLoop loop({.period_s = kPeriod_s});
    int cycles = 0;
    static_cast<void>(loop.run([&](const Tick&) noexcept {
      for (HostEndpoint& host : hosts_)
        send(host, LinkReference{.deadline_ns = host.clock_ns() + 40 * kTick_ns,
                                 .mode = JointMode::impedance,
                                 .position_rad = 0.2F,
                                 .stiffness_Nm_rad = 50.0F,
                                 .damping_Nms_rad = 5.0F});
      run(1);
      return ++cycles < kCycles;
    }));
    for (const auto& joint : server_.joints())
      if (joint.state != LinkDriveState::enabled) throw std::runtime_error("a joint has stopped");
    return cpu_time_;
  }

 private:
  static std::vector<ServedArm> arms() {
    std::vector<ServedArm> all;
    for (std::uint8_t n = 0; n < kJoints; ++n)
      all.push_back({.setup = single_joint_setup(data_sheet(kActuators[n % kActuators.size()])),
                     .first_id = static_cast<std::uint8_t>(n + 1)});
    return all;
  }

  template <class Message>
  void send(HostEndpoint& host, const Message& message) {
    if (bundled_ + kNdlcomMaxEncodedBytes > bundle_.size()) flush();
    bundled_ += host.build(message, std::span(bundle_).subspan(bundled_));
  }
  /// A datagram may carry several frames.
  void flush() { host_line_->send(std::span(bundle_).first(std::exchange(bundled_, 0))); }
  void run(int cycles) {
    std::array<std::uint8_t, 2048> bytes;
    for (; cycles > 0; --cycles) {
      if (bundled_ > 0) flush();
      const std::int64_t start_ns = clock_.cpu_ns();
      server_.cycle(now_ns_ += kTick_ns);
      cpu_time_.add(clock_.cpu_ns() - start_ns);
      while (const std::size_t size = host_line_->receive(bytes))
        for (HostEndpoint& host : hosts_)
          host.receive(std::span(bytes).first(size), [](const auto&) {});
    }
  }

  std::uint16_t joint_port_ = free_port();
  std::uint16_t host_port_ = free_port();
  std::unique_ptr<LinkTransport> joint_line_ =
      open_udp({.listen = {.port = joint_port_}, .peers = {{.port = host_port_}}});
  std::unique_ptr<LinkTransport> host_line_ =
      open_udp({.listen = {.port = host_port_}, .peers = {{.port = joint_port_}}});
  JointServer server_{arms(), {}, *joint_line_};
  std::deque<HostEndpoint> hosts_;
  std::array<std::uint8_t, 1400> bundle_ = {};
  std::size_t bundled_ = 0;
  MonotonicClock clock_;
  DurationHistogram cpu_time_;
  std::uint64_t now_ns_ = std::uint64_t{1} << 41U;
};

double quantile_us(const DurationHistogram& times, double part) {
  return 1e-3 * static_cast<double>(times.quantile_ns(part));
}

/// The same quantile of a loop that only calculates, as long as the median cycle: what this machine adds to it.
double bare_quantile_us(double work_us, double part) {
  constexpr int kSteps = 1000;
  MonotonicClock clock;
  double value = 1.0;
  const auto calculate = [&value](int steps) {
    for (int n = 0; n < steps; ++n) value = value * 1.000'000'1 + 1e-9;
    // The compiler must not leave the work out.
    if (value < 0.0) throw std::runtime_error("joints_cycle: impossible");
  };
  const double steps_us = 1e6 * best_seconds([&] { calculate(kSteps); }, 0.05);
  const int steps = static_cast<int>(kSteps * work_us / steps_us);
  DurationHistogram times;
  RealtimeLoop loop({.period_s = kPeriod_s});
  int cycles = 0;
  static_cast<void>(loop.run([&](const Tick&) noexcept {
    const std::int64_t start_ns = clock.cpu_ns();
    calculate(steps);
    times.add(clock.cpu_ns() - start_ns);
    return ++cycles < kCycles;
  }));
  return quantile_us(times, part);
}

Row cycle_row(double part) {
  const DurationHistogram cpu_time = DrivenJoints().drive();
  return {.value = quantile_us(cpu_time, part),
          .unit = "us",
          .floor = bare_quantile_us(quantile_us(cpu_time, 0.5), part)};
}

}  // namespace

/// CPU time of a cycle of twelve simulated joints in one server, each with a reference and telemetry of ten channels
/// over UDP: the median. The floor is a loop that only calculates for that time: what this machine adds to a quantile.
Row joints_cycle() { return cycle_row(0.5); }
/// The same: exceeded by one cycle of a thousand.
Row joints_cycle_p999() { return cycle_row(0.999); }

}  // namespace torsio::bench

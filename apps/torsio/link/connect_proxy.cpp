// `torsio connect proxy`: a hostile line between hosts and joints.
#include <fmt/format.h>

#include <CLI/App.hpp>
#include <CLI/Validators.hpp>
#include <array>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>

#include "common/data_flags.hpp"
#include "common/interrupt.hpp"
#include "core/quantity.hpp"
#include "link/connect_flags.hpp"
#include "report/json_text.hpp"
#include "torsio/core/units.hpp"
#include "torsio/link/hostile_wire.hpp"
#include "torsio/realtime/realtime_loop.hpp"

namespace {

using Json = nlohmann::ordered_json;
using torsio::HostileWire;

constexpr std::int64_t kForwardPeriod_ns = 200'000;

struct ProxyFlags : ConnectFlags {
  std::uint16_t listen_port = 34101;
  std::uint16_t reply_port = 34100;
  std::string listen_path;
  std::string usual_delay = "3ms";
  std::string longest_delay = "200ms";
  std::string duration;
  std::uint64_t seed = kDefaultSeed;
  HostileWire::Settings wire = {};
};

std::unique_ptr<torsio::LinkTransport> open_to_hosts(const ProxyFlags& flags) {
  if (!flags.listen_path.empty())
    return torsio::open_unix({.path = flags.listen_path, .peer = flags.listen_path + ".host"});
  return torsio::open_udp(
      {.listen = {.port = flags.listen_port}, .peers = {{.port = flags.reply_port}}});
}

/// Forwards in one direction what has arrived, and what is due.
void forward(torsio::LinkTransport& from, HostileWire& wire, torsio::LinkTransport& to,
             std::uint64_t now_ns) {
  std::array<std::uint8_t, 2048> buffer;
  for (std::size_t size = 0; (size = from.receive(buffer)) > 0;)
    wire.send(std::span(buffer).first(size), now_ns);
  wire.take(now_ns, [&](std::span<const std::uint8_t> bytes) {
    // A datagram that is longer than the buffer of the receiver would lose its end.
    for (; !bytes.empty(); bytes = bytes.subspan(std::min(bytes.size(), buffer.size())))
      to.send(bytes.first(std::min(bytes.size(), buffer.size())));
  });
}

Json json_of(const HostileWire::Counts& counts) {
  return {{"received", counts.sent},
          {"dropped", counts.dropped},
          {"doubled", counts.doubled},
          {"damaged", counts.damaged}};
}

std::string counts_text(const char* direction, const HostileWire::Counts& counts) {
  return fmt::format("{}: {} frames, {} dropped, {} doubled, {} damaged\n", direction, counts.sent,
                     counts.dropped, counts.doubled, counts.damaged);
}

void run(ProxyFlags& flags) {
  flags.wire.usual_delay_s = torsio::signed_quantity_with_unit(flags.usual_delay, "s", "--delay");
  flags.wire.longest_delay_s =
      torsio::signed_quantity_with_unit(flags.longest_delay, "s", "--longest-delay");
  HostileWire to_joints(flags.wire, flags.seed);
  HostileWire to_hosts(flags.wire, flags.seed + 1);
  const auto joints = torsio::open_joint_line(flags.line);
  const auto hosts = open_to_hosts(flags);
  torsio::MonotonicClock clock;
  const double duration_s =
      flags.duration.empty()
          ? std::numeric_limits<double>::infinity()
          : above_zero(torsio::signed_quantity_with_unit(flags.duration, "s", "--for"), "--for");
  remark(fmt::format("from {} to {}, until it is interrupted", hosts->place(), name(flags.line)));
  const std::int64_t start_ns = clock.now_ns();
  while (!is_interrupted() && 1e-9 * static_cast<double>(clock.now_ns() - start_ns) < duration_s) {
    static_cast<void>(hosts->wait(kForwardPeriod_ns));
    const auto now_ns = static_cast<std::uint64_t>(clock.now_ns());
    forward(*hosts, to_joints, *joints, now_ns);
    forward(*joints, to_hosts, *hosts, now_ns);
  }
  lift_interrupt_deadline();
  if (flags.json.wants_tables())
    print(counts_text("to the joints", to_joints.counts()) +
          counts_text("to the hosts", to_hosts.counts()));
  flags.json.write(torsio::json_text(
      Json{{"to_joints", json_of(to_joints.counts())}, {"to_hosts", json_of(to_hosts.counts())}}));
}

void add_share(CLI::App& verb, const char* option, double& share, const char* help) {
  verb.add_option(option, share, help)->check(CLI::Range(0.0, 1.0))->capture_default_str();
}

}  // namespace

void add_connect_proxy(CLI::App& connect) {
  auto flags = std::make_shared<ProxyFlags>();
  CLI::App* verb = connect.add_subcommand(
      "proxy", "delay, reorder, drop and damage the frames between hosts and joints: for tests");
  verb->footer(
      "Example: torsio connect proxy --listen-port 34101 --reply-port 34100 &\n"
      "         torsio connect describe --port 34101 --host-port 34100");
  flags->add_line(*verb);
  verb->add_option("--listen-port", flags->listen_port, "UDP port to which hosts send")
      ->check(CLI::Range(1, 65535))
      ->capture_default_str();
  verb->add_option("--reply-port", flags->reply_port, "UDP port on which the host listens")
      ->check(CLI::Range(1, 65535))
      ->capture_default_str();
  verb->add_option("--listen-unix", flags->listen_path,
                   "socket of the file system for hosts instead");
  add_share(*verb, "--dropped", flags->wire.dropped, "share of frames that is lost");
  add_share(*verb, "--doubled", flags->wire.doubled, "share that arrives twice");
  add_share(*verb, "--damaged", flags->wire.damaged, "share with a wrong bit");
  add_share(*verb, "--slow", flags->wire.slow, "share with a long delay, which others overtake");
  verb->add_option("--delay", flags->usual_delay, "usual delay, at most")->capture_default_str();
  verb->add_option("--longest-delay", flags->longest_delay, "delay of slow frames, at most")
      ->capture_default_str();
  verb->add_option("--for", flags->duration, "ends after this time");
  add_seed(*verb, flags->seed, "seed of what the line does");
  verb->callback([flags] { run(*flags); });
}

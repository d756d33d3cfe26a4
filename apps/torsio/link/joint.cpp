#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include "common/data_flags.hpp"
#include "common/interrupt.hpp"
#include "common/output.hpp"
#include "common/progress_bar.hpp"
#include "core/quantity.hpp"
#include "link/joint_flags.hpp"
#include "report/json_text.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/units.hpp"
#include "torsio/realtime/realtime_loop.hpp"
#include "torsio/report/text_table.hpp"
#include "torsio/sim/joints/joint_server.hpp"
#include "verbs.hpp"

namespace {

using JointJson = nlohmann::ordered_json;

constexpr std::int64_t kCycle_ns = 1'000'000;
/// A stop of all joints at the end takes no longer: then they are without power.
constexpr std::int64_t kLongestStopCycles = 2000;
constexpr std::int64_t kCyclesBetweenEvents = 500;
constexpr auto kEventsEvery = std::chrono::milliseconds(50);

struct JointFlags {
  ServedJointFlags served;
  JointLineFlags line;
  std::string watchdog = "50ms";
  std::string can_rate = "100Hz";
  std::string duration;
  std::uint64_t seed = kDefaultSeed;
  bool is_lenient = false;
  bool is_realtime = false;
  bool is_fast = false;
  bool has_gear_stage = false;
  bool has_bare_loop = false;
  JsonOutput json;
};

/// What the loop has done.
struct Cycles {
  std::uint64_t cycles = 0;
  std::uint64_t late = 0;     ///< ended after the next had begun
  std::uint64_t skipped = 0;  ///< periods without a cycle, because of them
  torsio::DurationHistogram cpu_time = {};
  std::optional<std::uint64_t> bare_late = {};  ///< late cycles of a loop without work
};

/// The cycle with its end: after the duration or a request all joints stop, and the last cycle is that in which they rest.
class JointLoop {
 public:
  JointLoop(torsio::JointServer& server, std::int64_t duration_cycles)
      : server_(server), duration_cycles_(duration_cycles) {}

  /// @returns whether it continues
  bool step(std::uint64_t now_ns) noexcept {
    server_.cycle(now_ns);
    ++cycle_;
    if (!stopped_at_ && (cycle_ == duration_cycles_ || is_end_requested_.load())) {
      server_.stop_all(torsio::StopCategory::ramp_and_brake);
      stopped_at_ = cycle_;
    }
    if (!stopped_at_ || cycle_ == *stopped_at_) return true;
    return !server_.is_off() && cycle_ < *stopped_at_ + kLongestStopCycles;
  }
  void request_end() noexcept { is_end_requested_.store(true); }

 private:
  torsio::JointServer& server_;
  std::int64_t duration_cycles_;  ///< 0: until a request
  std::int64_t cycle_ = 0;
  std::optional<std::int64_t> stopped_at_ = {};
  std::atomic<bool> is_end_requested_ = false;
};

void report_lines(const JointFlags& flags, const std::vector<std::string>& lines) {
  for (const std::string& line : lines) {
    if (flags.json.wants_tables())
      print(line + "\n");
    else
      remark(line);
  }
}

Cycles run_fast(const JointFlags& flags, torsio::JointServer& server, JointLoop& loop) {
  Cycles done;
  torsio::MonotonicClock clock;
  // Commands from before the start must not be young again.
  std::random_device chance;
  std::uint64_t now_ns = (std::uint64_t{1} << 40U) + (std::uint64_t{chance()} << 20U);
  for (bool continues = true; continues;) {
    for (std::int64_t n = 0; n < kCyclesBetweenEvents && continues; ++n) {
      const std::int64_t start_ns = clock.cpu_ns();
      continues = loop.step(now_ns += kCycle_ns);
      done.cpu_time.add(clock.cpu_ns() - start_ns);
      ++done.cycles;
    }
    report_lines(flags, server.take_events());
    if (!is_interrupted()) continue;
    lift_interrupt_deadline();
    loop.request_end();
  }
  return done;
}

Cycles run_realtime(const JointFlags& flags, torsio::JointServer& server, JointLoop& loop) {
  torsio::MonotonicClock clock;
  std::atomic<bool> has_ended = false;
  torsio::RealtimeLoop bare({.period_s = 1e-9 * kCycle_ns});
  torsio::RealtimeLoop realtime({.period_s = 1e-9 * kCycle_ns});  // last: it uses the others
  if (flags.has_bare_loop) bare.start([](const torsio::Tick&) noexcept { return true; });
  realtime.start([&](const torsio::Tick&) noexcept {
    const bool continues = loop.step(static_cast<std::uint64_t>(clock.now_ns()));
    if (!continues) has_ended.store(true);
    return continues;
  });
  while (!has_ended.load()) {
    std::this_thread::sleep_for(kEventsEvery);
    report_lines(flags, server.take_events());
    if (!is_interrupted()) continue;
    lift_interrupt_deadline();
    loop.request_end();
  }
  const torsio::LoopReport report = realtime.wait();
  Cycles done{.cycles = report.steps,
              .late = report.overruns,
              .skipped = report.skipped_periods,
              .cpu_time = report.cpu_time};
  if (flags.has_bare_loop) {
    bare.request_stop();
    done.bare_late = bare.wait().overruns;
  }
  if (!report.grants.refused.empty()) remark("remark: not granted: " + report.grants.refused);
  return done;
}

double us(std::int64_t duration_ns) { return 1e-3 * static_cast<double>(duration_ns); }

std::string summary(const Cycles& done, const torsio::JointServer& server) {
  torsio::TextTable table;
  table.header({"joint", "actuator", "state", "executed", "refused", "not sent"});
  for (const torsio::JointServer::JointStatus& joint : server.joints())
    table.row({fmt::format("{}", joint.id), joint.actuator, std::string(name(joint.state)),
               fmt::format("{}", joint.counts.executed),
               fmt::format("{}", joint.counts.all_refused()),
               fmt::format("{}", joint.counts.not_sent)});
  const torsio::JointServer::LineStatus line = server.line();
  std::string can;
  if (const auto bus = server.can())
    can = fmt::format(
        "{} CAN frames, {} for other nodes, {} extended, {} error frames, {} malformed, "
        "{} of other hosts, {} not sent\n",
        bus->frames.frames, bus->frames.to_no_node + bus->frames.broadcasts, bus->frames.extended,
        bus->frames.errors, bus->bus.malformed, bus->bus.foreign, bus->bus.not_sent);
  return table.text() +
         fmt::format(
             "{} cycles, {} late, {} skipped{}; CPU time of a cycle {:.1f} us (median), "
             "{:.1f} us (99.9 %), {:.1f} us (largest)\n"
             "{} frames, {} with a wrong CRC, {} malformed, {} for other ids, {} datagrams "
             "of other hosts\n",
             done.cycles, done.late, done.skipped,
             done.bare_late ? fmt::format(" (a loop without work: {} late)", *done.bare_late)
                            : std::string(),
             us(done.cpu_time.quantile_ns(0.5)), us(done.cpu_time.quantile_ns(0.999)),
             us(done.cpu_time.max_ns()), line.frames.frames, line.frames.crc_errors,
             line.frames.malformed, line.to_no_joint, line.transport.foreign) +
         can;
}

JointJson run_json(const JointFlags& flags, const Cycles& done, const torsio::JointServer& server) {
  const torsio::JointServer::LineStatus line = server.line();
  JointJson document{{"line", line.place},
                     {"fast", flags.is_fast},
                     {"seed", flags.seed},
                     {"gear_stage", flags.has_gear_stage},
                     {"cycles", done.cycles},
                     {"late_cycles", done.late},
                     {"skipped_cycles", done.skipped},
                     {"late_cycles_of_a_bare_loop",
                      done.bare_late ? JointJson(*done.bare_late) : JointJson(nullptr)},
                     {"cpu_time_us",
                      {{"median", us(done.cpu_time.quantile_ns(0.5))},
                       {"p99_9", us(done.cpu_time.quantile_ns(0.999))},
                       {"largest", us(done.cpu_time.max_ns())}}},
                     {"frames", line.frames.frames},
                     {"crc_errors", line.frames.crc_errors},
                     {"malformed", line.frames.malformed},
                     {"joints", JointJson::array()}};
  if (const auto bus = server.can())
    document["can"] = {{"place", bus->place},
                       {"frames", bus->frames.frames},
                       {"to_other_nodes", bus->frames.to_no_node + bus->frames.broadcasts},
                       {"extended", bus->frames.extended},
                       {"error_frames", bus->frames.errors},
                       {"malformed", bus->bus.malformed},
                       {"foreign", bus->bus.foreign},
                       {"not_sent", bus->bus.not_sent}};
  for (const torsio::JointServer::JointStatus& joint : server.joints()) {
    JointJson refused = JointJson::object();
    for (std::size_t k = 1; k < joint.counts.refused.size(); ++k)
      if (joint.counts.refused[k] > 0)
        refused[std::string(name(static_cast<torsio::LinkRefusal>(k)))] = joint.counts.refused[k];
    document["joints"].push_back({{"id", joint.id},
                                  {"name", joint.name},
                                  {"actuator", joint.actuator},
                                  {"model", joint.model},
                                  {"state", name(joint.state)},
                                  {"reason", name(joint.reason)},
                                  {"executed", joint.counts.executed},
                                  {"refused", refused},
                                  {"not_sent", joint.counts.not_sent}});
  }
  return document;
}

std::int64_t cycles_of(const std::string& duration) {
  if (duration.empty()) return 0;
  const double s =
      above_zero(torsio::signed_quantity_with_unit(duration, "s", "--duration"), "--duration");
  constexpr double kLongest_s = 1e9;
  if (s > kLongest_s)
    throw torsio::UsageError(
        {.place = "--duration", .expected = "at most 30 years", .found = fmt::format("{:g} s", s)});
  return std::max<std::int64_t>(1, std::llround(1e9 * s / static_cast<double>(kCycle_ns)));
}

void run(const JointFlags& flags, const CLI::App& verb) {
  if (flags.is_fast && (flags.is_realtime || flags.has_bare_loop))
    throw torsio::UsageError({.place = "--fast",
                              .expected = "neither --realtime nor --bare-loop",
                              .found = "one of them"});
  DataFlags().check_outputs({flags.json.destination}, {flags.served.faults});
  const std::int64_t cycles = cycles_of(flags.duration);
  const double watchdog_s = torsio::signed_quantity_with_unit(flags.watchdog, "s", "--watchdog");
  ProgressBar progress;
  std::vector<torsio::ServedArm> arms = flags.served.arms(progress.listener());
  const double can_rate_Hz = torsio::signed_quantity_with_unit(flags.can_rate, "Hz", "--can-rate");
  if (verb.get_option("--can-rate")->count() > 0 && flags.line.can.empty())
    throw torsio::UsageError({.place = "--can-rate", .expected = "--can", .found = "none"});
  const std::unique_ptr<torsio::LinkTransport> transport = flags.line.open(verb);
  const std::unique_ptr<torsio::CanBus> can = flags.line.open_can();
  torsio::JointServer server(
      std::move(arms),
      {.watchdog_s = watchdog_s,
       .rules = flags.is_lenient ? torsio::NdlcomRules::lenient : torsio::NdlcomRules::strict,
       .has_gear_stage = flags.has_gear_stage,
       .seed = flags.seed,
       .can_rate_Hz = can_rate_Hz},
      *transport, can.get());
  std::vector<std::string> start;
  for (const torsio::JointServer::JointStatus& joint : server.joints())
    start.push_back(fmt::format("joint {}: {}, {}, at {}", joint.id, joint.actuator, joint.model,
                                server.line().place));
  if (can != nullptr) start.push_back("CAN nodes with the same numbers at " + can->place());
  report_lines(flags, start);
  JointLoop loop(server, cycles);
  const Cycles done =
      flags.is_fast ? run_fast(flags, server, loop) : run_realtime(flags, server, loop);
  report_lines(flags, server.take_events());
  if (flags.json.wants_tables()) print(summary(done, server));
  flags.json.write(torsio::json_text(run_json(flags, done, server)));
}

}  // namespace

void add_joint(CLI::App& app) {
  auto flags = std::make_shared<JointFlags>();
  CLI::App* verb =
      app.add_subcommand("joint", "simulate joints that other programs drive over a line");
  verb->footer(
      "Example: torsio joint dfki-50\n"
      "         torsio joint 1=dfki-300 2=dfki-120#03 --port 35001 --host-port 35000\n"
      "         torsio joint --arm arm6 --duration 60s --json run.json\n"
      "         torsio joint dfki-28 --unix /tmp/joint --fault 1:gear_angle=freeze@3s\n"
      "         torsio joint dfki-50 --can udp_multicast --watchdog 1s\n"
      "Ctrl-C or SIGTERM stops the joints and prints a summary. docs/robot/joint.md has their "
      "behaviour.");
  flags->served.add(*verb);
  flags->line.add(*verb);
  verb->add_option("--watchdog", flags->watchdog,
                   "longest time without a motion command, 1 ms to 10 s")
      ->capture_default_str();
  verb->add_option("--can-rate", flags->can_rate,
                   "rate of the cyclic CAN frames of position, current and torque; 0Hz: on request")
      ->capture_default_str();
  verb->add_flag("--lenient", flags->is_lenient,
                 "accept frames as the public parser of NDLCom does");
  verb->add_flag("--realtime", flags->is_realtime, "1000 cycles a second (default)");
  verb->add_flag("--fast", flags->is_fast,
                 "as many cycles a second as possible, on a simulated clock");
  verb->add_flag("--bare-loop", flags->has_bare_loop,
                 "also run a loop without work, and print its late cycles for comparison");
  verb->add_option("--duration", flags->duration, "end after this time (default: never)");
  add_seed(*verb, flags->seed, "seed of the sensors' noise");
  verb->add_flag(
      "--gear-stage", flags->has_gear_stage,
      "with the elasticity of the gears, which takes twice the time; else rotor and gear "
      "output turn together");
  flags->json.add(*verb, "the summary");
  verb->callback([flags, verb] { run(*flags, *verb); });
}

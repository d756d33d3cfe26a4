// `torsio connect watch` and `record`: telemetry on the terminal and in a file.
#include <fmt/format.h>

#include <cmath>
#include <limits>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "common/data_flags.hpp"
#include "common/interrupt.hpp"
#include "core/quantity.hpp"
#include "link/connect_flags.hpp"
#include "link/telemetry_file.hpp"
#include "report/json_text.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/units.hpp"
#include "torsio/data/write.hpp"
#include "torsio/realtime/realtime_loop.hpp"

namespace {

using Json = nlohmann::ordered_json;
using torsio::JointConnection;

constexpr double kWait_s = 0.02;
/// Without telemetry for this time the joint, or the line, is lost.
constexpr std::int64_t kSilence_ns = 2'000'000'000;
constexpr std::uint64_t kLinesPerHeading = 40;

struct TelemetryFlags : ConnectFlags {
  std::vector<std::string> channels;
  std::string rate;
  std::string duration;
  std::string output;

  void add_telemetry(CLI::App& verb, const char* default_rate) {
    rate = default_rate;
    verb.add_option("--channels", channels, "channels of torsio connect describe (default: all)")
        ->delimiter(',');
    verb.add_option("--rate", rate, "samples per second")->capture_default_str();
    verb.add_option("--for", duration, "ends after this time (default: until it is interrupted)");
    add(verb);
  }
  [[nodiscard]] double rate_Hz() const {
    return above_zero(torsio::signed_quantity_with_unit(rate, "Hz", "--rate"), "--rate");
  }
  [[nodiscard]] double duration_s() const {
    if (duration.empty()) return std::numeric_limits<double>::infinity();
    return above_zero(torsio::signed_quantity_with_unit(duration, "s", "--for"), "--for");
  }
};

/// Calls `visit` for each telemetry until the time is over by the joint's clock, Ctrl-C, or `visit` returns false.
/// @throws torsio::Error if the joint is silent
template <class Visit>
void receive(JointConnection& joint, double duration_s, const Visit& visit) {
  torsio::MonotonicClock clock;
  std::int64_t heard_ns = clock.now_ns();
  std::optional<std::uint64_t> first_ns;
  bool goes_on = true;
  while (goes_on && !is_interrupted()) {
    joint.poll(
        [&](const torsio::LinkTelemetry& telemetry) {
          if (!goes_on) return;
          if (!first_ns) first_ns = telemetry.time_ns;
          const double t_s = 1e-9 * static_cast<double>(telemetry.time_ns - *first_ns);
          heard_ns = clock.now_ns();
          goes_on = t_s < duration_s && visit(t_s, telemetry);
        },
        kWait_s);
    if (clock.now_ns() - heard_ns > kSilence_ns)
      throw torsio::Error({.place = joint.place(),
                           .problem = "no telemetry for 2 s",
                           .advice = "The joint has ended, or the line is interrupted."});
  }
  lift_interrupt_deadline();
}

std::string loss_text(const JointConnection& joint) {
  const auto& counts = joint.counts();
  if (counts.lost == 0) return {};
  return fmt::format("{} of {} frames of telemetry were lost", counts.lost,
                     counts.lost + counts.telemetry);
}

void watch(const TelemetryFlags& flags) {
  JointConnection joint = flags.connection();
  const auto subscribed = joint.subscribe(flags.channels, flags.rate_Hz());
  const bool has_lines = flags.json.wants_tables();
  Json rows = Json::array();
  std::uint64_t lines = 0;
  receive(joint, flags.duration_s(), [&](double t_s, const torsio::LinkTelemetry& telemetry) {
    const std::span values = std::span(telemetry.values.values).first(telemetry.values.count);
    std::string heading = fmt::format("{:>10}", "t_s");
    std::string line = fmt::format("{:10.3f}", t_s);
    for (std::size_t k = 0; k < values.size(); ++k) {
      const std::string& name = subscribed.channels[k];
      heading += fmt::format("  {:>11}", name);
      line += fmt::format("  {:>{}.6g}", values[k], std::max<std::size_t>(name.size(), 11));
    }
    if (has_lines && lines % kLinesPerHeading == 0) print(heading + "\n");
    if (has_lines) print(line + "\n");
    if (!flags.json.destination.empty()) {
      Json row = Json::array({t_s});
      for (const float value : values) row.push_back(value);
      rows.push_back(row);
    }
    ++lines;
    return true;
  });
  if (const std::string text = loss_text(joint); !text.empty()) remark(text);
  std::vector<std::string> columns = subscribed.channels;
  columns.insert(columns.begin(), "t_s");
  flags.json.write(torsio::json_text(Json{{"columns", columns}, {"rows", rows}}));
}

void record(const TelemetryFlags& flags) {
  JointConnection joint = flags.connection();
  TelemetryFile::check(flags.output);
  TelemetryFile file(
      joint.subscribe(
          flags.channels.empty() ? TelemetryFile::recorded(joint.channels()) : flags.channels,
          flags.rate_Hz()),
      flags.output, flags.bridge_s());
  receive(joint, flags.duration_s(), [&](double, const torsio::LinkTelemetry& telemetry) {
    file.add(telemetry);
    return !file.has_dropped();
  });
  const TelemetrySummary summary = file.close();
  remark(text_of(flags.output, summary));
  flags.json.write(torsio::json_text(Json{{"samples", summary.frames + summary.missing},
                                          {"missing", summary.missing},
                                          {"bridged", summary.bridged},
                                          {"channels", summary.channels},
                                          {"sample_rate_Hz", summary.rate_Hz}}));
}

}  // namespace

void add_connect_watch(CLI::App& connect) {
  auto flags = std::make_shared<TelemetryFlags>();
  CLI::App* verb = connect.add_subcommand("watch", "print the telemetry of a joint as a table");
  verb->footer("Example: torsio connect watch --channels torque_Nm --rate 5Hz --for 2s");
  flags->add_telemetry(*verb, "10Hz");
  verb->callback([flags] { watch(*flags); });
}

void add_connect_record(CLI::App& connect) {
  auto flags = std::make_shared<TelemetryFlags>();
  CLI::App* verb = connect.add_subcommand("record", "write the telemetry of a joint into a file");
  verb->footer(
      "Example: torsio connect record -o run.mcap --for 10s\n"
      "         torsio connect record -o run.csv && torsio check run.csv\n"
      "Ctrl-C ends the recording, and the file is completed. After a SIGKILL run.csv.tsr has all "
      "but the\n"
      "last tenth of a second: torsio unpack.");
  verb->add_option("-o,--output", flags->output,
                   fmt::format("file to write; its ending names the format: {}, .tsr",
                               torsio::kRecordingEndings))
      ->required();
  flags->add_telemetry(*verb, "1000Hz");
  flags->add_bridge(*verb);
  verb->callback([flags] { record(*flags); });
}

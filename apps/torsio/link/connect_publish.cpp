// `torsio connect publish`: telemetry for PlotJuggler and Foxglove.
#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <chrono>
#include <limits>
#include <map>
#include <memory>
#include <mutex>
#include <nlohmann/json.hpp>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "common/data_flags.hpp"
#include "common/interrupt.hpp"
#include "core/quantity.hpp"
#include "link/connect_flags.hpp"
#include "live/wall_time.hpp"
#include "report/json_text.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/units.hpp"
#include "torsio/link/joint_group.hpp"
#include "torsio/live/telemetry_publisher.hpp"
#include "torsio/realtime/realtime_loop.hpp"
#include "torsio/report/text_table.hpp"

namespace {

using Json = nlohmann::ordered_json;

constexpr double kPublishWait_s = 0.02;
/// The differences of the clocks are learned for this time before the first sample is published.
constexpr std::int64_t kLearned_ns = 100'000'000;

struct PublishFlags : ConnectFlags {
  std::string joints = "1";
  std::vector<std::string> channels;
  std::string rate = "1000Hz";
  std::string duration;
  std::string plotjuggler;
  CLI::Option* has_plotjuggler = nullptr;
  std::string foxglove;
  CLI::Option* has_foxglove = nullptr;
  std::string address = "127.0.0.1";
  std::vector<std::string> hosts;
  std::vector<std::string> origins;

  [[nodiscard]] double duration_s() const {
    if (duration.empty()) return std::numeric_limits<double>::infinity();
    return above_zero(torsio::signed_quantity_with_unit(duration, "s", "--for"), "--for");
  }
};

/// @param lowest 0 or 1
std::uint16_t port_of(std::string_view text, const char* flag, const char* expected,
                      unsigned lowest) {
  unsigned port = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), port);
  if (error != std::errc() || end != text.data() + text.size() || port < lowest ||
      port > UINT16_MAX)
    throw torsio::UsageError(
        {.place = flag, .expected = expected, .found = fmt::format("'{}'", text)});
  return static_cast<std::uint16_t>(port);
}

torsio::TelemetryPublisher::PlotJuggler plotjuggler_of(const std::string& text) {
  torsio::TelemetryPublisher::PlotJuggler to;
  if (text.empty()) return to;
  const std::size_t colon = text.find(':');
  to.address = text.substr(0, colon);
  if (colon != std::string::npos)
    to.port = port_of(std::string_view(text).substr(colon + 1), "--plotjuggler",
                      "ADDRESS:PORT, as 127.0.0.1:9870", 1);
  return to;
}

std::uint16_t foxglove_port(const std::string& text) {
  if (text.empty()) return torsio::TelemetryPublisher::Foxglove{}.port;
  return port_of(text, "--foxglove", "a port of 0 to 65535", 0);
}

/// Prints each origin that was refused once, with what allows it. It is called in a thread of the server.
class RefusedOrigins {
 public:
  void add(const torsio::WebRequest& request) {
    const std::lock_guard lock(mutex_);
    if (request.origin.empty() || seen_.size() >= kShown || !seen_.insert(request.origin).second)
      return;
    remark(
        fmt::format("a page of {0} was refused; if it may connect: --origins {0}", request.origin));
  }

 private:
  static constexpr std::size_t kShown = 10;
  std::mutex mutex_ = {};
  std::set<std::string> seen_ = {};
};

/// Names of topics: that of the joint, with its id where several have the same.
std::vector<std::string> topics(const torsio::JointGroup& joints) {
  std::map<std::string, int> count;
  for (std::size_t n = 0; n < joints.size(); ++n) ++count[joints.information(n).name];
  std::vector<std::string> names;
  for (std::size_t n = 0; n < joints.size(); ++n) {
    const std::string& name = joints.information(n).name;
    const bool is_unique = !name.empty() && count[name] == 1;
    names.push_back(is_unique ? name
                              : fmt::format("{}_{}", name.empty() ? "joint" : name, joints.id(n)));
  }
  return names;
}

class Publishing {
 public:
  explicit Publishing(const PublishFlags& flags)
      : flags_(flags),
        joints_(flags.line, {.id = static_cast<std::uint8_t>(flags.id),
                             .joints = joint_ids(flags.joints),
                             .rules = flags.settings().rules,
                             .timeout_s = flags.settings().timeout_s}),
        topics_(topics(joints_)),
        times_(joints_.size()),
        was_silent_(joints_.size()) {
    joints_.subscribe(
        flags.channels,
        above_zero(torsio::signed_quantity_with_unit(flags.rate, "Hz", "--rate"), "--rate"));
    torsio::TelemetryPublisher::Settings settings;
    for (std::size_t n = 0; n < joints_.size(); ++n)
      settings.joints.push_back({.name = topics_[n], .channels = joints_.subscription(n).channels});
    if (flags.has_plotjuggler->count() > 0)
      settings.plotjuggler = plotjuggler_of(flags.plotjuggler);
    if (flags.has_foxglove->count() > 0)
      settings.foxglove = {.address = flags.address,
                           .port = foxglove_port(flags.foxglove),
                           .hosts = flags.hosts,
                           .origins = origins(),
                           .on_refused = [this](const torsio::WebRequest& request, int) {
                             refused_origins_.add(request);
                           }};
    publisher_ = std::make_unique<torsio::TelemetryPublisher>(settings);
    if (settings.plotjuggler)
      remark(fmt::format("PlotJuggler: UDP Server, port {}, protocol JSON, use timestamp",
                         settings.plotjuggler->port));
    if (settings.foxglove)
      remark(fmt::format("Foxglove: ws://{}:{}",
                         flags.address == "127.0.0.1" ? "localhost" : flags.address,
                         publisher_->foxglove_port()));
  }

  void run() {
    const std::int64_t start_ns = clock_.now_ns();
    learn_clocks();
    const double duration_s = flags_.duration_s();
    while (!is_interrupted() &&
           1e-9 * static_cast<double>(clock_.now_ns() - start_ns) < duration_s) {
      joints_.poll([this](std::size_t joint,
                          const torsio::LinkTelemetry& telemetry) { publish(joint, telemetry); },
                   kPublishWait_s);
      report_silence();
    }
    lift_interrupt_deadline();
  }

  void report() const {
    const auto counts = publisher_->counts();
    torsio::TextTable table;
    table.header({"joint", "topic", "samples", "lost", "state"});
    Json joints = Json::array();
    for (std::size_t n = 0; n < joints_.size(); ++n) {
      const auto& each = joints_.counts(n);
      const std::string state = joints_.is_silent(n) ? "silent" : "heard";
      table.row({fmt::format("{}", joints_.id(n)), topics_[n], fmt::format("{}", each.telemetry),
                 fmt::format("{}", each.lost), state});
      joints.push_back({{"id", joints_.id(n)},
                        {"topic", topics_[n]},
                        {"samples", each.telemetry},
                        {"lost", each.lost},
                        {"is_silent", joints_.is_silent(n)}});
    }
    if (flags_.json.wants_tables()) {
      print(table.text());
      if (flags_.has_plotjuggler->count() > 0)
        print(fmt::format("PlotJuggler: {} datagrams, {} not sent\n", counts.datagrams,
                          counts.datagrams_not_sent));
      if (flags_.has_foxglove->count() > 0)
        print(fmt::format("Foxglove: {} clients, {} messages, {} clients dropped, {} refused\n",
                          counts.clients, counts.messages, counts.dropped, counts.refused));
    }
    flags_.json.write(torsio::json_text(Json{{"joints", joints},
                                             {"samples", counts.samples},
                                             {"datagrams", counts.datagrams},
                                             {"datagrams_not_sent", counts.datagrams_not_sent},
                                             {"clients", counts.clients},
                                             {"messages", counts.messages},
                                             {"dropped", counts.dropped},
                                             {"refused", counts.refused}}));
  }

 private:
  /// The desktop program and pages of this machine, and what was asked for.
  [[nodiscard]] std::vector<std::string> origins() const {
    std::vector<std::string> all = {"file://", "http://localhost:*", "http://127.0.0.1:*"};
    all.insert(all.end(), flags_.origins.begin(), flags_.origins.end());
    return all;
  }
  static std::uint64_t wall_ns() {
    return static_cast<std::uint64_t>(std::chrono::duration_cast<std::chrono::nanoseconds>(
                                          std::chrono::system_clock::now().time_since_epoch())
                                          .count());
  }
  void learn_clocks() {
    std::vector<std::pair<std::size_t, torsio::LinkTelemetry>> first;
    const std::int64_t end_ns = clock_.now_ns() + kLearned_ns;
    while (!is_interrupted() && clock_.now_ns() < end_ns)
      joints_.poll(
          [&](std::size_t joint, const torsio::LinkTelemetry& telemetry) {
            times_[joint].learn(telemetry.time_ns, wall_ns());
            first.emplace_back(joint, telemetry);
          },
          kPublishWait_s);
    for (const auto& [joint, telemetry] : first) publish(joint, telemetry);
  }
  void publish(std::size_t joint, const torsio::LinkTelemetry& telemetry) {
    publisher_->publish(joint, times_[joint].time_us(telemetry.time_ns, wall_ns()),
                        std::span(telemetry.values.values).first(telemetry.values.count));
  }
  void report_silence() {
    for (std::size_t n = 0; n < joints_.size(); ++n) {
      if (joints_.is_silent(n) == was_silent_[n]) continue;
      was_silent_[n] = joints_.is_silent(n);
      const std::string text =
          fmt::format("{} {}", joints_.place(n), was_silent_[n] ? "is silent" : "is heard again");
      remark(text);
      publisher_->warn(text);
    }
  }

  const PublishFlags& flags_;
  torsio::JointGroup joints_;
  std::vector<std::string> topics_;
  std::vector<torsio::WallTime> times_;
  std::vector<bool> was_silent_;
  RefusedOrigins refused_origins_ = {};
  torsio::MonotonicClock clock_ = {};
  std::unique_ptr<torsio::TelemetryPublisher> publisher_ = {};
};

void publish(const PublishFlags& flags) {
  if (flags.has_plotjuggler->count() == 0 && flags.has_foxglove->count() == 0)
    throw torsio::UsageError({.place = "torsio connect publish",
                              .expected = "--plotjuggler, --foxglove or both",
                              .found = "none"});
  Publishing publishing(flags);
  publishing.run();
  publishing.report();
}

}  // namespace

void add_connect_publish(CLI::App& connect) {
  auto flags = std::make_shared<PublishFlags>();
  CLI::App* verb = connect.add_subcommand(
      "publish", "publish the telemetry of joints for PlotJuggler and Foxglove");
  verb->footer(
      "Example: torsio connect publish --joints 1-12 --plotjuggler --foxglove\n"
      "         torsio connect publish --foxglove --origins https://app.foxglove.dev\n"
      "docs/robot/publish.md has more of them. It never takes control of a joint.");
  verb->add_option("--joints", flags->joints, "ids, as 1,2,5 or 1-12")->capture_default_str();
  flags->has_plotjuggler =
      verb->add_option("--plotjuggler", flags->plotjuggler,
                       "ADDRESS[:PORT] to which UDP is sent (default: 127.0.0.1:9870)")
          ->expected(0, 1);
  flags->has_foxglove =
      verb->add_option("--foxglove", flags->foxglove,
                       "PORT on which Foxglove connects (default: 8765; 0: any free one)")
          ->expected(0, 1);
  verb->add_option("--address", flags->address,
                   "address of the interface on which Foxglove connects; 0.0.0.0: every one")
      ->capture_default_str();
  verb->add_option("--hosts", flags->hosts,
                   "further names of this machine by which Foxglove connects")
      ->delimiter(',');
  verb->add_option("--origins", flags->origins,
                   "pages that may connect beside those of this machine, as "
                   "https://app.foxglove.dev; '*': every page that a browser here shows")
      ->delimiter(',');
  verb->add_option("--channels", flags->channels,
                   "channels of torsio connect describe (default: all)")
      ->delimiter(',');
  verb->add_option("--rate", flags->rate, "samples per second")->capture_default_str();
  verb->add_option("--for", flags->duration,
                   "ends after this time (default: until it is interrupted)");
  flags->add_line(*verb);
  verb->callback([flags] { publish(*flags); });
}

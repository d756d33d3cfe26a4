// `torsio connect page`: joints in a browser.
#include <fmt/chrono.h>
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <ctime>
#include <exception>
#include <filesystem>
#include <future>
#include <limits>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "common/data_flags.hpp"
#include "common/interrupt.hpp"
#include "core/quantity.hpp"
#include "link/connect_flags.hpp"
#include "link/page_models.hpp"
#include "link/telemetry_file.hpp"
#include "report/json_text.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/units.hpp"
#include "torsio/link/joint_group.hpp"
#include "torsio/live/live_page.hpp"
#include "torsio/realtime/realtime_loop.hpp"

namespace {

using Json = nlohmann::ordered_json;

constexpr double kPicture_s = 1.0 / 60.0;
constexpr std::int64_t kStatusPeriod_ns = 200'000'000;
/// The register that has it, where a joint is monitored.
constexpr std::string_view kMonitor = "monitor";
/// A clock that goes back is that of a joint which was started again.
constexpr std::uint64_t kRestart_ns = 1'000'000'000;

struct PageFlags : ConnectFlags {
  std::string joints = "1";
  std::vector<std::string> channels;
  std::string rate = "1000Hz";
  std::string duration;
  std::vector<std::string> models;
  std::string folder = ".";
  std::string ending = "csv";
  std::string reference = "truth_torque_Nm";
  std::uint16_t port = 0;

  [[nodiscard]] double duration_s() const {
    if (duration.empty()) return std::numeric_limits<double>::infinity();
    return above_zero(torsio::signed_quantity_with_unit(duration, "s", "--for"), "--for");
  }
};

/// One joint of the page.
struct PageJoint {
  PageModels models;
  std::vector<double> values = {};  ///< telemetry, then the estimates
  std::optional<std::uint64_t> first_ns = {};
  std::uint64_t last_ns = 0;
  std::uint64_t first_number = 0;
  std::uint64_t next_number = 0;
  std::string state = {};
  std::string monitor = {};  ///< empty: it has none, or no such register
};

/// "20261128T173747.120Z": the time of now, UTC.
std::string time_text() {
  const auto now_ms = std::chrono::duration_cast<std::chrono::milliseconds>(
                          std::chrono::system_clock::now().time_since_epoch())
                          .count();
  return fmt::format("{:%Y%m%dT%H%M%S}.{:03}Z", fmt::gmtime(std::time_t{now_ms / 1000}),
                     now_ms % 1000);
}

/// Recordings that a button begins and ends: one file for each joint.
class PageRecordings {
 public:
  PageRecordings(const PageFlags& flags, const torsio::JointGroup& joints)
      : folder_(flags.folder),
        ending_(flags.ending),
        bridge_s_(flags.bridge_s()),
        joints_(joints) {}

  [[nodiscard]] bool is_on() const noexcept { return !files_.empty(); }
  [[nodiscard]] const std::vector<std::string>& names() const noexcept { return names_; }
  /// Why the last recording was not begun, or has ended by itself.
  [[nodiscard]] const std::string& trouble() const noexcept { return trouble_; }
  [[nodiscard]] double duration_s() const {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin_).count();
  }

  void begin() {
    if (is_on()) return;
    trouble_.clear();
    begin_ = std::chrono::steady_clock::now();
    const std::string time = time_text();
    try {
      for (std::size_t j = 0; j < joints_.size(); ++j) {
        const std::string name = fmt::format("joint{}_{}.{}", joints_.id(j), time, ending_);
        const std::string path = (std::filesystem::path(folder_) / name).string();
        if (std::filesystem::exists(path))
          throw torsio::Error({.place = path, .problem = "the file exists"});
        files_.push_back(std::make_unique<TelemetryFile>(joints_.subscription(j), path, bridge_s_));
        names_.push_back(path);
      }
    } catch (const std::exception& error) {
      end();
      trouble_ = error.what();
      remark(trouble_);
    }
  }
  void add(std::size_t joint, const torsio::LinkTelemetry& telemetry) {
    if (!is_on()) return;
    files_[joint]->add(telemetry);
    if (!files_[joint]->has_dropped()) return;
    trouble_ = names_[joint] + ": the disk does not take the samples any more";
    remark(trouble_);
    end();
  }
  /// The files are completed in a thread of their own, one after the other, so that no telemetry waits for the disk.
  void end() {
    if (!is_on()) return;
    auto files = std::make_shared<Files>(std::exchange(files_, {}));
    completing_.push_back(std::async(std::launch::async,
                                     [files = std::move(files), names = std::exchange(names_, {})] {
                                       return completed(*files, names);
                                     }));
  }
  /// Prints what was completed. @param waits for all
  void report(bool waits) {
    std::erase_if(completing_, [waits](std::future<std::string>& each) {
      if (!waits && each.wait_for(std::chrono::seconds(0)) != std::future_status::ready)
        return false;
      remark(each.get());
      return true;
    });
  }

 private:
  using Files = std::vector<std::unique_ptr<TelemetryFile>>;

  static std::string completed(Files& files, const std::vector<std::string>& names) {
    std::string text;
    for (std::size_t j = 0; j < files.size(); ++j) {
      if (!text.empty()) text += '\n';
      try {
        text += text_of(names[j], files[j]->close());
      } catch (const std::exception& error) {
        text += error.what();
      }
      files[j].reset();
    }
    return text;
  }

  std::string folder_;
  std::string ending_;
  double bridge_s_;
  const torsio::JointGroup& joints_;
  Files files_ = {};
  std::vector<std::string> names_ = {};
  std::string trouble_ = {};
  std::chrono::steady_clock::time_point begin_ = {};
  std::vector<std::future<std::string>> completing_ = {};
};

class PageLoop {
 public:
  PageLoop(const PageFlags& flags, torsio::JointGroup& group)
      : flags_(flags), group_(group), recordings_(flags, group) {
    torsio::LivePage::Settings settings{.server = {.port = flags.port},
                                        .rate_Hz = group.subscription(0).rate_Hz,
                                        .reference = flags.reference};
    for (std::size_t j = 0; j < group.size(); ++j) {
      const auto& channels = group.subscription(j).channels;
      PageJoint joint{.models = PageModels(flags.models, group.place(j), channels,
                                           group.subscription(j).rate_Hz)};
      settings.joints.push_back({.id = group.id(j),
                                 .name = group.information(j).name,
                                 .actuator = group.information(j).actuator,
                                 .channels = channels,
                                 .models = joint.models.models()});
      joint.values.resize(settings.joints.back().values());
      joint.state = std::string(name(group.information(j).state));
      joints_.push_back(std::move(joint));
    }
    rate_Hz_ = settings.rate_Hz;
    page_ = std::make_unique<torsio::LivePage>(std::move(settings));
  }

  void run() {
    remark(
        fmt::format("{}\nThis page is for this machine and for whoever has its address; Ctrl-C "
                    "ends it.",
                    page_->url()));
    const double duration_s = flags_.duration_s();
    begin_ns_ = clock_.now_ns();
    while (!is_interrupted() && elapsed_s() < duration_s) {
      group_.poll([this](std::size_t joint,
                         const torsio::LinkTelemetry& telemetry) { take(joint, telemetry); },
                  kPicture_s);
      page_->flush();
      obey();
      if (is_due(status_ns_, kStatusPeriod_ns) && page_->is_connected()) {
        read_state(read_joint_++ % joints_.size());
        show_status();
      }
      recordings_.report(false);
    }
    lift_interrupt_deadline();
    recordings_.end();
    recordings_.report(true);
  }

  [[nodiscard]] Json json() const {
    const torsio::LivePage::Counts counts = page_->counts();
    Json joints = Json::array();
    for (std::size_t j = 0; j < group_.size(); ++j)
      joints.push_back({{"id", group_.id(j)},
                        {"telemetry", group_.counts(j).telemetry},
                        {"lost", group_.counts(j).lost}});
    return {{"pages", counts.pages},
            {"refused", counts.refused + counts.server.refused},
            {"dropped", counts.server.dropped},
            {"sent_B", counts.server.sent_B},
            {"joints", std::move(joints)}};
  }

 private:
  [[nodiscard]] double elapsed_s() const {
    return 1e-9 * static_cast<double>(clock_.now_ns() - begin_ns_);
  }
  bool is_due(std::int64_t& last_ns, std::int64_t period_ns) const {
    const std::int64_t now_ns = clock_.now_ns();
    if (now_ns - last_ns < period_ns) return false;
    last_ns = now_ns;
    return true;
  }

  void take(std::size_t index, const torsio::LinkTelemetry& telemetry) {
    recordings_.add(index, telemetry);
    PageJoint& joint = joints_[index];
    const bool has_restarted = telemetry.time_ns + kRestart_ns < joint.last_ns;
    if (!joint.first_ns || has_restarted) {
      joint.first_ns = telemetry.time_ns;
      joint.first_number =
          std::max(static_cast<std::uint64_t>(elapsed_s() * rate_Hz_), joint.next_number);
    }
    if (telemetry.time_ns < *joint.first_ns) return;
    joint.last_ns = telemetry.time_ns;
    const std::uint64_t number =
        joint.first_number +
        static_cast<std::uint64_t>(std::llround(
            1e-9 * static_cast<double>(telemetry.time_ns - *joint.first_ns) * rate_Hz_));
    const std::span values = std::span(telemetry.values.values).first(telemetry.values.count);
    std::ranges::copy(values, joint.values.begin());
    const std::span all(joint.values);
    joint.models.step(number, all.first(values.size()), all.subspan(values.size()));
    joint.next_number = number + 1;
    page_->add(index, number, joint.values);
  }

  /// What the page asks for.
  void obey() {
    using Kind = torsio::LivePage::Request::Kind;
    for (const torsio::LivePage::Request& each : page_->take_requests()) {
      if (each.kind == Kind::begin_recording) recordings_.begin();
      if (each.kind == Kind::end_recording) recordings_.end();
      if (each.kind == Kind::switch_model)
        joints_[each.joint].models.switch_model(each.model, each.is_on);
    }
  }

  /// One joint each time, since the loop waits for its reply: up to the time-out times five where it is lost.
  void read_state(std::size_t j) {
    if (group_.is_silent(j)) return;
    PageJoint& joint = joints_[j];
    joint.state = "unknown";
    joint.monitor.clear();
    try {
      joint.state = std::string(name(group_.state(j)));
      joint.monitor = torsio::text_of(group_.read(j, kMonitor));
    } catch (const torsio::Error&) {
      return;  // without this register, or without a reply: it is asked again
    }
  }

  void show_status() {
    torsio::LivePage::Status status{
        .recorded_files = recordings_.names(),
        .recorded_s = recordings_.is_on() ? recordings_.duration_s() : 0.0};
    for (std::size_t j = 0; j < joints_.size(); ++j)
      status.joints.push_back({.state = joints_[j].state,
                               .monitor = joints_[j].monitor,
                               .is_silent = group_.is_silent(j),
                               .lost = group_.counts(j).lost,
                               .models = joints_[j].models.are_on()});
    page_->show(status);
  }

  const PageFlags& flags_;
  torsio::JointGroup& group_;
  PageRecordings recordings_;
  std::vector<PageJoint> joints_ = {};
  std::unique_ptr<torsio::LivePage> page_ = {};
  mutable torsio::MonotonicClock clock_ = {};
  double rate_Hz_ = 0.0;
  std::int64_t begin_ns_ = 0;
  std::int64_t status_ns_ = 0;
  std::size_t read_joint_ = 0;
};

void run(const PageFlags& flags) {
  // Before the joints are asked for anything.
  TelemetryFile::check((std::filesystem::path(flags.folder) / ("torsio." + flags.ending)).string());
  const torsio::JointConnection::Settings line = flags.settings();
  torsio::JointGroup group(flags.line, {.id = line.id,
                                        .joints = joint_ids(flags.joints),
                                        .rules = line.rules,
                                        .timeout_s = line.timeout_s});
  group.subscribe(
      flags.channels,
      above_zero(torsio::signed_quantity_with_unit(flags.rate, "Hz", "--rate"), "--rate"));
  for (std::size_t j = 0; j < group.size(); ++j) {
    const auto& subscription = group.subscription(j);
    if (TelemetryFile::recorded(subscription.channels) != subscription.channels)
      throw torsio::Error({.place = group.place(j),
                           .problem = "a channel has no SI unit and cannot be recorded",
                           .advice = "Name the others by --channels."});
    if (subscription.rate_Hz != group.subscription(0).rate_Hz)
      throw torsio::Error({.place = group.place(j),
                           .expected = fmt::format("{:g} Hz, the rate of the first joint",
                                                   group.subscription(0).rate_Hz),
                           .found = fmt::format("{:g} Hz", subscription.rate_Hz),
                           .advice = "Give a rate by --rate that every joint has."});
  }
  PageLoop loop(flags, group);
  loop.run();
  flags.json.write(torsio::json_text(loop.json()));
}

}  // namespace

void add_connect_page(CLI::App& connect) {
  auto flags = std::make_shared<PageFlags>();
  CLI::App* verb = connect.add_subcommand(
      "page", "show joints in a browser: time series, hysteresis loop, estimates, recordings");
  verb->footer(
      "Example: torsio connect page --joints 1-6 --model joint.safetensors\n"
      "It prints the address of the page, which contains a token: whoever has it can look at the "
      "joints, "
      "record "
      "them, and turn models on and off. The page does not move a joint.");
  verb->add_option("--joints", flags->joints, "ids of the joints: 1,3,5-8")->capture_default_str();
  verb->add_option("--channels", flags->channels,
                   "channels of torsio connect describe (default: all)")
      ->delimiter(',');
  verb->add_option("--rate", flags->rate, "samples per second")->capture_default_str();
  verb->add_option("--for", flags->duration,
                   "ends after this time (default: until it is interrupted)");
  verb->add_option("--model", flags->models,
                   "model files that estimate beside the joints, from their telemetry");
  verb->add_option("--reference", flags->reference, "channel of the torque that is measured")
      ->capture_default_str();
  verb->add_option("--folder", flags->folder, "folder of the recordings that the page begins")
      ->capture_default_str();
  verb->add_option("--format", flags->ending,
                   "ending of their names: csv, csv.gz, mcap, npz, mat, tsr")
      ->capture_default_str();
  verb->add_option("--page-port", flags->port,
                   "port of the page on this machine (default: a free one)");
  flags->add_bridge(*verb);
  flags->add_line(*verb);
  verb->callback([flags] { run(*flags); });
}

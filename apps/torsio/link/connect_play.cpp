// `torsio connect play`: references from a file.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "common/data_flags.hpp"
#include "common/interrupt.hpp"
#include "common/progress_bar.hpp"
#include "core/quantity.hpp"
#include "link/connect_flags.hpp"
#include "link/telemetry_file.hpp"
#include "link/until_at_rest.hpp"
#include "report/json_text.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/units.hpp"
#include "torsio/data/load.hpp"
#include "torsio/data/write.hpp"
#include "torsio/realtime/realtime_loop.hpp"

namespace {

using Json = nlohmann::ordered_json;
using torsio::JointConnection;
using torsio::JointMode;
using torsio::LinkReference;

constexpr std::int64_t kPeriod_ns = 1'000'000;
constexpr double kLongestStop_s = 5.0;

struct PlayFlags : ConnectFlags {
  std::string file;
  std::string mode;
  std::string output;
  std::string valid = "20ms";
};

struct PlayColumn {
  const char* channel;
  float LinkReference::*field;
};
constexpr std::array kColumns{PlayColumn{"position_rad", &LinkReference::position_rad},
                              PlayColumn{"velocity_rad_s", &LinkReference::velocity_rad_s},
                              PlayColumn{"torque_Nm", &LinkReference::torque_Nm},
                              PlayColumn{"current_A", &LinkReference::current_A},
                              PlayColumn{"stiffness_Nm_rad", &LinkReference::stiffness_Nm_rad},
                              PlayColumn{"damping_Nms_rad", &LinkReference::damping_Nms_rad},
                              PlayColumn{"deflection_rad", &LinkReference::deflection_rad}};

/// The column that a mode needs; of two the first: torque and current are feed-forward in other modes.
struct PlayMode {
  JointMode mode;
  const char* channel;
};
constexpr std::array kModes{PlayMode{JointMode::impedance, "stiffness_Nm_rad"},
                            PlayMode{JointMode::position, "position_rad"},
                            PlayMode{JointMode::deflection, "deflection_rad"},
                            PlayMode{JointMode::velocity, "velocity_rad_s"},
                            PlayMode{JointMode::torque, "torque_Nm"},
                            PlayMode{JointMode::current, "current_A"}};

/// References over time, linear between the samples of the file.
class PlayedReferences {
 public:
  PlayedReferences(const torsio::Recording& recording, const std::string& mode) {
    for (const PlayColumn& column : kColumns)
      if (recording.has(column.channel)) add(recording, column);
    rate_Hz_ = recording.sample_rate_Hz();
    duration_s_ = static_cast<double>(recording.size() - 1) / rate_Hz_;
    const auto* const found = std::ranges::find_if(kModes, [&](const PlayMode& each) {
      return mode.empty() ? recording.has(each.channel) : mode == name(each.mode);
    });
    if (found == kModes.end() || !recording.has(found->channel)) refuse_mode(recording, mode);
    mode_ = found->mode;
  }

  [[nodiscard]] JointMode mode() const { return mode_; }
  [[nodiscard]] double duration_s() const { return duration_s_; }
  [[nodiscard]] LinkReference at(double t_s) const {
    LinkReference reference{.mode = mode_};
    for (const Column& column : columns_) {
      const double place = std::clamp(t_s, 0.0, duration_s_) * rate_Hz_;
      const auto before = static_cast<std::size_t>(place);
      const std::size_t after = std::min(before + 1, column.values.size() - 1);
      reference.*column.field = static_cast<float>(std::lerp(
          column.values[before], column.values[after], place - static_cast<double>(before)));
    }
    return reference;
  }

 private:
  struct Column {
    float LinkReference::*field;
    std::vector<double> values;
  };
  void add(const torsio::Recording& recording, const PlayColumn& column) {
    const std::vector<double>& values = recording.channel(column.channel).values;
    const auto gap = std::ranges::find_if_not(values, [](double v) { return std::isfinite(v); });
    if (gap != values.end())
      throw torsio::Error(
          {.place = fmt::format("{}: {} at {:g} s", recording.name(), column.channel,
                                recording.time_s(static_cast<std::size_t>(gap - values.begin()))),
           .expected = "a number: references have no gaps",
           .found = fmt::format("{}", *gap)});
    columns_.push_back({column.field, values});
  }
  [[noreturn]] static void refuse_mode(const torsio::Recording& recording,
                                       const std::string& mode) {
    std::vector<std::string> modes;
    modes.reserve(kModes.size());
    for (const PlayMode& each : kModes)
      modes.push_back(fmt::format("{} ({})", each.channel, name(each.mode)));
    throw torsio::UsageError({.place = recording.name(),
                              .expected = fmt::format("a column {}", fmt::join(modes, ", ")),
                              .found = mode.empty() ? "none of them" : "none for --mode " + mode,
                              .advice = "The first line of a CSV file has the names, and t_s."});
  }

  JointMode mode_ = {};
  std::vector<Column> columns_ = {};
  double rate_Hz_ = 1.0;
  double duration_s_ = 0.0;
};

struct Played {
  double duration_s = 0.0;
  std::uint64_t missed = 0;  ///< periods of this program that began more than one period late
};

/// What the joint found, if it has the register for it and found something: "; its stop_cause is overload".
std::string stop_cause(JointConnection& joint) {
  try {
    const std::string cause = torsio::text_of(joint.read("stop_cause"));
    return cause == "none" ? "" : fmt::format("; its stop_cause is {}", cause);
  } catch (const torsio::Error&) {
    return {};  // there is no such register, or the line has ended, too
  }
}

[[noreturn]] void refuse_state(JointConnection& joint, double t_s) {
  const torsio::LinkState state = *joint.last_change();
  const bool is_fault = state.state == torsio::LinkDriveState::fault;
  throw torsio::Error(
      {.place = joint.place(),
       .problem = fmt::format("the joint ended the motion after {:.3f} s", t_s),
       .found = fmt::format("state {}, {}: {}{}", name(state.state), name(state.reason),
                            meaning(state.reason), stop_cause(joint)),
       .advice = fmt::format("`torsio connect {}` makes it ready again.",
                             is_fault ? "reset" : "disable")});
}

bool has_ended(const JointConnection& joint) {
  const auto state = joint.last_change();
  return state && state->state != torsio::LinkDriveState::enabled;
}

Played play(JointConnection& joint, const PlayedReferences& references, double valid_s,
            const JointConnection::VisitTelemetry& visit) {
  torsio::MonotonicClock clock;
  Played played;
  joint.enable();
  const std::int64_t start_ns = clock.now_ns();
  for (std::int64_t due_ns = start_ns; !is_interrupted(); due_ns += kPeriod_ns) {
    clock.sleep_until(due_ns);
    const std::int64_t late_ns = clock.now_ns() - due_ns;
    if (late_ns > kPeriod_ns) {
      const std::int64_t skipped = late_ns / kPeriod_ns;
      played.missed += static_cast<std::uint64_t>(skipped);
      due_ns += skipped * kPeriod_ns;
    }
    played.duration_s = 1e-9 * static_cast<double>(due_ns - start_ns);
    if (played.duration_s > references.duration_s()) break;
    joint.send(references.at(played.duration_s), valid_s);
    joint.poll(visit);
    if (has_ended(joint)) refuse_state(joint, played.duration_s);
  }
  return played;
}

/// Brings the joint to rest, and removes its power.
void stop_and_disable(JointConnection& joint, const JointConnection::VisitTelemetry& visit) {
  joint.stop(torsio::StopCategory::ramp_and_brake);
  const auto poll = [&] { joint.poll(visit, 0.05); };
  poll();
  until_at_rest(
      kLongestStop_s, [&] { joint.disable(); }, poll);
}

void report(const PlayFlags& flags, const JointConnection& joint, const Played& played,
            JointMode mode) {
  const JointConnection::Counts& counts = joint.counts();
  Json refused = Json::object();
  std::string text =
      fmt::format("{}: {} references of mode {} in {:.3f} s, {} periods missed\n", joint.place(),
                  counts.references, name(mode), played.duration_s, played.missed);
  for (std::size_t k = 0; k < counts.refused.size(); ++k) {
    if (counts.refused[k] == 0) continue;
    const auto reason = static_cast<torsio::LinkRefusal>(k);
    refused[std::string(name(reason))] = counts.refused[k];
    text += fmt::format("{} refused, {}: {}\n", counts.refused[k], name(reason), meaning(reason));
  }
  if (refused.empty()) text += "none was refused\n";
  if (flags.json.wants_tables()) print(text);
  flags.json.write(torsio::json_text(Json{{"mode", name(mode)},
                                          {"references", counts.references},
                                          {"duration_s", played.duration_s},
                                          {"missed_periods", played.missed},
                                          {"refused", refused}}));
}

void run(const PlayFlags& flags) {
  ProgressBar progress;
  torsio::LoadOptions options;
  options.progress = progress.listener();
  const std::vector<torsio::Recording> recordings = torsio::load_recordings(flags.file, options);
  if (recordings.size() != 1)
    throw torsio::UsageError({.place = flags.file,
                              .expected = "one recording",
                              .found = fmt::format("{}", recordings.size())});
  const PlayedReferences references(recordings.front(), flags.mode);
  JointConnection joint = flags.connection();
  std::optional<TelemetryFile> file;
  if (!flags.output.empty()) {
    TelemetryFile::check(flags.output);
    file.emplace(joint.subscribe(TelemetryFile::recorded(joint.channels()), 1000.0), flags.output,
                 flags.bridge_s());
  }
  const auto visit = [&](const torsio::LinkTelemetry& telemetry) {
    if (file) file->add(telemetry);
  };
  const double valid_s =
      above_zero(torsio::signed_quantity_with_unit(flags.valid, "s", "--valid"), "--valid");
  const Played played = play(joint, references, valid_s, visit);
  lift_interrupt_deadline();
  stop_and_disable(joint, visit);
  report(flags, joint, played, references.mode());
  if (file) remark(text_of(flags.output, file->close()));
}

}  // namespace

void add_connect_play(CLI::App& connect) {
  auto flags = std::make_shared<PlayFlags>();
  CLI::App* verb = connect.add_subcommand(
      "play", "enable a joint, send it the references of a file, and stop it");
  verb->footer(
      "Example: torsio connect play torque.csv --joint 3 -o measured.csv\n"
      "A reference is sent each millisecond, linear between the rows. Ctrl-C stops the joint.");
  verb->add_option("FILE", flags->file,
                   "recording with t_s and references: position_rad, velocity_rad_s, torque_Nm, "
                   "current_A, stiffness_Nm_rad, damping_Nms_rad, deflection_rad")
      ->required();
  verb->add_option(
      "--mode", flags->mode,
      "impedance, position, deflection, velocity, torque or current (default: the first "
      "of these whose column the file has)");
  verb->add_option(
      "-o,--output", flags->output,
      fmt::format("record the telemetry meanwhile; the ending names the format: {}, .tsr",
                  torsio::kRecordingEndings));
  verb->add_option("--valid", flags->valid,
                   "age after which the joint refuses a reference, and stops without another")
      ->capture_default_str();
  flags->add_bridge(*verb);
  flags->add(*verb);
  verb->callback([flags] { run(*flags); });
}

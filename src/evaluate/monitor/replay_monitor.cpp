#include <fmt/format.h>

#include <cmath>
#include <cstddef>
#include <utility>

#include "core/report_progress.hpp"
#include "evaluate/monitor/source_run.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/realtime.hpp"
#include "torsio/evaluate/monitor_replay.hpp"

namespace torsio {
namespace {

constexpr std::size_t kSamplesPerReport = 1000;
constexpr double kRateTolerance = 1e-3;
const std::string kTorque = "torque_Nm";

/// The channels of a recording with the age of their samples.
class RawChannels {
 public:
  RawChannels(const Recording& recording, const std::vector<std::string>& names)
      : samples_(names.size()), period_s_(1.0 / recording.sample_rate_Hz()) {
    for (const std::string& name : names) channels_.push_back(&recording.channel(name));
  }

  std::span<const SignalSample> at(std::size_t n) {
    for (std::size_t k = 0; k < channels_.size(); ++k) {
      const bool is_fresh = channels_[k]->is_fresh(n);
      samples_[k] = {.value = channels_[k]->values[n],
                     .age_s = is_fresh ? 0.0 : samples_[k].age_s + period_s_};
    }
    return samples_;
  }

 private:
  std::vector<const Channel*> channels_;
  std::vector<SignalSample> samples_;
  double period_s_;
};

/// The findings that begin in a tick, of a monitor that has just been stepped.
class Findings {
 public:
  void add(const Monitor& monitor, std::vector<MonitorEvent>& events) {
    const std::uint32_t begun = monitor.active() & ~active_;
    active_ = monitor.active();
    if (begun != 0) events.push_back(monitor.latest());
  }

 private:
  std::uint32_t active_ = 0;
};

}  // namespace

MonitorReplay replay_monitor(MonitoredTorque monitored, const Recording& recording,
                             const Progress& progress) {
  const double rate_Hz = 1.0 / monitored.monitor().settings().sample_period_s;
  if (!(std::abs(recording.sample_rate_Hz() / rate_Hz - 1.0) <= kRateTolerance))
    throw Error({.place = recording.name(),
                 .expected = fmt::format("{} Hz, the rate of the monitor", rate_Hz),
                 .found = fmt::format("{} Hz", recording.sample_rate_Hz()),
                 .advice = "resample the recording with --rate"});
  const std::size_t samples = recording.size();
  RawChannels raw(recording, monitored.raw_inputs());
  std::vector<Channel> columns{{.name = estimate_channel(kTorque), .values = {}},
                               {.name = error_bar_channel(kTorque), .values = {}}};
  for (const std::string& source : monitored.monitor().settings().sources)
    columns.push_back({.name = source + "_torque_Nm", .values = {}});
  columns.push_back({.name = "monitor_state_1", .values = {}});
  for (Channel& column : columns) column.values.reserve(samples);

  MonitorReplay replay{
      .estimated = {.channels = Recording(recording.name(), rate_Hz, recording.time_s(0)),
                    .faults = {}},
      .events = {},
      .suspects = {}};
  replay.estimated.faults.reserve(samples);
  const DenormalsOff denormals_off;
  take_zeros(monitored.sources(), recording);
  monitored.reset();
  monitored.monitor().reset(recording.time_s(0) - 1.0);
  Findings findings;
  for (std::size_t n = 0; n < samples; ++n) {
    if (n % kSamplesPerReport == 0)
      report_progress(progress, static_cast<double>(n) / static_cast<double>(samples), "replaying");
    const double t_s = recording.time_s(n);
    const FusedTorque torque = monitored.step(t_s, raw.at(n));
    Monitor& monitor = monitored.monitor();
    if (monitor.state() == Monitor::State::ready && monitor.arm(t_s)) replay.watching_from_s = t_s;
    std::size_t column = 0;
    columns[column++].values.push_back(torque.value_Nm);
    columns[column++].values.push_back(torque.std_dev_Nm);
    for (const Estimate& source : monitored.estimates())
      columns[column++].values.push_back(source.value);
    columns[column].values.push_back(static_cast<double>(monitor.state()));
    replay.estimated.faults.push_back(torque.fault);
    if (!std::isnan(replay.stopped_at_s) || std::isnan(replay.watching_from_s)) continue;
    findings.add(monitor, replay.events);
    if (monitor.state() != Monitor::State::stopped) continue;
    replay.stopped_at_s = t_s;
    if (replay.events.empty() || replay.events.back().check != monitor.reason().check)
      replay.events.push_back(monitor.reason());
    const Redundancy& redundancy = monitored.redundancy();
    // A part of all sources, such as the supply, is one of every pair and explains nothing.
    PartSet of_all = ~PartSet{0};
    for (std::size_t i = 0; i < monitored.sources().size(); ++i) of_all &= redundancy.parts_of(i);
    replay.suspects = redundancy.names(redundancy.suspects(monitor.disagreeing()) & ~of_all);
  }
  for (const std::string& name : monitored.raw_inputs())
    replay.estimated.channels.add({.name = name, .values = recording.channel(name).values});
  for (Channel& column : columns) replay.estimated.channels.add(std::move(column));
  replay.estimated.channels.add(
      {.name = "novelty_1", .values = std::vector<double>(samples, kNotMeasured)});
  return replay;
}

}  // namespace torsio

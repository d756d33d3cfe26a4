#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <functional>
#include <span>
#include <utility>

#include "core/report_progress.hpp"
#include "data/recording_rows.hpp"
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
      : rows_(recording, names),
        samples_(names.size()),
        period_s_(1.0 / recording.sample_rate_Hz()) {}

  std::span<const SignalSample> at(std::size_t n) {
    const std::span<const double> values = rows_.at(n);
    for (std::size_t k = 0; k < values.size(); ++k) {
      const bool is_fresh = rows_.channels()[k]->is_fresh(n);
      samples_[k] = {.value = values[k], .age_s = is_fresh ? 0.0 : samples_[k].age_s + period_s_};
    }
    return samples_;
  }

 private:
  RecordingRows rows_;
  std::vector<SignalSample> samples_;
  double period_s_;
};

bool is_same(const MonitorEvent& a, const MonitorEvent& b) {
  return a.check == b.check && a.first == b.first && a.second == b.second;
}

MonitorReplay::Finding with_fault(const MonitorEvent& event, std::span<const Estimate> sources) {
  const bool is_of_source =
      event.check == MonitorCheck::source_fault || event.check == MonitorCheck::source_lost;
  return {event, is_of_source ? sources[event.first].fault : Fault::none};
}

/// Without a valid source: their fault if they have one in common, as while they warm up.
Fault fault_of(const FusedTorque& torque, std::span<const Estimate> sources) {
  const Fault first = sources.front().fault;
  const auto has_it = [&](const Estimate& source) { return source.fault == first; };
  return torque.used == 0 && first != Fault::none && std::ranges::all_of(sources, has_it)
             ? first
             : torque.fault;
}

/// The findings that begin, or become a stop, in a tick, of a monitor that has just been stepped.
class Findings {
 public:
  void add(const Monitor& monitor, std::span<const Estimate> sources,
           std::vector<MonitorReplay::Finding>& events) {
    const std::span<const MonitorEvent> found = monitor.findings();
    for (const MonitorEvent& event : found) {
      const auto is_known = [&](const MonitorEvent& of) {
        return is_same(of, event) && of.action == event.action;
      };
      if (std::ranges::none_of(last_, is_known)) events.push_back(with_fault(event, sources));
    }
    last_.assign(found.begin(), found.end());
  }

 private:
  std::vector<MonitorEvent> last_;
};

/// What prevents a monitor that has just been stepped from being ready.
void add_not_ready(const Monitor& monitor, std::span<const Estimate> sources,
                   MonitorReplay& replay) {
  const double period_s = monitor.settings().sample_period_s;
  if (monitor.is_threshold_too_large()) replay.threshold_too_large_s += period_s;
  for (const MonitorEvent& event : monitor.findings()) {
    auto known = std::ranges::find_if(replay.not_ready,
                                      [&](const auto& of) { return is_same(of.event, event); });
    if (known == replay.not_ready.end())
      known = replay.not_ready.insert(known, MonitorReplay::NotReady{});
    known->event = with_fault(event, sources);
    known->present_s += period_s;
  }
}

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
  for (const std::string& source : monitored.monitor().settings().sources) {
    columns.push_back({.name = source + "_torque_Nm", .values = {}});
    columns.push_back({.name = source + "_fault_1", .values = {}});
  }
  columns.push_back({.name = "monitor_state_1", .values = {}});
  for (Channel& column : columns) column.values.reserve(samples);

  MonitorReplay replay{
      .estimated = {.channels = Recording(recording.name(), rate_Hz, recording.time_s(0)),
                    .faults = {}},
      .events = {},
      .suspects = {},
      .not_ready = {}};
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
    if (std::isnan(replay.watching_from_s)) add_not_ready(monitor, monitored.estimates(), replay);
    std::size_t column = 0;
    columns[column++].values.push_back(torque.value_Nm);
    columns[column++].values.push_back(torque.std_dev_Nm);
    for (const Estimate& source : monitored.estimates()) {
      columns[column++].values.push_back(source.fault == Fault::none ? source.value : kNotMeasured);
      columns[column++].values.push_back(static_cast<double>(source.fault));
    }
    columns[column].values.push_back(static_cast<double>(monitor.state()));
    replay.estimated.faults.push_back(fault_of(torque, monitored.estimates()));
    if (!std::isnan(replay.stopped_at_s) || std::isnan(replay.watching_from_s)) continue;
    findings.add(monitor, monitored.estimates(), replay.events);
    if (monitor.state() != Monitor::State::stopped) continue;
    replay.stopped_at_s = t_s;
    const Redundancy& redundancy = monitored.redundancy();
    // A part of all sources is one of every pair and explains nothing.
    replay.suspects =
        redundancy.names(redundancy.suspects(monitor.disagreeing()) & ~parts_of_all(redundancy));
  }
  std::ranges::stable_sort(replay.not_ready, std::ranges::greater{},
                           &MonitorReplay::NotReady::present_s);
  for (const std::string& name : monitored.raw_inputs())
    replay.estimated.channels.add({.name = name, .values = recording.channel(name).values});
  for (Channel& column : columns) replay.estimated.channels.add(std::move(column));
  replay.estimated.channels.add(
      {.name = "novelty_1", .values = std::vector<double>(samples, kNotMeasured)});
  return replay;
}

}  // namespace torsio

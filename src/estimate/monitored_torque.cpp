#include "torsio/estimate/monitored_torque.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "core/checks.hpp"

namespace torsio {
namespace {

constexpr double kHistory_s = 1.0;

constexpr std::string_view kPlace = "monitored torque";

double checked_rate(const TorqueSources& sources, const RedundancySettings& redundancy,
                    const MonitorSettings& monitor) {
  if (sources.size() != redundancy.sources.size() || sources.size() != monitor.sources.size())
    refuse(kPlace, "one model for each source of the redundancy and of the monitor",
           fmt::format("{} models, {} and {} sources", sources.size(), redundancy.sources.size(),
                       monitor.sources.size()));
  for (std::size_t i = 0; i < sources.size(); ++i)
    if (redundancy.sources[i].name != monitor.sources[i])
      refuse(kPlace, fmt::format("source {} to be '{}'", i + 1, redundancy.sources[i].name),
             fmt::format("'{}' in the monitor", monitor.sources[i]));
  const double rate_Hz = sources.sample_rate_Hz();
  if (std::abs(monitor.sample_period_s * rate_Hz - 1.0) > 1e-9)
    refuse(kPlace, fmt::format("a monitor with the period of the sources, {} s", 1.0 / rate_Hz),
           fmt::format("{} s", monitor.sample_period_s));
  return rate_Hz;
}

FeatureSpec signal_spec(const MonitorSettings& monitor) {
  FeatureSpec spec;
  for (const MonitoredSignal& signal : monitor.signals) spec.inputs.push_back(signal.name);
  return spec;
}

/// The age of a signal is that of its oldest channel; a time in the future, or none at all, is worse.
double older(double age_s, double other_s) noexcept {
  if (!(age_s >= 0.0)) return age_s;
  return other_s <= age_s && other_s >= 0.0 ? age_s : other_s;
}

}  // namespace

MonitoredTorque::MonitoredTorque(TorqueSources sources, const RedundancySettings& redundancy,
                                 const MonitorSettings& monitor)
    : sources_(std::move(sources)),
      redundancy_(redundancy),
      monitor_(monitor),
      signal_pipeline_(signal_spec(monitor), checked_rate(sources_, redundancy, monitor)),
      raw_inputs_(sources_.raw_inputs()),
      source_values_(raw_inputs_.size()),
      signal_values_(signal_pipeline_.raw_inputs().size()),
      signals_(monitor.signals.size()),
      history_(1, 1) {
  for (const std::string& name : signal_pipeline_.raw_inputs())
    if (std::ranges::find(raw_inputs_, name) == raw_inputs_.end()) raw_inputs_.push_back(name);
  signal_places_ = places_of(signal_pipeline_.raw_inputs());
  guards_.resize(raw_inputs_.size());
  for (const MonitoredSignal& signal : monitor.signals) {
    const std::vector<std::string> channels = channels_of(signal.name);
    channels_of_signal_.push_back(places_of(channels));
    if (channels.size() != 1 || channels.front() != signal.name) continue;
    ChannelGuard& guard = guards_[channels_of_signal_.back().front()];
    guard.longest_age_s = signal.longest_age_s;
    guard.largest_step = signal.largest_rate * monitor.sample_period_s;
  }
  for (std::size_t k = 0; k < guards_.size(); ++k)
    guards_[k].largest_step =
        std::min(guards_[k].largest_step, sources_.largest_step(raw_inputs_[k]));
  row_.resize(history_columns().size());
  const double rows = std::ceil(kHistory_s / monitor.sample_period_s);
  history_ = History(static_cast<std::size_t>(rows), row_.size());
  reset();
}

std::vector<std::size_t> MonitoredTorque::places_of(
    const std::vector<std::string>& channels) const {
  std::vector<std::size_t> places;
  places.reserve(channels.size());
  for (const std::string& channel : channels)
    places.push_back(
        static_cast<std::size_t>(std::ranges::find(raw_inputs_, channel) - raw_inputs_.begin()));
  return places;
}

std::vector<std::string> MonitoredTorque::history_columns() const {
  std::vector<std::string> columns{"t_s", "torque_Nm", "torque_std_dev_Nm"};
  for (const std::string& source : monitor_.settings().sources) {
    columns.push_back(source + "_torque_Nm");
    columns.push_back(source + "_std_dev_Nm");
  }
  columns.insert(columns.end(), raw_inputs_.begin(), raw_inputs_.end());
  return columns;
}

void MonitoredTorque::set_zero(std::string_view channel, double value) {
  const auto uses = [channel](const std::vector<std::string>& names) {
    return std::ranges::find(names, channel) != names.end();
  };
  // A channel that neither has is refused by the sources.
  const bool is_signal = uses(signal_pipeline_.raw_inputs());
  if (uses(sources_.raw_inputs()) || !is_signal) sources_.set_zero(channel, value);
  if (is_signal) signal_pipeline_.set_zero(channel, value);
}

void MonitoredTorque::reset() noexcept {
  sources_.reset();
  redundancy_.reset();
  signal_pipeline_.reset();
  for (ChannelGuard& guard : guards_) {
    guard.last = kNotMeasured;
    guard.change = 0.0;
    guard.held = 0;
    guard.missed = 0;
  }
}

double MonitoredTorque::guarded(ChannelGuard& guard, const SignalSample& sample) const noexcept {
  const bool is_fresh = sample.age_s >= 0.0 && sample.age_s <= guard.longest_age_s;
  if (!is_fresh || !std::isfinite(sample.value)) {
    ++guard.missed;
    return kNotMeasured;
  }
  const double periods = static_cast<double>(guard.missed) + guard.held + 1.0;
  const double change = sample.value - guard.last;
  if (std::abs(change) > guard.largest_step * periods &&
      guard.held + 1 < monitor_.settings().spikes_in_a_row) {
    ++guard.held;
    return guard.missed > 0 ? kNotMeasured : guard.last + guard.held * guard.change;
  }
  guard.change = std::isfinite(change) ? change / periods : 0.0;
  guard.held = 0;
  guard.missed = 0;
  guard.last = sample.value;
  return sample.value;
}

FusedTorque MonitoredTorque::step(double t_s, std::span<const SignalSample> raw) noexcept {
  if (raw.size() != raw_inputs_.size()) {
    (void)monitor_.step(t_s, {}, {});  // a stop: there is at least one source
    if (monitor_.state() == Monitor::State::stopped) history_.freeze();
    sources_.refuse(Fault::input_count_wrong);
    return redundancy_.step({});
  }
  bool has_replaced_input = false;
  for (std::size_t k = 0; k < source_values_.size(); ++k) {
    source_values_[k] = guarded(guards_[k], raw[k]);
    has_replaced_input |= guards_[k].held > 0 && guards_[k].missed == 0;
  }
  const std::span<const Estimate> estimates = sources_.step(source_values_);
  FusedTorque fused = redundancy_.step(estimates);
  fused.has_replaced_input = has_replaced_input;
  // The memory of an expression continues with the last number of a channel that is none now.
  for (std::size_t k = 0; k < signal_places_.size(); ++k) {
    const double value = raw[signal_places_[k]].value;
    if (std::isfinite(value)) signal_values_[k] = value;
  }
  const std::span<const double> values = signal_pipeline_.step(signal_values_);
  for (std::size_t i = 0; i < signals_.size(); ++i) {
    signals_[i] = {.value = values[i]};
    for (const std::size_t place : channels_of_signal_[i]) {
      if (!std::isfinite(raw[place].value)) signals_[i].value = kNotMeasured;
      signals_[i].age_s = older(signals_[i].age_s, raw[place].age_s);
    }
  }
  const bool was_stopped = monitor_.state() == Monitor::State::stopped;
  const Monitor::State state = monitor_.step(t_s, estimates, signals_);
  if (!was_stopped) record(t_s, fused, raw);
  if (state == Monitor::State::stopped) history_.freeze();
  return fused;
}

void MonitoredTorque::record(double t_s, const FusedTorque& fused,
                             std::span<const SignalSample> raw) noexcept {
  if (history_.is_frozen()) history_.reset();  // the monitor was reset since
  std::size_t at = 0;
  row_[at++] = t_s;
  row_[at++] = fused.value_Nm;
  row_[at++] = fused.std_dev_Nm;
  for (const Estimate& estimate : sources_.estimates()) {
    row_[at++] = estimate.value;
    row_[at++] = estimate.std_dev;
  }
  for (const SignalSample& sample : raw) row_[at++] = sample.value;
  history_.record(row_);
}

}  // namespace torsio

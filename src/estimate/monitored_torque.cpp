#include "torsio/estimate/monitored_torque.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "torsio/core/did_you_mean.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/units.hpp"

namespace torsio {
namespace {

constexpr double kHistory_s = 1.0;

double checked_rate(const std::vector<Estimator>& sources, const RedundancySettings& redundancy,
                    const MonitorSettings& monitor) {
  const auto refuse = [](std::string expected, std::string found) {
    throw Error(
        {.place = "monitored torque", .expected = std::move(expected), .found = std::move(found)});
  };
  if (sources.empty() || sources.size() != redundancy.sources.size() ||
      sources.size() != monitor.sources.size())
    refuse("one estimator for each source of the redundancy and of the monitor",
           fmt::format("{} estimators, {} and {} sources", sources.size(),
                       redundancy.sources.size(), monitor.sources.size()));
  const double rate_Hz = sources.front().settings().sample_rate_Hz;
  for (std::size_t i = 0; i < sources.size(); ++i) {
    const EstimatorSettings& settings = sources[i].settings();
    if (redundancy.sources[i].name != monitor.sources[i])
      refuse(fmt::format("source {} to be '{}'", i + 1, redundancy.sources[i].name),
             fmt::format("'{}' in the monitor", monitor.sources[i]));
    const auto target = split_channel_name(settings.target);
    if (!target || target->unit->si_suffix != "Nm")
      refuse(fmt::format("a torque in Nm as target of '{}'", monitor.sources[i]),
             fmt::format("'{}'", settings.target));
    if (settings.sample_rate_Hz != rate_Hz)
      refuse(fmt::format("a sample rate of {} Hz as of '{}'", rate_Hz, monitor.sources[0]),
             fmt::format("{} Hz of '{}'", settings.sample_rate_Hz, monitor.sources[i]));
  }
  if (std::abs(monitor.sample_period_s * rate_Hz - 1.0) > 1e-9)
    refuse(fmt::format("a monitor with the period of the sources, {} s", 1.0 / rate_Hz),
           fmt::format("{} s", monitor.sample_period_s));
  return rate_Hz;
}

FeatureSpec signal_spec(const MonitorSettings& monitor) {
  FeatureSpec spec;
  for (const MonitoredSignal& signal : monitor.signals) spec.inputs.push_back(signal.name);
  return spec;
}

}  // namespace

MonitoredTorque::MonitoredTorque(std::vector<Estimator> sources,
                                 const RedundancySettings& redundancy,
                                 const MonitorSettings& monitor)
    : sources_(std::move(sources)),
      redundancy_(redundancy),
      monitor_(monitor),
      signal_pipeline_(signal_spec(monitor), checked_rate(sources_, redundancy, monitor)),
      estimates_(sources_.size()),
      signals_(monitor.signals.size()),
      history_(1, 1) {
  for (const Estimator& source : sources_) inputs_.push_back(input_of(source.raw_inputs()));
  signal_input_ = input_of(signal_pipeline_.raw_inputs());
  longest_age_s_.assign(raw_inputs_.size(), std::numeric_limits<double>::infinity());
  for (const MonitoredSignal& signal : monitor.signals) {
    std::vector<std::size_t> places;
    for (const std::string& channel : channels_of(signal.name)) {
      const auto found = std::ranges::find(raw_inputs_, channel);
      places.push_back(static_cast<std::size_t>(found - raw_inputs_.begin()));
      if (channel == signal.name) longest_age_s_[places.back()] = signal.longest_age_s;
    }
    signal_channels_.push_back(std::move(places));
  }
  row_.resize(history_columns().size());
  const double rows = std::ceil(kHistory_s / monitor.sample_period_s);
  history_ = History(static_cast<std::size_t>(rows), row_.size());
  reset();
}

MonitoredTorque::Input MonitoredTorque::input_of(const std::vector<std::string>& names) {
  Input input;
  for (const std::string& name : names) {
    const auto found = std::ranges::find(raw_inputs_, name);
    input.channels.push_back(static_cast<std::size_t>(found - raw_inputs_.begin()));
    if (found == raw_inputs_.end()) raw_inputs_.push_back(name);
  }
  input.values.resize(names.size());
  return input;
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
  if (!uses(raw_inputs_))
    throw UsageError({.place = "set_zero",
                      .expected = fmt::format("one of {}", fmt::join(raw_inputs_, ", ")),
                      .found = fmt::format("'{}'", channel),
                      .advice = did_you_mean(channel, raw_inputs_)});
  for (Estimator& source : sources_)
    if (uses(source.raw_inputs())) source.set_zero(channel, value);
  if (uses(signal_pipeline_.raw_inputs())) signal_pipeline_.set_zero(channel, value);
}

void MonitoredTorque::reset() noexcept {
  for (Estimator& source : sources_) source.reset();
  redundancy_.reset();
  signal_pipeline_.reset();
  failed_ = 0;
  for (Estimate& estimate : estimates_) estimate = {.fault = Fault::warming_up};
}

void MonitoredTorque::fail_model(std::size_t source) noexcept {
  if (source < sources_.size()) failed_ |= SourceSet{1} << source;
}

FusedTorque MonitoredTorque::step(double t_s, std::span<const SignalSample> raw) noexcept {
  if (raw.size() != raw_inputs_.size()) {
    (void)monitor_.step(t_s, {}, {});  // a stop: there is at least one source
    if (monitor_.state() == Monitor::State::stopped) history_.freeze();
    for (Estimate& estimate : estimates_) estimate.fault = Fault::input_count_wrong;
    return redundancy_.step({});
  }
  for (std::size_t i = 0; i < sources_.size(); ++i) {
    Input& input = inputs_[i];
    for (std::size_t k = 0; k < input.channels.size(); ++k) {
      const SignalSample& sample = raw[input.channels[k]];
      const bool is_fresh =
          sample.age_s >= 0.0 && sample.age_s <= longest_age_s_[input.channels[k]];
      input.values[k] = is_fresh ? sample.value : kNotMeasured;
    }
    estimates_[i] = sources_[i].step(input.values);
    if ((failed_ >> i & 1U) != 0) estimates_[i].fault = Fault::model_not_finite;
  }
  const FusedTorque fused = redundancy_.step(estimates_);
  // The memory of an expression continues with the last number of a channel that is none now.
  for (std::size_t k = 0; k < signal_input_.channels.size(); ++k) {
    const double value = raw[signal_input_.channels[k]].value;
    if (std::isfinite(value)) signal_input_.values[k] = value;
  }
  const std::span<const double> values = signal_pipeline_.step(signal_input_.values);
  for (std::size_t i = 0; i < signals_.size(); ++i) {
    signals_[i] = {.value = values[i]};
    for (const std::size_t place : signal_channels_[i]) {
      if (!std::isfinite(raw[place].value)) signals_[i].value = kNotMeasured;
      const double age_s = raw[place].age_s;
      // The oldest one; a time in the future, or none at all, is worse.
      double& worst_s = signals_[i].age_s;
      if (worst_s >= 0.0 && !(age_s >= 0.0 && age_s <= worst_s)) worst_s = age_s;
    }
  }
  const bool was_stopped = monitor_.state() == Monitor::State::stopped;
  const Monitor::State state = monitor_.step(t_s, estimates_, signals_);
  if (!was_stopped) {
    if (history_.is_frozen()) history_.reset();  // the monitor was reset since
    std::size_t at = 0;
    row_[at++] = t_s;
    row_[at++] = fused.value_Nm;
    row_[at++] = fused.std_dev_Nm;
    for (const Estimate& estimate : estimates_) {
      row_[at++] = estimate.value;
      row_[at++] = estimate.std_dev;
    }
    for (const SignalSample& sample : raw) row_[at++] = sample.value;
    history_.record(row_);
    if (state == Monitor::State::stopped) history_.freeze();
  }
  return fused;
}

}  // namespace torsio

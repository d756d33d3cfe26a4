#include "evaluate/monitor/signal_statistics.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "data/recording_rows.hpp"
#include "evaluate/monitor/pair_calibration.hpp"
#include "torsio/core/error.hpp"

namespace torsio {
namespace {

constexpr double kRangeMargin = 0.4;  // margin on either side, over the range in the recordings
constexpr double kRateMargin = 1.5;   // over the largest value in the recordings
constexpr double kHiddenTravelMargin = 5.0;

}  // namespace

SignalStatistics::SignalStatistics(const std::vector<MonitoredSignal>& signals, double rate_Hz)
    : signals_(signals),
      states_(signals.size(), State(samples_of(kCalibrationBlock_s, rate_Hz))),
      rate_Hz_(rate_Hz) {
  for (const MonitoredSignal& signal : signals) {
    spec_.inputs.push_back(signal.name);
    const auto companion = std::ranges::find(signals, signal.moves_with, &MonitoredSignal::name);
    companions_.push_back(static_cast<std::size_t>(companion - signals.begin()));
  }
}

void SignalStatistics::add(const Recording& recording) {
  FeaturePipeline pipeline(spec_, rate_Hz_);
  RecordingRows rows(recording, pipeline.raw_inputs());
  const std::span<const Channel* const> channels = rows.channels();
  std::vector<std::size_t> ages(channels.size(), 0);
  for (State& state : states_) state.is_started = false;
  for (std::size_t n = 0; n < recording.size(); ++n) {
    for (std::size_t k = 0; k < channels.size(); ++k) {
      ages[k] = channels[k]->is_fresh(n) ? 0 : ages[k] + 1;
      longest_gap_ = std::max(longest_gap_, ages[k]);
    }
    const std::span<const double> values = pipeline.step(rows.at(n));
    for (std::size_t i = 0; i < values.size(); ++i) add(states_[i], values, i);
  }
}

std::vector<MonitoredSignal> SignalStatistics::limits(double share) const {
  std::vector<MonitoredSignal> limits = signals_;
  for (std::size_t i = 0; i < limits.size(); ++i) {
    const State& state = states_[i];
    MonitoredSignal& signal = limits[i];
    const double margin = kRangeMargin * (state.highest_value - state.lowest_value);
    if (std::isinf(signal.lowest))
      signal.lowest = std::min(state.lowest_value - margin, -state.lowest.exceeded_in(share));
    if (std::isinf(signal.highest))
      signal.highest = std::max(state.highest_value + margin, state.highest.exceeded_in(share));
    if (!(signal.lowest < signal.highest))
      throw Error({.place = "monitor: " + signal.name,
                   .problem = "the signal is constant in the fault-free recordings",
                   .advice = "record it while the joint moves, or give its range"});
    if (std::isinf(signal.largest_rate))
      signal.largest_rate =
          rate_Hz_ * std::max(kRateMargin * state.largest_step, state.steps.exceeded_in(share));
    if (std::isinf(signal.longest_age_s))
      signal.longest_age_s = 1.5 * static_cast<double>(longest_gap_ + 1) / rate_Hz_;
    if (!signal.moves_with.empty() && std::isinf(signal.largest_hidden_travel))
      signal.largest_hidden_travel =
          std::max(kHiddenTravelMargin * std::max(state.hidden_travel, state.companion_step),
                   state.hidden.exceeded_in(share));
    if (!(signal.largest_hidden_travel > 0.0))
      throw Error({.place = "monitor: " + signal.name,
                   .problem = fmt::format("{}, with which it is to move, is constant in the "
                                          "fault-free recordings",
                                          signal.moves_with),
                   .advice = "record it while the joint moves"});
  }
  return limits;
}

void SignalStatistics::add(State& state, std::span<const double> values, std::size_t i) const {
  const double value = values[i];
  if (!std::isfinite(value)) {
    // The blocks go by the clock.
    for (BlockMaxima* maxima : {&state.lowest, &state.highest, &state.steps, &state.hidden})
      maxima->add(kNotMeasured);
    return;
  }
  const bool has_companion = companions_[i] < values.size();
  const double companion = has_companion ? values[companions_[i]] : 0.0;
  state.lowest_value = std::min(state.lowest_value, value);
  state.highest_value = std::max(state.highest_value, value);
  state.lowest.add(-value);
  state.highest.add(value);
  if (state.is_started) {
    const double step = std::abs(value - state.last);
    state.largest_step = std::max(state.largest_step, step);
    state.steps.add(step);
    state.companion_step =
        std::max(state.companion_step, std::abs(companion - state.last_companion));
  }
  if (!state.is_started || value != state.last) state.companion = companion;
  const double hidden_travel = std::abs(companion - state.companion);
  state.hidden_travel = std::max(state.hidden_travel, hidden_travel);
  state.hidden.add(hidden_travel);
  state.last = value;
  state.last_companion = companion;
  state.is_started = true;
}

}  // namespace torsio

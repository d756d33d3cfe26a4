#include "torsio/safety/monitor.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "error_correlation.hpp"
#include "torsio/core/error.hpp"
#include "valid_source.hpp"

namespace torsio {
namespace {

// Written so that NaN is not allowed, here and below: no comparison with it is true.
bool is_positive(double value) noexcept { return value > 0.0; }

[[noreturn]] void refuse(std::string place, std::string expected, std::string found) {
  throw Error({.place = "monitor: " + std::move(place),
               .expected = std::move(expected),
               .found = std::move(found)});
}

void require(bool holds, std::string_view place, std::string_view expected, double found) {
  if (!holds) refuse(std::string(place), std::string(expected), fmt::format("{}", found));
}

void check_names(const MonitorSettings& settings) {
  const auto check_each = [](const auto& list, std::size_t most, std::string_view what,
                             const auto& name_of) {
    if (list.size() > most)
      refuse(std::string(what), fmt::format("at most {}", most), fmt::format("{}", list.size()));
    for (std::size_t i = 0; i < list.size(); ++i)
      for (std::size_t j = 0; j <= i; ++j)
        if (name_of(list[i]).empty() || (i != j && name_of(list[i]) == name_of(list[j])))
          refuse(std::string(what), "names of their own", fmt::format("'{}'", name_of(list[i])));
  };
  check_each(settings.sources, Monitor::kMaxSources, "sources",
             [](const std::string& name) -> const std::string& { return name; });
  check_each(settings.signals, Monitor::kMaxSignals, "signals",
             [](const MonitoredSignal& signal) -> const std::string& { return signal.name; });
}

void check(const MonitoredSignal& signal) {
  require(signal.lowest < signal.highest, signal.name, "a lowest value below the highest",
          signal.lowest);
  require(is_positive(signal.largest_rate), signal.name + ": largest_rate", "above 0",
          signal.largest_rate);
  require(is_positive(signal.longest_age_s), signal.name + ": longest_age_s", "above 0",
          signal.longest_age_s);
  require(signal.turn >= 0.0 && std::isfinite(signal.turn), signal.name + ": turn",
          "0 or the turn of its encoder", signal.turn);
  require(is_positive(signal.largest_hidden_travel), signal.name + ": largest_hidden_travel",
          "above 0", signal.largest_hidden_travel);
}

void check(const PairLimits& pair, std::size_t sources) {
  const std::string place = fmt::format("pair {}, {}", pair.first, pair.second);
  if (pair.first >= sources || pair.second >= sources || pair.first == pair.second)
    refuse(place, fmt::format("two different sources of {}", sources), place);
  require(is_positive(pair.factor) && std::isfinite(pair.factor), place + ": factor",
          "a positive number", pair.factor);
  require(is_positive(pair.ceiling_Nm), place + ": ceiling_Nm", "above 0", pair.ceiling_Nm);
  require(pair.floor_Nm >= 0.0 && pair.floor_Nm <= pair.ceiling_Nm, place + ": floor_Nm",
          "0 to the ceiling", pair.floor_Nm);
  require(pair.drift_allowance > 0.0 && pair.drift_allowance < 1.0, place + ": drift_allowance",
          "between 0 and 1", pair.drift_allowance);
  require(is_positive(pair.drift_limit_s), place + ": drift_limit_s", "above 0",
          pair.drift_limit_s);
}

void check_times(const MonitorSettings& settings) {
  require(is_positive(settings.sample_period_s) && settings.sample_period_s <= 1.0,
          "sample_period_s", "above 0, at most 1", settings.sample_period_s);
  require(settings.persistence_s >= 0.0 && std::isfinite(settings.persistence_s), "persistence_s",
          "0 or more", settings.persistence_s);
  require(settings.release_share > 0.0 && settings.release_share <= 1.0, "release_share",
          "above 0, at most 1", settings.release_share);
  require(settings.longest_loss_s >= 0.0, "longest_loss_s", "0 or more", settings.longest_loss_s);
  require(settings.longest_fault_s >= 0.0, "longest_fault_s", "0 or more",
          settings.longest_fault_s);
  require(is_positive(settings.largest_novelty), "largest_novelty", "above 0",
          settings.largest_novelty);
  require(settings.proof_s >= 0.0 && std::isfinite(settings.proof_s), "proof_s", "0 or more",
          settings.proof_s);
  require(settings.spike_memory_s >= 0.0, "spike_memory_s", "0 or more", settings.spike_memory_s);
  require(settings.longest_overrun > 0, "longest_overrun", "1 or more", 0.0);
  require(settings.spikes_in_a_row > 0, "spikes_in_a_row", "1 or more", 0.0);
}

/// An input of the source was not measured.
bool is_lost(Fault fault) noexcept {
  return fault == Fault::input_not_finite || fault == Fault::input_count_wrong ||
         fault == Fault::zero_not_set;
}

/// A change is a wrap of the encoder if it is a turn or several of them up to a tenth of a turn.
bool is_wrap(double change, double turn) noexcept {
  if (!(turn > 0.0)) return false;
  const double turns = std::round(change / turn);
  return turns != 0.0 && std::abs(change - turns * turn) < 0.1 * turn;
}

constexpr double kLatePeriods = 1.5;

/// Whether so many samples in a row are longer than a time; rounding does not make them longer.
bool lasts_longer(std::uint32_t samples, double period_s, double longest_s) noexcept {
  return samples * period_s > longest_s * (1.0 + 1e-9);
}

}  // namespace

std::array<MonitorAction, kMonitorChecks> MonitorSettings::default_actions() noexcept {
  std::array<MonitorAction, kMonitorChecks> actions{};
  actions.fill(MonitorAction::stop);
  actions[static_cast<std::size_t>(MonitorCheck::source_lost)] = MonitorAction::warn;
  actions[static_cast<std::size_t>(MonitorCheck::novelty)] = MonitorAction::warn;
  return actions;
}

Monitor::Monitor(MonitorSettings settings) : settings_(std::move(settings)) {
  check_names(settings_);
  check_times(settings_);
  for (const MonitoredSignal& signal : settings_.signals) check(signal);
  if (settings_.pairs.size() > kMaxPairs)
    refuse("pairs", fmt::format("at most {}", kMaxPairs),
           fmt::format("{}", settings_.pairs.size()));
  for (const PairLimits& pair : settings_.pairs) check(pair, settings_.sources.size());
  correlation_ =
      detail::error_correlation(settings_.correlation, settings_.sources.size(), "monitor");
  for (std::size_t i = 0; i < settings_.signals.size(); ++i) {
    const MonitoredSignal& signal = settings_.signals[i];
    companion_[i] = static_cast<std::uint8_t>(i);
    if (signal.moves_with.empty()) continue;
    const auto found =
        std::ranges::find(settings_.signals, signal.moves_with, &MonitoredSignal::name);
    if (found == settings_.signals.end() || found->name == signal.name)
      refuse(signal.name + ": moves_with", "another signal",
             fmt::format("'{}'", signal.moves_with));
    companion_[i] = static_cast<std::uint8_t>(found - settings_.signals.begin());
  }
}

void Monitor::clear() noexcept {
  signal_states_ = {};
  source_states_ = {};
  pair_states_ = {};
  disagreeing_count_ = 0;
  active_ = 0;
  late_ = 0;
  silent_since_s_ = kNotMeasured;
}

bool Monitor::arm(double command_written_s) noexcept {
  if (state_ == State::ready && std::isfinite(command_written_s) && command_written_s > reset_t_s_)
    state_ = State::watching;
  return is_watching();
}

void Monitor::reset(double t_s) noexcept {
  clear();
  last_t_s_ = kNotMeasured;
  // A reset at an unknown time: no command is newer.
  reset_t_s_ = std::isfinite(t_s) ? t_s : std::numeric_limits<double>::infinity();
  state_ = State::unproven;
}

void Monitor::stop(double t_s) noexcept {
  if (state_ == State::stopped) return;
  state_ = State::stopped;
  reason_ = {.t_s = t_s};
}

void Monitor::find(const MonitorEvent& found) noexcept {
  MonitorEvent event = found;
  const auto check = static_cast<std::size_t>(event.check);
  if (event.action == MonitorAction::off) event.action = settings_.actions[check];
  if (event.action == MonitorAction::off) return;
  event.t_s = t_s_;
  const std::uint32_t bit = std::uint32_t{1} << check;
  active_ |= bit;
  latest_ = event;
  if (event.action == MonitorAction::stop && stop_found_.action == MonitorAction::off)
    stop_found_ = event;
}

void Monitor::check_period(double t_s) noexcept {
  const double period_s = t_s - last_t_s_;
  const bool is_first = std::isnan(last_t_s_);
  last_t_s_ = t_s;
  if (is_first && std::isfinite(t_s)) return;
  const double late_s = kLatePeriods * settings_.sample_period_s;
  const double longest_s = late_s + (settings_.longest_overrun - 1) * settings_.sample_period_s;
  const bool advances = period_s > 0.0;
  late_ = advances && period_s <= late_s ? 0 : late_ + 1;
  if (advances && period_s <= longest_s && late_ < settings_.longest_overrun) return;
  find({.check = MonitorCheck::period,
        .value = period_s,
        .limit = period_s <= longest_s ? late_s : longest_s});
}

void Monitor::check_change(std::size_t i, const SignalSample& sample) noexcept {
  const MonitoredSignal& signal = settings_.signals[i];
  SignalState& state = signal_states_[i];
  const auto index = static_cast<std::uint8_t>(i);
  const double change = sample.value - state.last;
  // A sample that was passed over counts for the time since the last good one.
  const double elapsed_s = std::max(t_s_ - state.last_t_s, settings_.sample_period_s);
  const bool wraps = state.has_last && is_wrap(change, signal.turn);
  const bool is_inside = sample.value >= signal.lowest && sample.value <= signal.highest;
  const bool is_slow = !state.has_last || std::abs(change) <= signal.largest_rate * elapsed_s;
  if (is_inside && is_slow && !wraps) {
    if (lasts_longer(++state.within, settings_.sample_period_s, settings_.spike_memory_s))
      state.beyond = 0;
    if (sample.value != state.last) state.companion = kNotMeasured;
    state.last = sample.value;
    state.last_t_s = t_s_;
    state.has_last = true;
    return;
  }
  state.within = 0;
  if (++state.beyond < settings_.spikes_in_a_row) return;
  if (wraps) {
    find({.check = MonitorCheck::wrap,
          .first = index,
          .second = index,
          .value = change,
          .limit = signal.turn});
  } else if (!is_inside) {
    find({.check = MonitorCheck::range,
          .first = index,
          .second = index,
          .value = sample.value,
          .limit = sample.value > signal.highest ? signal.highest : signal.lowest});
  } else {
    find({.check = MonitorCheck::rate,
          .first = index,
          .second = index,
          .value = change / elapsed_s,
          .limit = signal.largest_rate});
  }
}

void Monitor::check_frozen(std::size_t i) noexcept {
  const std::size_t companion = companion_[i];
  SignalState& state = signal_states_[i];
  // A spike of either signal is not a motion: only samples that were not passed over count.
  if (companion == i || !signal_states_[companion].has_last) return;
  const double other = signal_states_[companion].last;
  if (std::isnan(state.companion)) state.companion = other;
  const double travel = std::abs(other - state.companion);
  if (travel <= settings_.signals[i].largest_hidden_travel) return;
  find({.check = MonitorCheck::frozen,
        .first = static_cast<std::uint8_t>(i),
        .second = static_cast<std::uint8_t>(companion),
        .value = travel,
        .limit = settings_.signals[i].largest_hidden_travel});
}

void Monitor::check_signal(std::size_t i, std::span<const SignalSample> signals) noexcept {
  const SignalSample& sample = signals[i];
  const auto index = static_cast<std::uint8_t>(i);
  const double longest_age_s = settings_.signals[i].longest_age_s;
  if (!(sample.age_s >= 0.0 && sample.age_s <= longest_age_s))
    find({.check = MonitorCheck::stale,
          .first = index,
          .second = index,
          .value = sample.age_s,
          .limit = longest_age_s});
  if (!std::isfinite(sample.value))
    return find({.check = MonitorCheck::not_finite,
                 .first = index,
                 .second = index,
                 .value = sample.value});
  check_change(i, sample);
  check_frozen(i);
}

void Monitor::check_source(std::size_t i, const Estimate& estimate) noexcept {
  SourceState& state = source_states_[i];
  const auto index = static_cast<std::uint8_t>(i);
  const double period_s = settings_.sample_period_s;
  const bool lost = is_lost(estimate.fault) || !std::isfinite(estimate.value);
  // A source that warms up is not used yet, which is no fault: a friction state settles with the motion.
  const bool is_warming_up = estimate.fault == Fault::warming_up;
  const bool faulty = !lost && !is_warming_up && !detail::is_valid(estimate);
  const bool is_novel = estimate.novelty > settings_.largest_novelty;
  state.lost = lost ? state.lost + 1 : 0;
  state.faulty = faulty ? state.faulty + 1 : 0;
  state.novel = is_novel ? state.novel + 1 : 0;
  constexpr auto kLost = static_cast<std::size_t>(MonitorCheck::source_lost);
  const bool too_long = settings_.actions[kLost] != MonitorAction::off &&
                        lasts_longer(state.lost, period_s, settings_.longest_loss_s);
  if (lost)
    find({.check = MonitorCheck::source_lost,
          .action = too_long ? MonitorAction::stop : MonitorAction::off,
          .first = index,
          .second = index,
          .value = state.lost * period_s,
          .limit = settings_.longest_loss_s});
  if (lasts_longer(state.faulty, period_s, settings_.longest_fault_s))
    find({.check = MonitorCheck::source_fault,
          .first = index,
          .second = index,
          .value = state.faulty * period_s,
          .limit = settings_.longest_fault_s});
  if (lasts_longer(state.novel, period_s, settings_.persistence_s))
    find({.check = MonitorCheck::novelty,
          .first = index,
          .second = index,
          .value = estimate.novelty,
          .limit = settings_.largest_novelty});
}

double Monitor::threshold(const PairLimits& pair, double first_Nm,
                          double second_Nm) const noexcept {
  const double variance = first_Nm * first_Nm + second_Nm * second_Nm -
                          2.0 * correlation_[pair.first][pair.second] * first_Nm * second_Nm;
  // A square that overflows is not a number; in this order it gives the floor, the narrowest one.
  return std::min(std::max(pair.floor_Nm, pair.factor * std::sqrt(variance)), pair.ceiling_Nm);
}

void Monitor::check_pair(std::size_t i, std::span<const Estimate> sources) noexcept {
  const PairLimits& pair = settings_.pairs[i];
  PairState& state = pair_states_[i];
  const Estimate& first = sources[pair.first];
  const Estimate& second = sources[pair.second];
  // What was counted is kept: a source that is lost now and then would otherwise never disagree.
  if (!detail::is_valid(first) || !detail::is_valid(second)) return;
  const double period_s = settings_.sample_period_s;
  const double limit_Nm = threshold(pair, first.std_dev, second.std_dev);
  const double difference_Nm = first.value - second.value;
  const double release_Nm = state.disagrees ? settings_.release_share * limit_Nm : limit_Nm;
  state.beyond = std::abs(difference_Nm) <= release_Nm ? 0 : state.beyond + 1;
  state.disagrees = lasts_longer(state.beyond, period_s, settings_.persistence_s);
  const bool is_opposite = std::signbit(first.value) != std::signbit(second.value) &&
                           std::min(std::abs(first.value), std::abs(second.value)) > 0.5 * limit_Nm;
  state.opposite = is_opposite ? state.opposite + 1 : 0;
  const auto found = [&](MonitorCheck check, double value, double limit) {
    find({.check = check,
          .first = pair.first,
          .second = pair.second,
          .value = value,
          .limit = limit});
  };
  // Before the disagreement that it is as well: the reason of a stop is the first finding.
  if (lasts_longer(state.opposite, period_s, settings_.persistence_s))
    found(MonitorCheck::sign, difference_Nm, limit_Nm);
  if (state.disagrees) {
    disagreeing_[disagreeing_count_++] = {pair.first, pair.second};
    found(MonitorCheck::disagreement, difference_Nm, limit_Nm);
  }
  const double share = difference_Nm / limit_Nm;
  // Limited, so that a difference that has ended is not reported for long; 0 / 0 counts as 0.
  const auto summed = [&](double sum_s, double excess) {
    const double next_s = sum_s + (excess - pair.drift_allowance) * period_s;
    return std::min(std::max(0.0, next_s), 2.0 * pair.drift_limit_s);
  };
  state.drift_up_s = summed(state.drift_up_s, share);
  state.drift_down_s = summed(state.drift_down_s, -share);
  const double drift_s = std::max(state.drift_up_s, state.drift_down_s);
  if (!(drift_s <= pair.drift_limit_s)) found(MonitorCheck::drift, drift_s, pair.drift_limit_s);
}

void Monitor::decide(double t_s) noexcept {
  if (state_ == State::stopped) return;
  const bool stops = stop_found_.action == MonitorAction::stop;
  if (state_ == State::watching) {
    if (!stops) return;
    state_ = State::stopped;
    reason_ = stop_found_;
    return;
  }
  // Before it is armed every finding begins the proof again, warnings included.
  if (active_ != 0) {
    silent_since_s_ = kNotMeasured;
    state_ = State::unproven;
    return;
  }
  if (std::isnan(silent_since_s_)) silent_since_s_ = t_s;
  if (t_s - silent_since_s_ >= settings_.proof_s) state_ = State::ready;
}

Monitor::State Monitor::step(double t_s, std::span<const Estimate> sources,
                             std::span<const SignalSample> signals) noexcept {
  t_s_ = t_s;
  active_ = 0;
  disagreeing_count_ = 0;
  stop_found_ = {};
  check_period(t_s);
  if (sources.size() != settings_.sources.size() || signals.size() != settings_.signals.size()) {
    find({.check = MonitorCheck::not_finite,
          .action = MonitorAction::stop,  // even if the check is off: nothing has been checked
          .value = static_cast<double>(sources.size() + signals.size()),
          .limit = static_cast<double>(settings_.sources.size() + settings_.signals.size())});
    decide(t_s);
    return state_;
  }
  for (std::size_t i = 0; i < signals.size(); ++i) check_signal(i, signals);
  std::size_t valid = 0;
  for (std::size_t i = 0; i < sources.size(); ++i) {
    check_source(i, sources[i]);
    if (detail::is_valid(sources[i])) ++valid;
  }
  if (sources.size() > 1 && valid < 2)
    find({.check = MonitorCheck::redundancy_lost,
          .value = static_cast<double>(valid),
          .limit = 2.0});
  for (std::size_t i = 0; i < settings_.pairs.size(); ++i) check_pair(i, sources);
  decide(t_s);
  return state_;
}

std::string_view name(MonitorCheck check) noexcept {
  switch (check) {
    case MonitorCheck::disagreement: return "disagreement";
    case MonitorCheck::drift: return "drift";
    case MonitorCheck::sign: return "sign";
    case MonitorCheck::source_lost: return "source_lost";
    case MonitorCheck::source_fault: return "source_fault";
    case MonitorCheck::redundancy_lost: return "redundancy_lost";
    case MonitorCheck::novelty: return "novelty";
    case MonitorCheck::not_finite: return "not_finite";
    case MonitorCheck::stale: return "stale";
    case MonitorCheck::range: return "range";
    case MonitorCheck::rate: return "rate";
    case MonitorCheck::wrap: return "wrap";
    case MonitorCheck::frozen: return "frozen";
    case MonitorCheck::period: return "period";
  }
  return "unknown";
}

std::string_view name(MonitorAction action) noexcept {
  switch (action) {
    case MonitorAction::off: return "off";
    case MonitorAction::warn: return "warn";
    case MonitorAction::stop: return "stop";
  }
  return "unknown";
}

std::string_view name(Monitor::State state) noexcept {
  switch (state) {
    case Monitor::State::unproven: return "unproven";
    case Monitor::State::ready: return "ready";
    case Monitor::State::watching: return "watching";
    case Monitor::State::stopped: return "stopped";
  }
  return "unknown";
}

}  // namespace torsio

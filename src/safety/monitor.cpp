#include "torsio/safety/monitor.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "error_correlation.hpp"
#include "monitor_settings.hpp"
#include "pair_difference.hpp"
#include "valid_source.hpp"

namespace torsio {
namespace {

/// An input of the source was not measured.
bool is_lost(const Estimate& source) noexcept {
  return source.fault == Fault::input_not_finite || source.fault == Fault::input_count_wrong ||
         source.fault == Fault::zero_not_set || !std::isfinite(source.value);
}

/// A change is a wrap of the encoder if it is a turn or several of them up to a tenth of a turn.
bool is_wrap(double change, double turn) noexcept {
  if (!(turn > 0.0)) return false;
  const double turns = std::round(change / turn);
  return turns != 0.0 && std::abs(change - turns * turn) < 0.1 * turn;
}

constexpr double kLatePeriods = 1.5;
constexpr std::uint32_t kQuarters = 4;  // parts of a sample

/// Whether so many samples in a row are longer than a time; rounding does not make them longer.
bool lasts_longer(std::uint32_t samples, double period_s, double longest_s) noexcept {
  return samples * period_s > longest_s * (1.0 + 1e-9);
}

}  // namespace

Monitor::Monitor(MonitorSettings settings) : settings_(std::move(settings)) {
  detail::check(settings_);
  companion_ = detail::companions(settings_.signals);
  correlation_ =
      detail::error_correlation(settings_.correlation, settings_.sources.size(), "monitor");
  const std::size_t samples =
      detail::kPersistenceWindow *
      detail::persistent_samples(settings_.persistence_s, settings_.sample_period_s);
  for (std::size_t i = 0; i < settings_.pairs.size(); ++i)
    pair_states_[i].beyond = pair_states_[i].opposite = detail::RecentCount(samples);
}

void Monitor::clear() noexcept {
  signal_states_ = {};
  source_states_ = {};
  for (PairState& state : pair_states_) {
    state.beyond.reset();
    state.opposite.reset();
    state.drift = {};
    state.disagrees = false;
  }
  disagreeing_count_ = 0;
  findings_count_ = 0;
  is_threshold_too_large_ = false;
  is_warming_up_ = false;
  active_ = 0;
  late_ = 0;
  silent_since_s_ = kNotMeasured;
}

bool Monitor::arm(double command_written_s) noexcept {
  // Written so that NaN is refused. A loop may arm before its next tick.
  const bool is_fresh = command_written_s > reset_t_s_ &&
                        t_s_ - command_written_s <= settings_.longest_command_age_s &&
                        command_written_s - t_s_ <= settings_.sample_period_s * (1.0 + 1e-6);
  if (state_ == State::ready && is_fresh) state_ = State::watching;
  return is_watching();
}

void Monitor::reset(double t_s) noexcept {
  clear();
  if (!std::isnan(last_t_s_)) before_reset_s_ = last_t_s_;
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
  if (findings_count_ < kMaxFindings) findings_[findings_count_++] = event;
  if (event.action == MonitorAction::stop && stop_found_.action == MonitorAction::off)
    stop_found_ = event;
}

void Monitor::check_period(double t_s) noexcept {
  const double period_s = t_s - last_t_s_;
  const bool is_first = std::isnan(last_t_s_);
  last_t_s_ = t_s;
  if (is_first && std::isfinite(t_s)) {
    const bool is_of_this_clock = reset_t_s_ >= before_reset_s_ && reset_t_s_ <= t_s;
    if (!is_of_this_clock && std::isfinite(reset_t_s_)) reset_t_s_ = t_s;
    return;
  }
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
    // Reported once: a wrap that only warns, or before the joint is armed, would otherwise not end.
    for (std::size_t k = 0; k < settings_.signals.size(); ++k)
      if (k == i || companion_[k] == i) signal_states_[k].companion = kNotMeasured;
    state.last = sample.value;
    state.last_t_s = t_s_;
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

bool Monitor::count(std::uint32_t& quarters, bool is_present, double longest_s) const noexcept {
  const auto is_too_long = [&] {
    return lasts_longer(quarters / kQuarters, settings_.sample_period_s, longest_s);
  };
  if (!is_present)
    quarters -= std::min(quarters, 1U);
  else if (!is_too_long())  // so that a long one is compensated as soon as a shorter one
    quarters += kQuarters;
  return is_present && is_too_long();
}

void Monitor::check_source(std::size_t i, const Estimate& estimate) noexcept {
  SourceState& state = source_states_[i];
  const auto found = [&](MonitorCheck check, MonitorAction action, std::uint32_t quarters,
                         double limit_s) {
    const auto index = static_cast<std::uint8_t>(i);
    find({.check = check,
          .action = action,
          .first = index,
          .second = index,
          .value = static_cast<double>(quarters) / kQuarters * settings_.sample_period_s,
          .limit = limit_s});
  };
  const bool lost = is_lost(estimate);
  // A source that warms up is not used, but has not failed: it ends by itself.
  const bool is_warming_up = estimate.fault == Fault::warming_up;
  const bool faulty = !lost && !is_warming_up && !detail::is_valid(estimate);
  const bool is_lost_for_long = count(state.lost, lost, settings_.longest_loss_s);
  constexpr auto kLost = static_cast<std::size_t>(MonitorCheck::source_lost);
  if (lost)
    found(MonitorCheck::source_lost,
          is_lost_for_long && settings_.actions[kLost] != MonitorAction::off ? MonitorAction::stop
                                                                             : MonitorAction::off,
          state.lost, settings_.longest_loss_s);
  if (count(state.faulty, faulty, settings_.longest_fault_s))
    found(MonitorCheck::source_fault, MonitorAction::off, state.faulty, settings_.longest_fault_s);
  if (count(state.warming_up, is_warming_up && !lost, settings_.longest_warm_up_s))
    found(MonitorCheck::source_fault, MonitorAction::off, state.warming_up,
          settings_.longest_warm_up_s);
  check_novelty(i, estimate);
}

void Monitor::check_novelty(std::size_t i, const Estimate& estimate) noexcept {
  SourceState& state = source_states_[i];
  const bool is_novel = estimate.novelty > settings_.largest_novelty;
  state.novel = is_novel ? state.novel + 1 : 0;
  if (!lasts_longer(state.novel, settings_.sample_period_s, settings_.persistence_s)) return;
  const auto index = static_cast<std::uint8_t>(i);
  find({.check = MonitorCheck::novelty,
        .first = index,
        .second = index,
        .value = estimate.novelty,
        .limit = settings_.largest_novelty});
}

void Monitor::check_pair(std::size_t i, std::span<const Estimate> sources) noexcept {
  const PairLimits& pair = settings_.pairs[i];
  PairState& state = pair_states_[i];
  const Estimate& first = sources[pair.first];
  const Estimate& second = sources[pair.second];
  // What was counted is kept: a source that is lost now and then would otherwise never disagree.
  if (!detail::is_valid(first) || !detail::is_valid(second)) return;
  const double period_s = settings_.sample_period_s;
  const double wanted_Nm = detail::threshold_without_ceiling(
      pair, detail::difference_std_dev(first.std_dev, second.std_dev,
                                       correlation_[pair.first][pair.second]));
  const double limit_Nm = std::min(wanted_Nm, pair.ceiling_Nm);
  if (!(wanted_Nm <= pair.largest_armed_Nm)) is_threshold_too_large_ = true;
  const double difference_Nm = first.value - second.value;
  const double release_Nm = state.disagrees ? settings_.release_share * limit_Nm : limit_Nm;
  const std::size_t enough = detail::persistent_samples(settings_.persistence_s, period_s);
  const bool is_beyond = !(std::abs(difference_Nm) <= release_Nm);
  state.disagrees = state.beyond.add(is_beyond) >= enough && is_beyond;
  const bool is_opposite = std::signbit(first.value) != std::signbit(second.value) &&
                           std::min(std::abs(first.value), std::abs(second.value)) > 0.5 * limit_Nm;
  const bool has_wrong_sign = state.opposite.add(is_opposite) >= enough && is_opposite;
  const auto found = [&](MonitorCheck check, double value, double limit) {
    find({.check = check,
          .first = pair.first,
          .second = pair.second,
          .value = value,
          .limit = limit});
  };
  // Before the disagreement that it is as well: the reason of a stop is the first finding.
  if (has_wrong_sign) found(MonitorCheck::sign, difference_Nm, limit_Nm);
  if (state.disagrees) {
    disagreeing_[disagreeing_count_++] = {pair.first, pair.second};
    found(MonitorCheck::disagreement, difference_Nm, limit_Nm);
  }
  detail::add_to_drift(state.drift, difference_Nm / limit_Nm, pair, period_s);
  const double drift_s = std::max(state.drift.up_s, state.drift.down_s);
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
  // Before it is armed every finding begins the proof again, warnings included. A source that warms up has
  // not been compared with any other.
  if (active_ != 0 || is_threshold_too_large_ || is_warming_up_) {
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
  findings_count_ = 0;
  is_threshold_too_large_ = false;
  is_warming_up_ = false;
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
  std::size_t left = 0;
  for (std::size_t i = 0; i < sources.size(); ++i) {
    check_source(i, sources[i]);
    const bool is_warming_up = sources[i].fault == Fault::warming_up;
    is_warming_up_ = is_warming_up_ || is_warming_up;
    if (!is_lost(sources[i]) && !is_warming_up) ++left;
  }
  if (sources.size() > 1 && left < 2)
    find(
        {.check = MonitorCheck::redundancy_lost, .value = static_cast<double>(left), .limit = 2.0});
  for (std::size_t i = 0; i < settings_.pairs.size(); ++i) check_pair(i, sources);
  decide(t_s);
  return state_;
}

}  // namespace torsio

#include "monitor_settings.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <string_view>
#include <utility>

#include "core/checks.hpp"
#include "own_names.hpp"

namespace torsio {
namespace {

// Written so that NaN is not allowed, here and below: no comparison with it is true.
bool is_positive(double value) noexcept { return value > 0.0; }

constexpr std::string_view kMonitor = "monitor";

void check_names(const MonitorSettings& settings) {
  const auto check_each = [](const auto& list, std::size_t most, std::string_view what,
                             const auto& name_of) {
    if (list.size() > most)
      refuse({kMonitor, what}, fmt::format("at most {}", most), fmt::format("{}", list.size()));
    if (const std::string* name = detail::first_not_own(list, name_of))
      refuse({kMonitor, what}, "names of their own", fmt::format("'{}'", *name));
  };
  check_each(settings.sources, Monitor::kMaxSources, "sources",
             [](const std::string& name) -> const std::string& { return name; });
  check_each(settings.signals, Monitor::kMaxSignals, "signals",
             [](const MonitoredSignal& signal) -> const std::string& { return signal.name; });
}

void check_signal(const MonitoredSignal& signal) {
  require(signal.lowest < signal.highest, {kMonitor, signal.name},
          "a lowest value below the highest", signal.lowest);
  require(is_positive(signal.largest_rate), {kMonitor, signal.name + ": largest_rate"}, "above 0",
          signal.largest_rate);
  require(is_positive(signal.longest_age_s), {kMonitor, signal.name + ": longest_age_s"}, "above 0",
          signal.longest_age_s);
  require(signal.turn >= 0.0 && std::isfinite(signal.turn), {kMonitor, signal.name + ": turn"},
          "0 or the turn of its encoder", signal.turn);
  require(is_positive(signal.largest_hidden_travel),
          {kMonitor, signal.name + ": largest_hidden_travel"}, "above 0",
          signal.largest_hidden_travel);
}

void check_pair(const PairLimits& pair, std::size_t sources) {
  const std::string place = fmt::format("pair {}, {}", pair.first, pair.second);
  if (pair.first >= sources || pair.second >= sources || pair.first == pair.second)
    refuse({kMonitor, place}, fmt::format("two different sources of {}", sources), place);
  require(is_positive(pair.factor) && std::isfinite(pair.factor), {kMonitor, place + ": factor"},
          "a positive number", pair.factor);
  require(is_positive(pair.ceiling_Nm), {kMonitor, place + ": ceiling_Nm"}, "above 0",
          pair.ceiling_Nm);
  require(pair.largest_armed_Nm >= pair.floor_Nm, {kMonitor, place + ": largest_armed_Nm"},
          "at least floor_Nm", pair.largest_armed_Nm);
  require(pair.floor_Nm >= 0.0 && pair.floor_Nm <= pair.ceiling_Nm,
          {kMonitor, place + ": floor_Nm"}, "0 to the ceiling", pair.floor_Nm);
  require(pair.drift_allowance > 0.0 && pair.drift_allowance < 1.0,
          {kMonitor, place + ": drift_allowance"}, "between 0 and 1", pair.drift_allowance);
  require(is_positive(pair.drift_limit_s), {kMonitor, place + ": drift_limit_s"}, "above 0",
          pair.drift_limit_s);
}

void check_times(const MonitorSettings& settings) {
  require(is_positive(settings.sample_period_s) && settings.sample_period_s <= 1.0,
          {kMonitor, "sample_period_s"}, "above 0, at most 1", settings.sample_period_s);
  constexpr double kMaxSamples = 1e6;  // `RecentCount` keeps three times as many
  require(settings.persistence_s >= 0.0 &&
              settings.persistence_s <= kMaxSamples * settings.sample_period_s,
          {kMonitor, "persistence_s"}, "0 or more, and at most a million sample periods",
          settings.persistence_s);
  require(settings.release_share > 0.0 && settings.release_share <= 1.0,
          {kMonitor, "release_share"}, "above 0, at most 1", settings.release_share);
  require(settings.longest_loss_s >= 0.0, {kMonitor, "longest_loss_s"}, "0 or more",
          settings.longest_loss_s);
  require(settings.longest_fault_s >= 0.0, {kMonitor, "longest_fault_s"}, "0 or more",
          settings.longest_fault_s);
  require(settings.longest_warm_up_s >= 0.0, {kMonitor, "longest_warm_up_s"}, "0 or more",
          settings.longest_warm_up_s);
  require(is_positive(settings.longest_command_age_s), {kMonitor, "longest_command_age_s"},
          "above 0", settings.longest_command_age_s);
  require(is_positive(settings.largest_novelty), {kMonitor, "largest_novelty"}, "above 0",
          settings.largest_novelty);
  require(settings.proof_s >= 0.0 && std::isfinite(settings.proof_s), {kMonitor, "proof_s"},
          "0 or more", settings.proof_s);
  require(settings.spike_memory_s >= 0.0, {kMonitor, "spike_memory_s"}, "0 or more",
          settings.spike_memory_s);
  require(settings.longest_overrun > 0, {kMonitor, "longest_overrun"}, "1 or more", 0.0);
  require(settings.spikes_in_a_row > 0, {kMonitor, "spikes_in_a_row"}, "1 or more", 0.0);
}

}  // namespace

std::array<MonitorAction, kMonitorChecks> MonitorSettings::default_actions() noexcept {
  std::array<MonitorAction, kMonitorChecks> actions{};
  actions.fill(MonitorAction::stop);
  actions[static_cast<std::size_t>(MonitorCheck::source_lost)] = MonitorAction::warn;
  actions[static_cast<std::size_t>(MonitorCheck::novelty)] = MonitorAction::warn;
  return actions;
}

void detail::check(const MonitorSettings& settings) {
  check_names(settings);
  check_times(settings);
  for (const MonitoredSignal& signal : settings.signals) check_signal(signal);
  if (settings.pairs.size() > Monitor::kMaxPairs)
    refuse({kMonitor, "pairs"}, fmt::format("at most {}", Monitor::kMaxPairs),
           fmt::format("{}", settings.pairs.size()));
  for (const PairLimits& pair : settings.pairs) check_pair(pair, settings.sources.size());
}

std::array<std::uint8_t, Monitor::kMaxSignals> detail::companions(
    const std::vector<MonitoredSignal>& signals) {
  std::array<std::uint8_t, Monitor::kMaxSignals> result{};
  for (std::size_t i = 0; i < signals.size(); ++i) {
    const MonitoredSignal& signal = signals[i];
    result[i] = static_cast<std::uint8_t>(i);
    if (signal.moves_with.empty()) continue;
    const auto found = std::ranges::find(signals, signal.moves_with, &MonitoredSignal::name);
    if (found == signals.end() || found->name == signal.name)
      refuse({kMonitor, signal.name + ": moves_with"}, "another signal",
             fmt::format("'{}'", signal.moves_with));
    result[i] = static_cast<std::uint8_t>(found - signals.begin());
  }
  return result;
}

}  // namespace torsio

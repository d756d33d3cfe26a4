#include "report/html/time_figure_builder.hpp"

#include <algorithm>
#include <cmath>

#include "torsio/control/joint_cascade.hpp"
#include "torsio/core/fault.hpp"
#include "torsio/core/units.hpp"
#include "torsio/safety/monitor.hpp"

namespace torsio {
namespace {

/// The names of an enumeration up to its last value.
template <class Value>
std::vector<std::string> names_up_to(Value last) {
  std::vector<std::string> names;
  for (std::size_t k = 0; k <= static_cast<std::size_t>(last); ++k)
    names.emplace_back(name(static_cast<Value>(k)));
  return names;
}

/// The names of the numbers of a channel that contains faults, states or limits; empty: of another one.
std::vector<std::string> value_names_of(const std::string& channel) {
  if (channel.ends_with("fault_1")) return names_up_to(static_cast<Fault>(kFaultCount - 1));
  if (channel == "monitor_state_1") return names_up_to(Monitor::State::stopped);
  if (channel == "limit_1") return names_up_to(JointCascade::Limit::voltage);
  return {};
}

}  // namespace

std::size_t values_of_figure(std::size_t samples) noexcept {
  constexpr std::size_t kLong = 1'000'000;
  return samples > kLong ? kValuesOfLongFigure : kValuesOfFigure;
}

TimeFigureBuilder::TimeFigureBuilder(std::string title, const Recording& recording,
                                     std::size_t series, const std::vector<PlaceOfInterest>& places,
                                     std::size_t max_values) {
  OverviewPlan plan = plan_overview(recording.size(), series, places, max_values);
  figure_.title = std::move(title);
  figure_.start_s = recording.time_s(0);
  figure_.rate_Hz = recording.sample_rate_Hz();
  figure_.samples = recording.size();
  figure_.bucket = plan.bucket;
  figure_.windows = std::move(plan.windows);
}

void TimeFigureBuilder::panel(std::string label) {
  figure_.panels.push_back({.label = std::move(label), .series = {}});
}

void TimeFigureBuilder::add(std::string label, CurveRole role, bool is_shown,
                            std::span<const double> values) {
  figure_.panels.back().series.push_back({.label = std::move(label),
                                          .role = role,
                                          .is_shown = is_shown,
                                          .overview = overview_of(values, figure_.bucket),
                                          .detail = detail_of(values, figure_.windows)});
}

void TimeFigureBuilder::mark(std::span<const std::uint8_t> flags, const std::string& label) {
  const std::size_t together = std::max<std::size_t>(flags.size() / 500, 1);
  for (std::size_t n = 0; n < flags.size();) {
    if (flags[n] == 0) {
      ++n;
      continue;
    }
    std::size_t last = n;
    for (std::size_t k = n; k < flags.size() && k - last <= together; ++k)
      if (flags[k] != 0) last = k;
    figure_.marks.push_back(
        {.begin_s = figure_.start_s + static_cast<double>(n) / figure_.rate_Hz,
         .end_s = figure_.start_s + static_cast<double>(last + 1) / figure_.rate_Hz,
         .label = label});
    n = last + 1;
  }
}

void TimeFigureBuilder::add_channels(const Recording& recording,
                                     const std::vector<std::string>& left_out) {
  const std::size_t first = figure_.panels.size();
  for (const Channel& channel : recording.channels()) {
    if (std::ranges::find(left_out, channel.name) != left_out.end()) continue;
    const std::string unit = unit_label(channel.name);
    const bool is_shown = !channel.name.starts_with(kTruthPrefix);
    const std::string label = unit.empty() ? channel.name : "[" + unit + "]";
    const auto known = std::find_if(
        figure_.panels.begin() + static_cast<std::ptrdiff_t>(first), figure_.panels.end(),
        [&](const TimeFigure::Panel& panel) { return panel.label == label; });
    if (known == figure_.panels.end()) {
      panel(label);
      figure_.panels.back().value_names = value_names_of(channel.name);
      add(channel.name, CurveRole::model, is_shown, channel.values);
    } else {
      known->series.push_back({.label = channel.name,
                               .role = CurveRole::model,
                               .is_shown = is_shown,
                               .overview = overview_of(channel.values, figure_.bucket),
                               .detail = detail_of(channel.values, figure_.windows)});
    }
  }
}

TimeFigure channels_figure(const Recording& recording, std::string title,
                           std::vector<PlaceOfInterest> places, std::span<const double> motion) {
  std::ranges::copy(reversals_of(motion), std::back_inserter(places));
  TimeFigureBuilder builder(std::move(title), recording, recording.channels().size(), places,
                            values_of_figure(recording.size()));
  builder.add_channels(recording, {});
  return builder.finish();
}

}  // namespace torsio

#include "report/monitor.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "report/json_text.hpp"
#include "report/plots.hpp"
#include "report/result_parts.hpp"
#include "torsio/core/units.hpp"
#include "torsio/report/text_table.hpp"

namespace torsio {
namespace {

using Json = nlohmann::ordered_json;

/// Around a stop the plot shows so much before and after it.
constexpr double kPlotBefore_s = 1.0;
constexpr double kPlotAfter_s = 0.25;

Json event_json(const MonitorReplay::Finding& event, const MonitorSettings& settings) {
  return {{"t_s", event.t_s},
          {"check", name(event.check)},
          {"action", name(event.action)},
          {"value", json_number(event.value)},
          {"limit", json_number(event.limit)},
          {"fault", name(event.fault)},
          {"text", describe(event, settings)}};
}

std::vector<Curve> curves_of(const MonitorReplay& replay, const MonitorSettings& settings,
                             std::span<const double> time_s, std::size_t begin, std::size_t end) {
  std::vector<Curve> curves;
  const auto add = [&](const std::string& label, const std::string& channel) {
    const std::vector<double>& values = replay.estimated.channels.channel(channel).values;
    curves.push_back({.label = label,
                      .x = time_s.subspan(begin, end - begin),
                      .y = std::span(values).subspan(begin, end - begin)});
  };
  for (const std::string& source : settings.sources) add(source, source + "_torque_Nm");
  add("combined", estimate_channel("torque_Nm"));
  return curves;
}

std::vector<double> times(const Recording& recording) {
  std::vector<double> time_s(recording.size());
  for (std::size_t n = 0; n < time_s.size(); ++n) time_s[n] = recording.time_s(n);
  return time_s;
}

std::string plot_of_stop(const MonitorReplay& replay, const MonitorSettings& settings) {
  const std::vector<double> time_s = times(replay.estimated.channels);
  const auto index = [&](double t_s) {
    return static_cast<std::size_t>(std::ranges::lower_bound(time_s, t_s) - time_s.begin());
  };
  const std::size_t begin = index(replay.stopped_at_s - kPlotBefore_s);
  const std::size_t end = index(replay.stopped_at_s + kPlotAfter_s);
  return terminal_plot(curves_of(replay, settings, time_s, begin, end), {"t [s]", "torque [Nm]"});
}

/// What the stop did to a simulated joint; that of a recording is not stopped.
std::string stop_text(const MonitorReplay& replay) {
  if (!replay.rest) return fmt::format("would stop at {:.3f} s", replay.stopped_at_s);
  const double moved_deg = deg_from_rad(replay.rest->moved_rad);
  const std::string begin =
      fmt::format("stopped at {:.3f} s, power off and brake closed: ", replay.stopped_at_s);
  if (std::isnan(replay.rest->after_s))
    return begin + fmt::format("not at rest at the end, {:.3g} deg farther", moved_deg);
  return begin + fmt::format("at rest {:.0f} ms later, {:.3g} deg farther",
                             1e3 * replay.rest->after_s, moved_deg);
}

std::string verdict(const MonitorReplay& replay) {
  if (std::isnan(replay.watching_from_s)) return "was never ready, and not armed";
  if (std::isnan(replay.stopped_at_s))
    return fmt::format("no stop from {:.3f} s to the end", replay.watching_from_s);
  return stop_text(replay);
}

std::string text_of(const MonitorReplay::Finding& finding, const MonitorSettings& settings) {
  const std::string text = fmt::format("{}: {}", name(finding.check), describe(finding, settings));
  return finding.fault == Fault::none ? text : fmt::format("{} ({})", text, name(finding.fault));
}

/// How long after an injection the joint stopped; NaN: it did not.
double stopped_after_s(const MonitorReplay& replay, const MonitorReplay::Injection& of) {
  return replay.stopped_at_s >= of.start_s ? replay.stopped_at_s - of.start_s : kNotMeasured;
}

std::string outcome(const MonitorReplay& replay, const MonitorReplay::Injection& of) {
  const Recording& recording = replay.estimated.channels;
  if (of.start_s > recording.time_s(recording.size() - 1)) return "after the end of the recording";
  if (std::isnan(replay.watching_from_s)) return "not detected, since the monitor was never ready";
  if (replay.stopped_at_s < of.start_s) return "the joint had stopped before";
  if (const double after_s = stopped_after_s(replay, of); !std::isnan(after_s))
    return fmt::format("stop after {:.0f} ms", 1e3 * after_s);
  for (const MonitorEvent& event : replay.events)
    if (event.t_s >= of.start_s)
      return fmt::format("no stop, a warning after {:.0f} ms", 1e3 * (event.t_s - of.start_s));
  return "not detected";
}

/// Why it was never ready.
std::string not_ready_text(const MonitorReplay& replay, const MonitorSettings& settings) {
  std::string text;
  if (replay.threshold_too_large_s > 0.0)
    text += fmt::format(
        "  for {:.3f} s the error bars made a threshold larger than its largest_armed_Nm\n",
        replay.threshold_too_large_s);
  for (const MonitorReplay::NotReady& of : replay.not_ready)
    text += fmt::format("  for {:.3f} s  {}\n", of.present_s, text_of(of.event, settings));
  if (text.empty())
    text = fmt::format("  no check found anything, but for less than {:.3g} s\n", settings.proof_s);
  return text;
}

/// The checks of a calibrated monitor that cannot find anything.
std::vector<std::string> checks_without_limit(const MonitorSettings& monitor) {
  std::vector<std::string> checks;
  const auto none = [&](const auto& has) { return std::ranges::none_of(monitor.signals, has); };
  if (none([](const MonitoredSignal& signal) { return !signal.moves_with.empty(); }))
    checks.emplace_back("frozen (no signal moves with another)");
  if (none([](const MonitoredSignal& signal) { return signal.turn > 0.0; }))
    checks.emplace_back("wrap (no angle with a turn)");
  if (std::isinf(monitor.largest_novelty)) checks.emplace_back("novelty");
  const auto has_no_limit = [](const PairLimits& pair) {
    return std::isinf(pair.largest_armed_Nm);
  };
  if (std::ranges::any_of(monitor.pairs, has_no_limit))
    checks.emplace_back("error bars that are too wide to begin (no disagreement is required)");
  return checks;
}

}  // namespace

std::string calibration_text(const CalibratedMonitor& calibrated) {
  TextTable table;
  table.header({"pair", "largest difference Nm", "threshold Nm", "detected in these states Nm"});
  for (const CalibratedPair& pair : calibrated.pairs)
    table.row({fmt::format("{}, {}", pair.first, pair.second),
               fmt::format("{:.3g}", pair.largest_difference_Nm),
               fmt::format("{:.3g}", pair.typical_threshold_Nm),
               fmt::format("{:.3g}", pair.detected_in_these_states_Nm)});
  std::string notes;
  if (const auto checks = checks_without_limit(calibrated.monitor); !checks.empty())
    notes += fmt::format("without a limit: {}\n", fmt::join(checks, ", "));
  if (!calibrated.not_redundant.empty())
    notes += fmt::format("no comparison covers, since every source depends on it: {}\n",
                         fmt::join(calibrated.not_redundant, ", "));
  for (const TorqueSource& source : calibrated.redundancy.sources)
    if (source.depends_on.empty())
      notes += fmt::format(
          "warning: {} states no parts (NAME=MODEL:PART+PART): a part that it shares with another "
          "source is not found\n",
          source.name);
  for (const CalibratedPair& pair : calibrated.pairs)
    if (pair.typical_threshold_Nm > pair.largest_torque_Nm)
      notes += fmt::format(
          "warning: {}, {}: the threshold of {:.3g} Nm is above the largest torque of the "
          "recordings that both reach ({:.3g} Nm): their models may not fit this joint, its "
          "mapping "
          "or each other\n",
          pair.first, pair.second, pair.typical_threshold_Nm, pair.largest_torque_Nm);
  for (const CalibratedPair& pair : calibrated.pairs)
    if (pair.is_factor_from_floor)
      notes += fmt::format(
          "{}, {}: the error bars hardly change in these recordings; the factor of the threshold "
          "is "
          "its floor over their median\n",
          pair.first, pair.second);
  return fmt::format(
      "{:.3g} h without a fault, thresholds for {:.3g} false alarms per hour{}\n{}"
      "largest difference: of single samples of these recordings; threshold: its median, which a "
      "difference must exceed for {:.3g} ms; detected: a fault that changes the difference by so "
      "much, in any of the states of these recordings\n{}",
      calibrated.hours, calibrated.false_alarms_per_hour,
      calibrated.is_extrapolated
          ? fmt::format(" (extrapolated: the recordings support {:.3g})", 3.0 / calibrated.hours)
          : "",
      table.text(), 1e3 * calibrated.monitor.persistence_s, notes);
}

std::string calibration_json(const CalibratedMonitor& calibrated) {
  Json document{{"fault_free_hours", calibrated.hours},
                {"false_alarms_per_hour", calibrated.false_alarms_per_hour},
                {"is_extrapolated", calibrated.is_extrapolated},
                {"not_redundant", calibrated.not_redundant},
                {"pairs", Json::array()}};
  for (const CalibratedPair& pair : calibrated.pairs)
    document["pairs"].push_back({{"first", pair.first},
                                 {"second", pair.second},
                                 {"largest_difference_Nm", pair.largest_difference_Nm},
                                 {"threshold_Nm", pair.typical_threshold_Nm},
                                 {"largest_torque_Nm", pair.largest_torque_Nm},
                                 {"detected_in_these_states_Nm", pair.detected_in_these_states_Nm},
                                 {"is_factor_from_floor", pair.is_factor_from_floor}});
  return json_text(document);
}

std::string replays_text(const std::vector<MonitorReplay>& replays,
                         const MonitorSettings& settings) {
  std::string text;
  for (const MonitorReplay& replay : replays) {
    text += fmt::format("{}: {}\n", replay.estimated.channels.name(), verdict(replay));
    if (std::isnan(replay.watching_from_s)) text += not_ready_text(replay, settings);
    for (const MonitorReplay::Finding& event : replay.events)
      text += fmt::format("  {:.3f} s  {}  {}\n", event.t_s, name(event.action),
                          text_of(event, settings));
    for (const MonitorReplay::Injection& of : replay.injections)
      text += fmt::format("  injected at {:.3f} s, {}: {}\n", of.start_s, of.fault,
                          outcome(replay, of));
    if (!replay.suspects.empty())
      text += fmt::format("  one fault of any of these explains it: {}\n",
                          fmt::join(replay.suspects, ", "));
    if (!std::isnan(replay.stopped_at_s)) text += plot_of_stop(replay, settings);
  }
  return text;
}

TextTable verdict_table(const std::vector<MonitorReplay>& replays) {
  TextTable table;
  table.header({"recording", "result", "one fault of any of these explains it"});
  for (const MonitorReplay& replay : replays)
    table.row(
        {replay.estimated.channels.name(), verdict(replay),
         replay.suspects.empty() ? "-" : fmt::format("{}", fmt::join(replay.suspects, ", "))});
  return table;
}

TextTable finding_table(const std::vector<MonitorReplay>& replays,
                        const MonitorSettings& settings) {
  TextTable table;
  table.header({"recording", "at [s]", "what", "check", "found", "fault of the source"});
  const auto add = [&](const MonitorReplay& replay, const std::string& at_s, std::string_view what,
                       const MonitorReplay::Finding& finding) {
    table.row({replay.estimated.channels.name(), at_s, std::string(what),
               std::string(name(finding.check)), describe(finding, settings),
               finding.fault == Fault::none ? "-" : std::string(name(finding.fault))});
  };
  for (const MonitorReplay& replay : replays) {
    if (std::isnan(replay.watching_from_s))
      for (const MonitorReplay::NotReady& of : replay.not_ready)
        add(replay, "-", fmt::format("not ready for {:.3f} s", of.present_s), of.event);
    for (const MonitorReplay::Finding& event : replay.events)
      add(replay, fmt::format("{:.3f}", event.t_s), name(event.action), event);
    for (const MonitorReplay::Injection& of : replay.injections)
      table.row({replay.estimated.channels.name(), fmt::format("{:.3f}", of.start_s), "injected",
                 "-", fmt::format("{}: {}", of.fault, outcome(replay, of)), "-"});
  }
  return table;
}

std::string replays_json(const std::vector<MonitorReplay>& replays,
                         const MonitorSettings& settings) {
  Json document{{"recordings", Json::array()}};
  for (const MonitorReplay& replay : replays) {
    Json events = Json::array();
    for (const MonitorReplay::Finding& event : replay.events)
      events.push_back(event_json(event, settings));
    Json injections = Json::array();
    for (const MonitorReplay::Injection& of : replay.injections)
      injections.push_back({{"fault", of.fault},
                            {"start_s", of.start_s},
                            {"stopped_after_s", json_number(stopped_after_s(replay, of))},
                            {"outcome", outcome(replay, of)}});
    Json not_ready = Json::array();
    for (const MonitorReplay::NotReady& of : replay.not_ready) {
      not_ready.push_back(event_json(of.event, settings));
      not_ready.back()["present_s"] = of.present_s;
    }
    document["recordings"].push_back({{"recording", replay.estimated.channels.name()},
                                      {"watching_from_s", json_number(replay.watching_from_s)},
                                      {"stopped_at_s", json_number(replay.stopped_at_s)},
                                      {"events", std::move(events)},
                                      {"suspects", replay.suspects},
                                      {"injections", std::move(injections)},
                                      {"not_ready", std::move(not_ready)},
                                      {"threshold_too_large_s", replay.threshold_too_large_s}});
    if (replay.rest)
      document["recordings"].back()["rest"] = {{"after_s", json_number(replay.rest->after_s)},
                                               {"moved_rad", json_number(replay.rest->moved_rad)}};
  }
  return json_text(document);
}

std::string accuracy_text(const std::vector<FusedAccuracy>& actuators) {
  TextTable table;
  table.header({"actuator", "combined Nm", "each source Nm", "best", "ratio to best",
                "largest ratio", "ratio without one", "in 1 sd %", "in 2 sd %"});
  for (const FusedAccuracy& of : actuators) {
    std::string each;
    for (std::size_t i = 0; i < of.sources.size(); ++i)
      each += fmt::format("{}{} {:.3g}", i > 0 ? ", " : "", of.sources[i], of.source_rmse_Nm[i]);
    std::string without;
    for (const AccuracyWithout& one : of.without)
      without +=
          fmt::format("{}{} {:.3f}", without.empty() ? "" : ", ", one.source, one.mean_ratio);
    table.row({of.actuator, fmt::format("{:.3g}", of.fused_rmse_Nm), each, of.best,
               fmt::format("{:.3f}", of.mean_ratio), fmt::format("{:.3f}", of.largest_ratio),
               without.empty() ? "-" : without, fmt::format("{:.1f}", 100.0 * of.within_std_dev),
               fmt::format("{:.1f}", 100.0 * of.within_2_std_dev)});
  }
  return table.text() +
         "root mean square errors against the torque on the load side; ratio to best: combined "
         "over the "
         "source that had the smallest error in earlier runs\n";
}

std::string accuracy_json(const std::vector<FusedAccuracy>& actuators) {
  Json document{{"actuators", Json::array()}};
  for (const FusedAccuracy& of : actuators) {
    Json sources = Json::array();
    for (std::size_t i = 0; i < of.sources.size(); ++i)
      sources.push_back(
          {{"source", of.sources[i]}, {"rmse_Nm", json_number(of.source_rmse_Nm[i])}});
    Json without = Json::array();
    for (const AccuracyWithout& one : of.without)
      without.push_back({{"source", one.source},
                         {"mean_ratio", json_number(one.mean_ratio)},
                         {"largest_ratio", json_number(one.largest_ratio)}});
    document["actuators"].push_back({{"actuator", of.actuator},
                                     {"runs", of.runs},
                                     {"rmse_Nm", json_number(of.fused_rmse_Nm)},
                                     {"sources", std::move(sources)},
                                     {"best", of.best},
                                     {"mean_ratio", json_number(of.mean_ratio)},
                                     {"largest_ratio", json_number(of.largest_ratio)},
                                     {"within_std_dev", json_number(of.within_std_dev)},
                                     {"within_2_std_dev", json_number(of.within_2_std_dev)},
                                     {"without", std::move(without)}});
  }
  return json_text(document);
}

}  // namespace torsio

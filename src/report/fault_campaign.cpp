#include "report/fault_campaign.hpp"

#include <fmt/format.h>

#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include "report/json_text.hpp"
#include "torsio/report/text_table.hpp"

namespace torsio {
namespace {

using Json = nlohmann::ordered_json;

std::string text(double value, int decimals) {
  return std::isnan(value) ? "-" : fixed_text(value, decimals);
}
std::string count(std::size_t value) { return fmt::format("{}", value); }
std::string percent(double share) { return text(100.0 * share, 1) + " %"; }

std::string class_table(const CampaignResult& result) {
  TextTable table;
  table.header({"fault", "group", "row", "injected", "detected", "missed <", "p50", "p99",
                "longest", "limit", "from", "late", "brief", "redrawn", "unreached"});
  for (const ClassResult& of : result.classes)
    table.row({of.name + (of.must_stop ? "" : " (must not stop)"), of.group,
               fmt::format("{}", of.row), count(of.injected), count(of.detected),
               of.must_stop ? percent(of.missed_upper_95) : "-", text(of.latency.p50_ms, 0),
               text(of.latency.p99_ms, 0), text(of.latency.longest_ms, 0), text(of.limit_ms, 0),
               percent(of.limit_share), count(of.late), count(of.brief), count(of.redrawn),
               count(of.unreached)});
  return "Injections whose disagreement stays at `from` of the rated torque or more until the "
         "limit of "
         "the\nlatency; latencies in ms from where it reaches that, of signals and the loop from "
         "the\n"
         "injection. brief: those with a disagreement before that ended by itself sooner than the "
         "limit.\n"
         "95 % bound of the share that is missed.\n\n" +
         table.text();
}

std::string size_table(const CampaignResult& result) {
  TextTable table;
  table.header({"fault", "group", "disagreement", "injected", "detected", "share"});
  for (const SizeResult& of : result.sizes)
    table.row({of.name, of.group, percent(of.size), count(of.injected), count(of.detected),
               of.injected == 0
                   ? "-"
                   : percent(static_cast<double>(of.detected) / static_cast<double>(of.injected))});
  return "Smaller disagreements (the largest of an injection, over the rated torque)\n\n" +
         table.text();
}

std::string impact_table(const CampaignResult& result) {
  TextTable table;
  table.header({"fault", "group", "near an impact", "detected", "p50", "p99"});
  for (const ClassResult& of : result.classes)
    if (of.near_impact > 0 && of.must_stop)
      table.row({of.name, of.group, count(of.near_impact), count(of.near_impact_detected),
                 text(of.near_impact_latency.p50_ms, 0), text(of.near_impact_latency.p99_ms, 0)});
  return "Injections in the 100 ms after the beginning of an impact; latencies in ms\n\n" +
         table.text();
}

std::string stop_table(const CampaignResult& result) {
  struct Stops {
    std::size_t count = 0;
    std::size_t with_gain = 0;
    double largest = kNotMeasured;
  };
  std::map<std::string, Stops> groups;
  for (const ClassResult& of : result.classes) {
    Stops& to = groups[of.group];
    to.count += of.stops;
    to.with_gain += of.stops_with_gain;
    if (!(to.largest >= of.largest_gain) && !std::isnan(of.largest_gain))
      to.largest = of.largest_gain;
  }
  TextTable table;
  table.header({"group", "stops", "energy increased", "largest gain"});
  for (const auto& [group, of] : groups)
    table.row({group, count(of.count), count(of.with_gain),
               std::isnan(of.largest) ? "-" : fmt::format("{:.1e}", of.largest)});
  return "Stops after a detection: the power is removed and the brake closes. The gain is that of "
         "the\n"
         "energy over the energy in motion and springs; more than 1e-3 counts as an increase.\n\n" +
         table.text();
}

std::string causes_text(const FaultFreeResult& of) {
  std::string all;
  for (const auto& [cause, times] : of.causes)
    all += fmt::format("{}{} x {}", all.empty() ? "" : ", ", times, cause);
  return all;
}

std::string fault_free_table(const CampaignResult& result) {
  TextTable table;
  table.header({"work", "group", "joint-hours", "impacts", "false alarms", "an hour <", "causes"});
  const auto add = [&](const FaultFreeResult& of, std::string group) {
    table.row({of.is_low_load ? "little load, other hysteresis" : "work", std::move(group),
               text(of.joint_hours, 2), count(of.impacts), count(of.false_alarms),
               std::isnan(of.upper_95) ? "-" : fmt::format("{:.2g}", of.upper_95),
               causes_text(of)});
  };
  for (const FaultFreeResult& of : result.fault_free) add(of, of.group);
  if (result.work.simulated_hours > 0.0) add(result.work, "all");
  if (result.low_load.simulated_hours > 0.0) add(result.low_load, "all");
  return "Without a fault; 95 % bound of the rate of false alarms\n\n" + table.text();
}

/// NaN becomes null.
Json json_of(const ClassResult& of) {
  return {{"class", of.name},
          {"group", of.group},
          {"row", of.row},
          {"must_stop", of.must_stop},
          {"injected", of.injected},
          {"detected", of.detected},
          {"missed_upper_95", of.missed_upper_95},
          {"latency_ms_p50", of.latency.p50_ms},
          {"latency_ms_p99", of.latency.p99_ms},
          {"latency_ms_max", of.latency.longest_ms},
          {"limit_ms", of.limit_ms},
          {"limit_share", of.limit_share},
          {"late", of.late},
          {"brief", of.brief},
          {"redrawn", of.redrawn},
          {"unreached", of.unreached},
          {"checks", of.checks},
          {"near_impact",
           {{"injected", of.near_impact},
            {"detected", of.near_impact_detected},
            {"latency_ms_p50", of.near_impact_latency.p50_ms},
            {"latency_ms_p99", of.near_impact_latency.p99_ms}}},
          {"stops",
           {{"count", of.stops},
            {"energy_increased", of.stops_with_gain},
            {"largest_gain", of.largest_gain}}}};
}

Json json_of(const SizeResult& of) {
  return {{"class", of.name},
          {"group", of.group},
          {"size", of.size},
          {"injected", of.injected},
          {"detected", of.detected}};
}

Json json_of(const FaultFreeResult& of) {
  Json json = Json::object();
  if (!of.group.empty()) {
    json["group"] = of.group;
    json["work"] = of.is_low_load ? "low_load" : "work";
  }
  json.update({{"joint_hours", of.joint_hours},
               {"false_alarms", of.false_alarms},
               {"upper_95", of.upper_95},
               {"simulated_hours", of.simulated_hours},
               {"impacts", of.impacts},
               {"causes", of.causes}});
  return json;
}

template <class Results>
Json json_list(const Results& results) {
  Json list = Json::array();
  for (const auto& of : results) list.push_back(json_of(of));
  return list;
}

}  // namespace

std::string fault_campaign_text(const CampaignResult& result) {
  std::string all;
  const auto add = [&](bool has_rows, const std::string& table) {
    if (has_rows) all += (all.empty() ? "" : "\n") + table;
  };
  add(!result.classes.empty(), class_table(result));
  add(!result.sizes.empty(), size_table(result));
  add(!result.classes.empty(), impact_table(result));
  add(!result.classes.empty(), stop_table(result));
  add(!result.fault_free.empty(), fault_free_table(result));
  return all;
}

std::string fault_campaign_json(const CampaignResult& result) {
  return json_text(Json{{"seed", result.seed},
                        {"classes", json_list(result.classes)},
                        {"sizes", json_list(result.sizes)},
                        {"fault_free", json_of(result.work)},
                        {"low_load", json_of(result.low_load)},
                        {"groups", json_list(result.fault_free)}});
}

}  // namespace torsio

#include "fleet/watch_text.hpp"

#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <utility>

#include "report/html/report_parts.hpp"
#include "report/json_text.hpp"
#include "report/result_parts.hpp"
#include "torsio/report/text_table.hpp"

namespace torsio {
namespace {

constexpr const char* kSeverity =
    "severity: the certain part of the largest change, also of the zero, over the smallest change "
    "that counts";
constexpr const char* kVerdict =
    "verdict: that of the joint alone, without the zero; changed: a change is certainly larger "
    "than "
    "what a joint without one shows, which is less than the change that counts";

std::string number_or_dash(double value, const char* unit, double scale = 1.0) {
  return std::isfinite(value) ? fmt::format("{:+.3g}{}", scale * value, unit) : "-";
}

TextTable watch_table(const std::vector<WatchedJoint>& joints) {
  constexpr double kPercent = 100.0;
  TextTable table;
  table.header({"joint", "severity", "before", "verdict", "largest change", "stiffness", "friction",
                "RMSE", "advice"});
  for (const WatchedJoint& joint : joints) {
    if (!joint.last) {
      table.row({joint.serial, "-", "-",
                 joint.model && joint.earlier_comparisons > 0
                     ? fmt::format("never compared with model {}", *joint.model)
                     : "never compared",
                 "", "-", "-", "-", joint.model ? "" : "no model is current"});
      continue;
    }
    const auto plain = [](double value) {
      return std::isfinite(value) ? fmt::format("{:.2f}", value) : "-";
    };
    table.row({joint.serial, plain(joint.severity), plain(joint.severity_before),
               joint.last->verdict, joint.worst,
               number_or_dash(joint.last->stiffness, " %", kPercent),
               number_or_dash(joint.last->friction, " %", kPercent),
               fmt::format("{:.3g}", joint.last->rmse), joint.advice});
  }
  return table;
}

}  // namespace

std::string watch_text(const std::vector<WatchedJoint>& joints) {
  if (joints.empty()) return "no joint is in the registry\n";
  return fmt::format("{}{}\n{}\n", watch_table(joints).text(), kSeverity, kVerdict);
}

std::string watch_json(const std::vector<WatchedJoint>& joints,
                       const std::vector<std::string>& failures) {
  nlohmann::ordered_json list = nlohmann::ordered_json::array();
  for (const WatchedJoint& joint : joints) {
    nlohmann::ordered_json json{{"serial", joint.serial},
                                {"type", text_or_null(joint.type)},
                                {"model", nullptr},
                                {"comparisons", joint.comparisons},
                                {"earlier_comparisons", joint.earlier_comparisons},
                                {"severity", json_number(joint.severity)},
                                {"severity_before", json_number(joint.severity_before)},
                                {"largest_change", text_or_null(joint.worst)},
                                {"advice", text_or_null(joint.advice)},
                                {"verdict", nullptr}};
    if (joint.model) json["model"] = *joint.model;
    if (joint.last) json["verdict"] = joint.last->verdict;
    list.push_back(std::move(json));
  }
  return json_text(nlohmann::ordered_json{{"joints", std::move(list)}, {"failures", failures}});
}

ReportDocument watch_report(const std::vector<WatchedJoint>& joints) {
  XySeries severity{.label = "severity", .style = CurveStyle::columns, .x = {}, .y = {}};
  constexpr std::size_t kMaxColumns = 40;
  for (const WatchedJoint& joint : joints) {
    if (!std::isfinite(joint.severity) || severity.x.size() == kMaxColumns) continue;
    severity.x.push_back(static_cast<double>(severity.x.size()));
    severity.y.push_back(joint.severity);
    severity.names.push_back(joint.serial);
  }
  ReportDocument document{.title = "Drift of a fleet",
                          .summary = {fmt::format("{}.", kSeverity), fmt::format("{}.", kVerdict)},
                          .sections = {},
                          .origin = {}};
  document.sections.push_back({.heading = "Joints by drift",
                               .tables = {report_table(watch_table(joints))},
                               .figures = {XyFigure{.title = "Severity",
                                                    .x = {""},
                                                    .y = {"change / smallest change that counts"},
                                                    .series = {std::move(severity)}}}});
  return document;
}

}  // namespace torsio

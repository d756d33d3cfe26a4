#include "torsio/design/report.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <nlohmann/json.hpp>

#include "data/yaml_reader.hpp"
#include "report/json_text.hpp"
#include "torsio/core/error.hpp"
#include "torsio/report/text_table.hpp"

namespace torsio {
namespace {

/// Letters and digits of a name or unit, with single underscores between them.
std::string plain(const std::string& text) {
  std::string key;
  for (const char c : text) {
    if (c == '^') continue;
    if (std::isalnum(static_cast<unsigned char>(c)) != 0)
      key += c;
    else if (!key.empty() && key.back() != '_')
      key += '_';
  }
  while (!key.empty() && key.back() == '_') key.pop_back();
  return key;
}

/// "outer_radius" in "mm": "outer_radius_mm".
std::string key_of(const DesignFigure& figure) {
  const std::string unit = figure.unit == "%" ? "pct" : plain(figure.unit);
  return plain(figure.name) + (unit.empty() ? "" : "_" + unit);
}

std::string number(double value) {
  return std::isfinite(value) ? fmt::format("{:.6g}", value) : std::string("none");
}

}  // namespace

const DesignFigure& DesignReport::at(const std::string& section, const std::string& name) const {
  for (const DesignSection& each : sections) {
    if (each.name != section) continue;
    const auto found = std::ranges::find(each.figures, name, &DesignFigure::name);
    if (found != each.figures.end()) return *found;
  }
  throw Error({.place = "design " + design, .problem = "no figure " + section + "." + name});
}

std::string design_text(const DesignReport& report) {
  std::string text;
  if (!report.is_feasible) text += report.infeasible + "\n";
  for (const DesignSection& section : report.sections) {
    TextTable table;
    table.header({section.name, "value", "unit", "remark"});
    for (const DesignFigure& figure : section.figures)
      table.row({figure.name, figure.text.empty() ? number(figure.value) : figure.text, figure.unit,
                 figure.remark});
    text += table.text() + "\n";
  }
  for (const std::string& note : report.notes) text += note + "\n";
  return text;
}

std::string design_json(const DesignReport& report) {
  using Json = nlohmann::ordered_json;
  Json document{{"design", report.design}, {"feasible", report.is_feasible}};
  document["infeasible"] = report.infeasible.empty() ? Json(nullptr) : Json(report.infeasible);
  for (const DesignSection& section : report.sections) {
    Json figures = Json::object();
    for (const DesignFigure& figure : section.figures)
      figures[key_of(figure)] = !figure.text.empty()          ? Json(figure.text)
                                : std::isfinite(figure.value) ? Json(figure.value)
                                                              : Json(nullptr);
    document[section.name] = std::move(figures);
  }
  document["notes"] = report.notes;
  return json_text(document);
}

std::string design_yaml(const DesignReport& report) {
  std::string text = fmt::format("design: {}\nfeasible: {}\n", report.design, report.is_feasible);
  if (!report.infeasible.empty()) text += "infeasible: " + yaml_quoted(report.infeasible) + "\n";
  for (const DesignSection& section : report.sections) {
    text += section.name + (section.figures.empty() ? ": {}\n" : ":\n");
    for (const DesignFigure& figure : section.figures)
      text += fmt::format("  {}: {}{}\n", key_of(figure),
                          !figure.text.empty()          ? yaml_quoted(figure.text)
                          : std::isfinite(figure.value) ? fmt::format("{}", figure.value)
                                                        : std::string("null"),
                          figure.remark.empty() ? "" : "  # " + figure.remark);
  }
  for (const std::string& note : report.notes) text += "# " + note + "\n";
  return text;
}

ReportDocument design_page(const DesignReport& report) {
  ReportDocument page{
      .title = "Design: " + report.design, .summary = {}, .sections = {}, .origin = {}};
  page.summary.emplace_back(report.is_feasible ? "The design meets all bounds."
                                               : report.infeasible);
  for (const std::string& note : report.notes) page.summary.push_back(note);
  if (!report.pictures.empty()) {
    ReportSection pictures{.heading = "Pictures"};
    pictures.figures = report.pictures;
    page.sections.push_back(std::move(pictures));
  }
  for (const DesignSection& section : report.sections) {
    ReportTable table{.headings = {"quantity", "value", "unit", "remark"}, .rows = {}};
    for (const DesignFigure& figure : section.figures)
      table.rows.push_back(
          {.cells = {figure.name, figure.text.empty() ? number(figure.value) : figure.text,
                     figure.unit, figure.remark}});
    std::string heading = section.name;
    std::ranges::replace(heading, '_', ' ');
    page.sections.push_back({.heading = std::move(heading), .tables = {std::move(table)}});
  }
  return page;
}

}  // namespace torsio

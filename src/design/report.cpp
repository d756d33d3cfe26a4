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

std::string choice_of(const DesignAlternative& row) {
  if (!row.infeasible.empty()) return "infeasible";
  return row.is_chosen ? "chosen" : "";
}

/// The figures that are the columns of a table: those of the first row that has any.
std::vector<DesignFigure> columns_of(const DesignTable& table) {
  const auto found =
      std::ranges::find_if(table.rows, [](const auto& row) { return !row.figures.empty(); });
  return found == table.rows.end() ? std::vector<DesignFigure>() : found->figures;
}

/// A name for a page: words instead of a key.
std::string words_of(std::string name) {
  std::ranges::replace(name, '_', ' ');
  return name;
}

std::vector<std::string> headings_of(const DesignTable& table) {
  std::vector<std::string> headings{table.row_name, "choice"};
  for (const DesignFigure& column : columns_of(table))
    headings.push_back(words_of(column.name) +
                       (column.unit.empty() ? "" : " [" + column.unit + "]"));
  return headings;
}

std::vector<std::string> cells_of(const DesignAlternative& row, std::size_t columns) {
  std::vector<std::string> cells{row.name, choice_of(row)};
  for (const DesignFigure& figure : row.figures)
    cells.push_back(std::isfinite(figure.value) ? fmt::format("{:.4g}", figure.value) : "-");
  cells.resize(columns, "-");
  return cells;
}

/// The table, and the reasons that are not printed already.
std::string text_of(const DesignTable& of, const std::string& printed) {
  TextTable table;
  const auto headings = headings_of(of);
  table.header(headings);
  for (const DesignAlternative& row : of.rows) table.row(cells_of(row, headings.size()));
  std::string text = table.text();
  for (const DesignAlternative& row : of.rows)
    if (printed.find(row.infeasible) == std::string::npos) text += row.infeasible + "\n";
  return text;
}

ReportTable page_table(const DesignTable& of) {
  ReportTable table{.headings = headings_of(of), .rows = {}};
  for (const DesignAlternative& row : of.rows)
    table.rows.push_back({.cells = cells_of(row, table.headings.size())});
  return table;
}

nlohmann::ordered_json json_of(const DesignFigure& figure) {
  if (!figure.text.empty()) return figure.text;
  if (std::isfinite(figure.value)) return figure.value;
  return nullptr;
}

nlohmann::ordered_json json_of(const DesignTable& of) {
  auto rows = nlohmann::ordered_json::array();
  for (const DesignAlternative& each : of.rows) {
    nlohmann::ordered_json row{{of.row_name, each.name},
                               {"feasible", each.infeasible.empty()},
                               {"chosen", each.is_chosen}};
    if (each.infeasible.empty())
      row["infeasible"] = nullptr;
    else
      row["infeasible"] = each.infeasible;
    for (const DesignFigure& figure : each.figures) row[key_of(figure)] = json_of(figure);
    rows.push_back(std::move(row));
  }
  return rows;
}

std::string yaml_of(const DesignFigure& figure) {
  if (!figure.text.empty()) return yaml_quoted(figure.text);
  return std::isfinite(figure.value) ? fmt::format("{}", figure.value) : std::string("null");
}

std::string yaml_of(const DesignTable& of) {
  std::string text = of.name + ":\n";
  for (const DesignAlternative& row : of.rows) {
    text += fmt::format("  - {}: {}\n    feasible: {}\n    chosen: {}\n    infeasible: {}\n",
                        of.row_name, row.name, row.infeasible.empty(), row.is_chosen,
                        row.infeasible.empty() ? "null" : yaml_quoted(row.infeasible));
    for (const DesignFigure& figure : row.figures)
      text += fmt::format("    {}: {}\n", key_of(figure), yaml_of(figure));
  }
  return text;
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
  for (const DesignSection& section : report.sections) {
    TextTable table;
    table.header({section.name, "value", "unit", "remark"});
    for (const DesignFigure& figure : section.figures)
      table.row({figure.name, figure.text.empty() ? number(figure.value) : figure.text, figure.unit,
                 figure.remark});
    text += table.text() + "\n";
  }
  for (const DesignTable& table : report.tables) text += text_of(table, report.infeasible) + "\n";
  for (const std::string& note : report.notes) text += note + "\n";
  return text;
}

std::string design_json(const DesignReport& report) {
  using Json = nlohmann::ordered_json;
  Json document{{"design", report.design}, {"feasible", report.is_feasible}};
  document["infeasible"] = report.infeasible.empty() ? Json(nullptr) : Json(report.infeasible);
  for (const DesignSection& section : report.sections) {
    Json figures = Json::object();
    for (const DesignFigure& figure : section.figures) figures[key_of(figure)] = json_of(figure);
    document[section.name] = std::move(figures);
  }
  for (const DesignTable& table : report.tables) document[table.name] = json_of(table);
  document["notes"] = report.notes;
  return json_text(document);
}

std::string design_yaml(const DesignReport& report) {
  std::string text = fmt::format("design: {}\nfeasible: {}\n", report.design, report.is_feasible);
  if (!report.infeasible.empty()) text += "infeasible: " + yaml_quoted(report.infeasible) + "\n";
  for (const DesignSection& section : report.sections) {
    text += section.name + (section.figures.empty() ? ": {}\n" : ":\n");
    for (const DesignFigure& figure : section.figures)
      text += fmt::format("  {}: {}{}\n", key_of(figure), yaml_of(figure),
                          figure.remark.empty() ? "" : "  # " + figure.remark);
  }
  for (const DesignTable& table : report.tables) text += yaml_of(table);
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
  for (const DesignTable& table : report.tables) {
    ReportSection section{.heading = "Alternatives", .tables = {page_table(table)}};
    for (const DesignAlternative& row : table.rows)
      if (!row.infeasible.empty()) section.text += row.infeasible + ". ";
    page.sections.push_back(std::move(section));
  }
  for (const DesignSection& section : report.sections) {
    ReportTable table{.headings = {"quantity", "value", "unit", "remark"}, .rows = {}};
    for (const DesignFigure& figure : section.figures)
      table.rows.push_back({.cells = {words_of(figure.name),
                                      figure.text.empty() ? number(figure.value) : figure.text,
                                      figure.unit, figure.remark}});
    page.sections.push_back({.heading = words_of(section.name), .tables = {std::move(table)}});
  }
  return page;
}

}  // namespace torsio

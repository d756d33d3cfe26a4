#include "design/design_flags.hpp"

#include "common/data_flags.hpp"
#include "core/quantity.hpp"
#include "torsio/core/error.hpp"
#include "torsio/sim/bench/sheet_file.hpp"

void DesignOutputs::add(CLI::App& verb, bool has_dxf, const std::string& preferred_figure) {
  verb.add_option("--json", json.destination,
                  "write the design as JSON to a file, or - for standard output");
  verb.add_option("--yaml", yaml, "write the design as YAML to a file");
  if (preferred_figure.empty())
    report.add_page(verb);
  else
    report.add(verb, preferred_figure);
  if (has_dxf) verb.add_option("--dxf", dxf, "write its outline as DXF to a file, in mm");
}

void DesignOutputs::check(const std::vector<std::string>& more) const {
  std::vector<std::string> all{json.destination, yaml, dxf, report.destination, report.plot};
  all.insert(all.end(), more.begin(), more.end());
  DataFlags().check_outputs(all);
  require_ending("--yaml", yaml, {".yaml", ".yml"});
  require_ending("--dxf", dxf, {".dxf"});
}

void DesignOutputs::write(const torsio::DesignReport& design) const {
  if (json.wants_tables()) print(torsio::design_text(design));
  if (!yaml.empty()) write_text(yaml, torsio::design_yaml(design));
  json.write(torsio::design_json(design));
  ReportOutput page = report;
  if (!design.is_feasible) page.plot.clear();  // there is nothing to draw
  if (page.is_wanted()) page.write(torsio::design_page(design));
  if (!design.is_feasible)
    throw torsio::Error({.place = "design " + design.design, .problem = design.infeasible});
}

double quantity(const std::string& text, const char* unit, const char* flag, double none) {
  return text.empty() ? none : torsio::quantity_with_unit(text, unit, flag);
}

double needed(const std::string& text, const char* unit, const char* flag) {
  if (text.empty())
    throw torsio::UsageError(
        {.place = flag, .expected = std::string("a value in ") + unit, .found = "nothing"});
  return torsio::quantity_with_unit(text, unit, flag);
}

std::string sheet_text(const torsio::DataSheet& sheet, const std::string& file) {
  if (file.empty()) return {};
  std::string text = torsio::data_sheet_yaml(sheet);
  static_cast<void>(torsio::parse_data_sheet(text, file));
  return text;
}

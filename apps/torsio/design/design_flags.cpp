#include "design/design_flags.hpp"

#include <fmt/format.h>

#include "common/data_flags.hpp"
#include "core/quantity.hpp"
#include "torsio/core/error.hpp"
#include "torsio/sim/bench/sheet_file.hpp"

void DesignOutputs::add(CLI::App& verb, bool has_dxf, const std::string& preferred_figure) {
  json.add(verb, "the design");
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

void require_options(const char* verb, const std::vector<NeededOption>& options) {
  std::string missing;
  std::string example;
  std::size_t count = 0;
  for (const NeededOption& option : options) {
    const bool has_other = option.other_text != nullptr && !option.other_text->empty();
    if (!option.text->empty() && has_other)
      throw torsio::UsageError({.place = fmt::format("{}, {}", option.flag, option.other_flag),
                                .expected = "one of the two",
                                .found = "both"});
    if (!option.text->empty() || has_other) continue;
    ++count;
    missing += fmt::format("{}{}", missing.empty() ? "" : ", ", option.flag);
    if (option.other_flag != nullptr) missing += fmt::format(" or {}", option.other_flag);
    example += fmt::format("{}{} {}", example.empty() ? "" : " ", option.flag, option.example);
  }
  if (missing.empty()) return;
  throw torsio::UsageError({.place = verb,
                            .expected = missing,
                            .found = count > 1 ? "a call without them" : "a call without it",
                            .advice = "Add for example " + example + "."});
}

std::string sheet_text(const torsio::DataSheet& sheet, const std::string& file) {
  if (file.empty()) return {};
  std::string text = torsio::data_sheet_yaml(sheet);
  static_cast<void>(torsio::parse_data_sheet(text, file));
  return text;
}

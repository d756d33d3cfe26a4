#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "actuator/actuators.hpp"
#include "data/names.hpp"
#include "data/yaml_reader.hpp"
#include "parts/torque_table.hpp"
#include "sim/bench/sheet_rules.hpp"
#include "sim/plant/plant.hpp"
#include "sim/sensors/bench_log.hpp"
#include "sim/sensors/sensor_set.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/units.hpp"
#include "torsio/sim/bench/sheet_file.hpp"

namespace torsio {
namespace {

using namespace sheet_rules;

constexpr double kLargest = 1e12;         // the largest value, so that no product of them overflows
constexpr double kShortestStep_s = 1e-6;  // a thousand steps of the plant in one of the bench
constexpr double kTrial_s = 0.02;         // the motion that is tried before a sheet is accepted
constexpr double kLowestRate_Hz = 0.01;   // the lowest rate of a sensor or a log
constexpr std::size_t kLongestName = 64;
constexpr unsigned kHighestSerial = 9999;

// Writing.

std::string_view family_name(ActuatorFamily family) {
  return std::ranges::find(kFamilies, family, &decltype(kFamilies)::value_type::second)->first;
}

std::string curve_yaml(const std::vector<CurvePoint>& curve) {
  std::string text = fmt::format(
      "torque_curve:\n  columns: [deflection_rad, torque_Nm]\n  origin: {}\n  points:\n",
      static_cast<char>(curve.front().torque_Nm.origin));
  for (const CurvePoint& point : curve)
    text += fmt::format("    - [{}, {}]\n", point.deflection_rad.value, point.torque_Nm.value);
  return text;
}

// Reading.

/// The text of a value that is one of these names.
std::string chosen(const YamlValue& yaml, const std::vector<std::string>& known) {
  std::string text = yaml.text();
  if (std::ranges::find(known, text) == known.end())
    yaml.refuse("one of " + joined(known), did_you_mean(text, known));
  return text;
}

/// A value in the sheet's unit, from another one of the same quantity if that is known.
double in_sheet_unit(double value, const YamlValue& row, std::string_view label) {
  const Unit* const own = find_written_unit(label.empty() ? "1" : label);
  const auto written = row.find("unit");
  if (!written) {
    if (label.empty()) return value;
    row.refuse(fmt::format("a unit: '{{value: 1, unit: {}, origin: A}}'", label));
  }
  const std::string text = written->text();
  if (text == label) return value;
  const Unit* const other = find_written_unit(text);
  if (own != nullptr && other != nullptr && other->si_suffix == own->si_suffix)
    return other->si(value);
  written->refuse(own == nullptr ? fmt::format("the unit {}", label)
                                 : fmt::format("{} or another unit of the same quantity",
                                               label.empty() ? "no unit" : label));
}

Origin origin_from(const YamlValue& yaml) {
  return static_cast<Origin>(chosen(yaml, {"P", "D", "A"}).front());
}

void check_sign(const YamlValue& yaml, std::string_view name, double value) {
  if (value < 0.0 && !has(kMayBeNegative, name)) yaml.refuse("0 or more");
  if (value == 0.0 && has(kMustBePositive, name)) yaml.refuse("a number above 0");
  const bool is_rate = name == "torque_sensor_rate" || name == "log_rate";
  if (is_rate && !(value >= kLowestRate_Hz && value <= kBenchRate_Hz))
    yaml.refuse(fmt::format("{:g} to {:g} Hz", kLowestRate_Hz, kBenchRate_Hz));
}

[[noreturn]] void refuse_missing(const YamlValue& yaml, const std::string& key,
                                 const std::string& expected, const DataSheet& sheet) {
  const auto known = data_sheets();
  const auto example = std::ranges::find(known, sheet.family, &DataSheet::family);
  throw Error({.place = yaml.place(),
               .problem = fmt::format("'{}' is missing", key),
               .expected = expected,
               .found = "nothing",
               .advice = fmt::format("torsio simulate --describe {} --yaml FILE writes a complete "
                                     "sheet.",
                                     example->name)});
}

YamlValue required(const YamlValue& yaml, const std::string& key, const std::string& expected,
                   const DataSheet& sheet) {
  if (auto value = yaml.find(key)) return *value;
  refuse_missing(yaml, key, expected, sheet);
}

SheetValue value_from(const YamlValue& row, const std::string& name, std::string_view unit,
                      const DataSheet& sheet) {
  if (!row.is_map()) row.refuse(fmt::format("'{{value: 1, unit: {}, origin: A}}'", unit));
  row.allow_only({"value", "unit", "origin"});
  const YamlValue number = required(row, "value", "a number", sheet);
  const double value = in_sheet_unit(number.plain_number(kLargest), row, unit);
  check_sign(number, name, value);
  const YamlValue origin =
      required(row, "origin", "P printed, D derived from printed numbers or A assumed", sheet);
  return {value, origin_from(origin)};
}

void read_values(const YamlValue& yaml, bool has_curve, DataSheet& sheet) {
  std::vector<std::string> known;
  const DataSheet& all = sheet;
  visit_listed_values(all, false, [&](const std::string& name, std::string_view, const auto&) {
    known.push_back(name);
  });
  yaml.allow_only(known);
  for (const std::string_view name : kReplacedByCurve)
    if (const auto value = yaml.find(name); has_curve && value)
      value->refuse(fmt::format("no {} besides a torque_curve, which replaces it", name));
  visit_listed_values(
      sheet, has_curve, [&](const std::string& name, std::string_view unit, SheetValue& value) {
        const YamlValue row = required(
            yaml, name, fmt::format("{}: {{value: 1, unit: {}, origin: A}}", name, unit), sheet);
        value = value_from(row, name, unit, sheet);
      });
}

const Unit& column_unit(const YamlValue& yaml, std::string_view quantity, std::string_view si) {
  const std::string text = yaml.text();
  const auto name = split_channel_name(text);
  if (!name || name->quantity != quantity || name->unit->si_suffix != si)
    yaml.refuse(
        fmt::format("{0}_{1}, or {0} with another unit of the same quantity", quantity, si));
  return *name->unit;
}

std::vector<YamlValue> items_of(const YamlValue& yaml, const std::string& expected) {
  if (!yaml.is_list()) yaml.refuse(expected);
  return yaml.items();
}

std::vector<CurvePoint> points_from(const YamlValue& yaml, const DataSheet& sheet) {
  const YamlValue columns = required(yaml, "columns", "[deflection_rad, torque_Nm]", sheet);
  const auto names = items_of(columns, "a list: [deflection_rad, torque_Nm]");
  if (names.size() != 2) columns.refuse("two columns: [deflection_rad, torque_Nm]");
  const Unit& deflection = column_unit(names[0], "deflection", "rad");
  const Unit& torque = column_unit(names[1], "torque", "Nm");
  const Origin origin = origin_from(required(yaml, "origin", "P, D or A", sheet));
  std::vector<CurvePoint> curve;
  for (const YamlValue& point :
       items_of(required(yaml, "points", "a list of [deflection, torque]", sheet),
                "a list of [deflection, torque]")) {
    const auto numbers = items_of(point, "[deflection, torque]");
    if (numbers.size() != 2) point.refuse("two numbers: [deflection, torque]");
    curve.push_back({{deflection.si(numbers[0].plain_number(kLargest)), origin},
                     {torque.si(numbers[1].plain_number(kLargest)), origin}});
  }
  return curve;
}

template <class Build>
void at_place(const std::string& place, const Build& build) {
  try {
    build();
  } catch (const Error& error) {
    ErrorReport report = error.report();
    report.place = place + ": " + report.place;
    throw Error(std::move(report));
  }
}

/// The nominal stiffness must be one that the curve has.
void check_stiffness(const YamlValue& stiffness, double value_Nm_rad, const TorqueTable& table) {
  constexpr double kRounding = 1e-9;
  if (value_Nm_rad >= table.flattest() * (1.0 - kRounding) &&
      value_Nm_rad <= table.steepest() * (1.0 + kRounding))
    return;
  stiffness.refuse(fmt::format("a nominal stiffness between the slopes of the torque_curve, {:.6g} "
                               "to {:.6g} Nm/rad",
                               table.flattest(), table.steepest()),
                   "Controllers are designed with it.");
}

void read_curve(const YamlValue& yaml, const YamlValue& values, DataSheet& sheet) {
  yaml.allow_only({"columns", "origin", "points"});
  auto& spring = std::get<SpringSheet>(sheet.second);
  for (SheetValue* replaced :
       {&spring.stage_rad, &spring.stage_stiffness_Nm_rad, &spring.half_gap_rad, &spring.asymmetry})
    *replaced = assumed(0.0);
  spring.curve = points_from(yaml, sheet);
  std::optional<TorqueTable> table;
  at_place(yaml.at("points").place(), [&] {
    table.emplace(std::get<Spring::Parameters>(plant_parameters(sheet).second).table);
  });
  check_stiffness(values.at("spring_stiffness").at("value"), spring.stiffness_Nm_rad.value, *table);
}

/// The built-in sheet of a family, for its stages and variants.
DataSheet family_from(const YamlValue& yaml) {
  std::vector<std::string> names;
  names.reserve(kFamilies.size());
  for (const auto& [name, family] : kFamilies) names.emplace_back(name);
  const std::string text = chosen(yaml, names);
  const auto* const family =
      std::ranges::find(kFamilies, text, &decltype(kFamilies)::value_type::first);
  return *std::ranges::find(data_sheets(), family->second, &DataSheet::family);
}

std::string name_from(const YamlValue& yaml) {
  std::string name = yaml.text();
  const bool is_plain = std::ranges::all_of(name, [](unsigned char c) {
    return std::isalnum(c) != 0 || c == '-' || c == '_' || c == '.';
  });
  if (!is_plain || name.size() > kLongestName)
    yaml.refuse(fmt::format("up to {} letters, digits and - _ .", kLongestName),
                "The variant and the serial number have keys of their own.");
  return name;
}

std::string title_from(const YamlValue& yaml) {
  std::string title = yaml.text();
  if (std::ranges::any_of(title, [](unsigned char c) { return std::iscntrl(c) != 0; }))
    yaml.refuse("a description in one line");
  return title;
}

void read_variant(const YamlValue& yaml, DataSheet& sheet) {
  std::vector<std::string> names(sheet.variants.begin(), sheet.variants.end());
  std::erase(names, "");
  const auto variant = yaml.find("variant");
  if (names.empty()) {
    if (variant) variant->refuse("no variant: this family has none");
    return;
  }
  mark_variant(sheet, chosen(required(yaml, "variant", "one of " + joined(names), sheet), names));
}

/// Whether a plant, its sensors and its log can be built.
void check_parts(const DataSheet& sheet, const std::string& file) {
  at_place(file, [&] {
    Plant plant(plant_parameters(sheet));
    if (!(plant.longest_step() >= kShortestStep_s))
      throw Error({.place = "plant",
                   .problem = "its stiffest mode or strongest damping is too fast to simulate",
                   .expected = fmt::format("steps of at least {:g} s", kShortestStep_s),
                   .found = fmt::format("{:.3g} s", plant.longest_step()),
                   .advice = "Take a larger inertia or a smaller stiffness or damping."});
    const PlantCommand rated{.current_A = sheet.rating.current_A.value};
    if (plant.reset() != Fault::none || plant.step(rated, {}, kTrial_s) != Fault::none)
      throw Error({.place = "plant",
                   .problem = "its motion under the rated current is not finite",
                   .expected = "values that together are an actuator",
                   .advice = "Compare them with those of a built-in sheet."});
    static_cast<void>(SensorSet(sheet, kBenchRate_Hz, 1));
    static_cast<void>(BenchLog(sheet, 0, false));
  });
}

DataSheet sheet_from(const YamlValue& yaml) {
  yaml.allow_only({"name", "title", "family", "variant", "serial", "values", "torque_curve"});
  DataSheet sheet = family_from(
      required(yaml, "family", "series-elastic, elastomer, rubber-clutch or harmonic-drive",
               data_sheets().front()));
  sheet.name = name_from(required(yaml, "name", "a name", sheet));
  sheet.title = title_from(required(yaml, "title", "a description in one line", sheet));
  read_variant(yaml, sheet);
  sheet.serial = {};
  if (const auto serial = yaml.find("serial")) {
    const std::size_t number = serial->count();
    if (number > kHighestSerial) serial->refuse(fmt::format("0 to {}", kHighestSerial));
    sheet.serial = static_cast<unsigned>(number);
  }
  const auto curve = yaml.find("torque_curve");
  if (curve && !std::holds_alternative<SpringSheet>(sheet.second))
    curve->refuse("no torque_curve: only a series-elastic actuator has a spring with one");
  const YamlValue values = required(yaml, "values", "the numbers of the sheet", sheet);
  read_values(values, curve.has_value(), sheet);
  if (curve) read_curve(*curve, values, sheet);
  check_parts(sheet, yaml.file());
  return sheet;
}

/// A sheet is a part of the call: all that is wrong with it is a UsageError.
template <class Read>
DataSheet as_usage(const Read& read) {
  try {
    return sheet_from(read());
  } catch (const Cancelled&) {
    throw;
  } catch (const Error& error) {
    throw UsageError(error.report());
  }
}

}  // namespace

std::string data_sheet_yaml(const DataSheet& sheet) {
  std::string text = fmt::format(
      "# origin: P printed in a paper, D derived from printed numbers, A assumed\n"
      "name: {}\ntitle: {}\nfamily: {}\n",
      sheet.name, yaml_quoted(sheet.title), family_name(sheet.family));
  if (!sheet.variant.empty()) text += fmt::format("variant: {}\n", sheet.variant);
  if (sheet.serial) text += fmt::format("serial: {}\n", *sheet.serial);
  text += "values:\n";
  visit_listed_values(sheet, has_curve(sheet),
                      [&](const std::string& name, std::string_view unit, const SheetValue& value) {
                        text += fmt::format("  {}: {{value: {}, {}{}origin: {}}}\n", name,
                                            value.value, unit.empty() ? "" : "unit: ",
                                            unit.empty() ? "" : fmt::format("{}, ", unit),
                                            static_cast<char>(value.origin));
                      });
  if (has_curve(sheet)) text += curve_yaml(std::get<SpringSheet>(sheet.second).curve);
  return text;
}

DataSheet read_data_sheet(const std::string& path, const Progress& progress) {
  return as_usage([&] { return YamlValue::read(path, progress); });
}

DataSheet parse_data_sheet(std::string_view text, const std::string& file) {
  return as_usage([&] { return YamlValue::parse(text, file); });
}

bool is_sheet_file(std::string_view actuator) noexcept {
  return actuator.ends_with(".yaml") || actuator.ends_with(".yml");
}

DataSheet find_data_sheet(const std::string& actuator, const Progress& progress) {
  return is_sheet_file(actuator) ? read_data_sheet(actuator, progress) : data_sheet(actuator);
}

}  // namespace torsio

#include "torsio/design/tables.hpp"

#include <fmt/format.h>

#include <array>
#include <utility>

#include "core/did_you_mean.hpp"
#include "core/quantity.hpp"
#include "data/yaml_reader.hpp"
#include "shipped_tables.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/units.hpp"

namespace torsio {
namespace {

YamlValue document(const std::string& path, std::string_view shipped, const char* name,
                   const Progress& progress) {
  return path.empty() ? YamlValue::parse(shipped, name) : YamlValue::read(path, progress);
}

/// An entry of a table: its values in SI, each read once.
class Row {
 public:
  Row(YamlValue value, std::initializer_list<std::string_view> keys) : value_(std::move(value)) {
    value_.allow_only(keys);
  }
  [[nodiscard]] std::string text(std::string_view key) const { return value_.at(key).text(); }
  /// "printed: ..." or "assumed: ...".
  [[nodiscard]] std::string source() const {
    const YamlValue source = value_.at("source");
    std::string text = source.text();
    if (!text.starts_with("printed") && !text.starts_with("assumed"))
      source.refuse("a source that begins with 'printed' or 'assumed'");
    return text;
  }
  [[nodiscard]] double positive(std::string_view key, std::string_view si_unit) const {
    const YamlValue value = value_.at(key);
    const double number = si_unit == "1" ? value.number("1") : with_unit(value, si_unit);
    if (!(number > 0.0)) value.refuse("a number above 0");
    return number;
  }
  /// A number in a unit that is not among torsio's: "16e-6 kg m^2".
  [[nodiscard]] double in(std::string_view key, std::string_view unit) const {
    const YamlValue value = value_.at(key);
    const std::string text = value.text();
    if (!text.ends_with(fmt::format(" {}", unit)))
      value.refuse(fmt::format("a number in {}", unit));
    const double number =
        si_quantity(text.substr(0, text.size() - unit.size()), "1", value.place());
    if (!(number > 0.0)) value.refuse("a number above 0");
    return number;
  }

 private:
  static double with_unit(const YamlValue& value, std::string_view si_unit) {
    return quantity_with_unit(value.text(), si_unit, value.place());
  }
  YamlValue value_;
};

std::vector<YamlValue> rows_of(const YamlValue& table, std::string_view key) {
  const YamlValue list = table.at(key);
  std::vector<YamlValue> rows = list.items();
  if (rows.empty()) list.refuse("at least one entry");
  return rows;
}

}  // namespace

std::vector<BellevilleWasher> read_washers(const std::string& path, const Progress& progress) {
  const YamlValue table = document(path, kShippedWashers, "washers.yaml", progress);
  table.allow_only({"washers"});
  std::vector<BellevilleWasher> washers;
  for (const YamlValue& value : rows_of(table, "washers")) {
    const Row row(value, {"name", "source", "inner_diameter", "outer_diameter", "thickness",
                          "cone_height", "elastic_modulus", "poisson"});
    washers.push_back({.name = row.text("name"),
                       .source = row.source(),
                       .inner_diameter_m = row.positive("inner_diameter", "m"),
                       .outer_diameter_m = row.positive("outer_diameter", "m"),
                       .thickness_m = row.positive("thickness", "m"),
                       .cone_height_m = row.positive("cone_height", "m"),
                       .elastic_modulus_Pa = row.positive("elastic_modulus", "Pa"),
                       .poisson = row.positive("poisson", "1")});
    check(washers.back());
  }
  return washers;
}

std::vector<SpringMaterial> read_materials(const std::string& path, const Progress& progress) {
  const YamlValue table = document(path, kShippedMaterials, "materials.yaml", progress);
  table.allow_only({"materials"});
  std::vector<SpringMaterial> materials;
  for (const YamlValue& value : rows_of(table, "materials")) {
    const Row row(value, {"name", "source", "elastic_modulus", "shear_modulus", "density",
                          "allowed_shear", "fatigue_shear", "poisson"});
    materials.push_back({.name = row.text("name"),
                         .source = row.source(),
                         .elastic_modulus_Pa = row.positive("elastic_modulus", "Pa"),
                         .shear_modulus_Pa = row.positive("shear_modulus", "Pa"),
                         .density_kg_m3 = row.in("density", "kg/m^3"),
                         .allowed_shear_Pa = row.positive("allowed_shear", "Pa"),
                         .fatigue_shear_Pa = row.positive("fatigue_shear", "Pa"),
                         .poisson = row.positive("poisson", "1")});
  }
  return materials;
}

DriveTable read_drives(const std::string& path, const Progress& progress) {
  const YamlValue table = document(path, kShippedDrives, "drives.yaml", progress);
  table.allow_only({"gears", "motors"});
  DriveTable drives;
  for (const YamlValue& value : rows_of(table, "gears")) {
    const Row row(value, {"name", "source", "ratio", "continuous_torque", "peak_torque",
                          "stiffness", "friction", "viscous", "mass"});
    drives.gears.push_back({.name = row.text("name"),
                            .source = row.source(),
                            .ratio = row.positive("ratio", "1"),
                            .continuous_Nm = row.positive("continuous_torque", "Nm"),
                            .peak_Nm = row.positive("peak_torque", "Nm"),
                            .stiffness_Nm_rad = row.positive("stiffness", "Nm_rad"),
                            .friction_Nm = row.positive("friction", "Nm"),
                            .viscous_Nms_rad = row.positive("viscous", "Nms_rad"),
                            .mass_kg = row.positive("mass", "kg")});
  }
  for (const YamlValue& value : rows_of(table, "motors")) {
    const Row row(value, {"name", "source", "torque_constant", "rotor_inertia", "resistance",
                          "supply", "continuous_current", "peak_current", "mass"});
    drives.motors.push_back({.name = row.text("name"),
                             .source = row.source(),
                             .torque_constant_Nm_A = row.in("torque_constant", "Nm/A"),
                             .rotor_inertia_kg_m2 = row.in("rotor_inertia", "kg m^2"),
                             .resistance_Ohm = row.in("resistance", "Ohm"),
                             .supply_V = row.positive("supply", "V"),
                             .continuous_A = row.positive("continuous_current", "A"),
                             .peak_A = row.positive("peak_current", "A"),
                             .mass_kg = row.positive("mass", "kg")});
  }
  return drives;
}

template <class Entry>
const Entry& find_entry(const std::vector<Entry>& table, std::string_view name,
                        std::string_view place) {
  std::vector<std::string> names;
  std::string list;
  for (const Entry& entry : table) {
    if (entry.name == name) return entry;
    names.push_back(entry.name);
    list += fmt::format("{}{}", list.empty() ? "" : ", ", entry.name);
  }
  throw UsageError({.place = std::string(place),
                    .expected = "one of " + list,
                    .found = "'" + std::string(name) + "'",
                    .advice = did_you_mean(name, names)});
}
template const BellevilleWasher& find_entry(const std::vector<BellevilleWasher>&, std::string_view,
                                            std::string_view);
template const SpringMaterial& find_entry(const std::vector<SpringMaterial>&, std::string_view,
                                          std::string_view);

}  // namespace torsio

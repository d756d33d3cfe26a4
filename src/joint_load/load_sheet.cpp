// The reader of load files.
#include <fmt/format.h>

#include <array>
#include <cmath>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/quantity.hpp"
#include "core/trimmed.hpp"
#include "data/yaml_reader.hpp"
#include "joint_load/load_fact.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/units.hpp"
#include "torsio/joint_load/known_load.hpp"

namespace torsio {
namespace {

constexpr std::string_view kFit = "fit";

LoadFact optional_fact(const YamlValue& map, std::string_view key, std::string_view si_unit) {
  const std::optional<YamlValue> value = map.find(key);
  return value ? load_fact(*value, si_unit) : LoadFact{};
}

/// A fact that may be fitted.
LoadFact fitted_fact(const YamlValue& map, std::string_view key, std::string_view si_unit,
                     bool& is_fitted) {
  const std::optional<YamlValue> value = map.find(key);
  if (!value) return {};
  is_fitted = value->is_scalar() && trimmed(value->text()) == kFit;
  return is_fitted ? LoadFact{} : load_fact(*value, si_unit);
}

PendulumFacts pendulum_of(const YamlValue& map) {
  map.allow_only({"mass", "length", "arm_mass", "inclination"});
  return {.mass_kg = load_fact(map.at("mass"), "kg"),
          .length_m = load_fact(map.at("length"), "m"),
          .arm_mass_kg = optional_fact(map, "arm_mass", "kg"),
          .inclination_rad = optional_fact(map, "inclination", "rad")};
}

std::vector<double> place_of(const YamlValue& value) {
  const std::vector<YamlValue> items = value.items();
  if (!value.is_list() || items.size() != 3)
    value.refuse("a list of three lengths: the centre of mass in the frame of the link");
  std::vector<double> at_m;
  at_m.reserve(items.size());
  for (const YamlValue& item : items) at_m.push_back(item.number("m"));  // as in a URDF
  return at_m;
}

UrdfFacts urdf_of(const YamlValue& load) {
  UrdfFacts facts{.file = load.at("urdf").text(), .joint = load.at("joint").text()};
  if (const auto payload = load.find("payload")) {
    payload->allow_only({"link", "mass", "at"});
    facts.payload_link = payload->at("link").text();
    facts.payload_mass_kg = load_fact(payload->at("mass"), "kg");
    facts.payload_at_m = place_of(payload->at("at"));
  }
  if (const auto pose = load.find("pose"))
    for (const auto& [joint, angle] : pose->entries())
      facts.pose_rad.emplace_back(joint,
                                  signed_quantity_with_unit(angle.text(), "rad", angle.place()));
  return facts;
}

/// Where the error of a fact goes.
struct NamedFact {
  std::string_view name;
  std::string_view si_unit;
  LoadFact* fact;
  bool is_fitted = false;
};

std::vector<NamedFact> facts_of(LoadSheet& sheet) {
  std::vector<NamedFact> facts;
  if (auto* const pendulum = std::get_if<PendulumFacts>(&sheet.facts))
    facts = {{"mass", "kg", &pendulum->mass_kg},
             {"length", "m", &pendulum->length_m},
             {"arm_mass", "kg", &pendulum->arm_mass_kg},
             {"inclination", "rad", &pendulum->inclination_rad}};
  else
    facts = {{"payload_mass", "kg", &std::get<UrdfFacts>(sheet.facts).payload_mass_kg}};
  facts.push_back({"joint_inertia", "kg_m2", &sheet.joint_inertia_kg_m2, sheet.fits_joint_inertia});
  facts.push_back({"zero", "rad", &sheet.zero_rad, sheet.fits_zero});
  return facts;
}

/// "0.5%" of the value, or a number with the unit of the fact.
void read_error(const YamlValue& value, const NamedFact& fact) {
  if (fact.is_fitted)
    value.refuse("no error for what is fitted, whose standard error follows from the recordings");
  const std::string text = value.text();
  const std::string_view all = trimmed(text);
  if (!all.ends_with('%')) {
    fact.fact->standard_error = quantity_with_unit(text, fact.si_unit, value.place());
    return;
  }
  if (fact.si_unit == "rad")
    value.refuse("an angle, such as 0.5deg", "An angle has no share: its zero is arbitrary.");
  const double share = 0.01 * si_quantity(all.substr(0, all.size() - 1), "1", value.place());
  if (!(share >= 0.0 && share < 1.0)) value.refuse("a share of 0% to below 100%");
  fact.fact->relative_error = share;
}

void read_errors(const YamlValue& map, LoadSheet& sheet) {
  const std::vector<NamedFact> facts = facts_of(sheet);
  std::vector<std::string> names;
  names.reserve(facts.size());
  for (const NamedFact& fact : facts) names.emplace_back(fact.name);
  map.allow_only(names);
  for (const auto& [name, value] : map.entries())
    for (const NamedFact& fact : facts)
      if (fact.name == name) read_error(value, fact);
}

/// Numbers outside their range are refused with their line, as far as they are in the file.
void require_range(const YamlValue& load, std::string_view key, double value, double lowest,
                   double highest, const std::string& expected) {
  const std::optional<YamlValue> at = load.find(key);
  if (at && !(value >= lowest && value <= highest)) at->refuse(expected);
}

void require_ranges(const YamlValue& load, const LoadSheet& sheet) {
  constexpr double kMost = 1e6;
  require_range(load, "joint_inertia", sheet.joint_inertia_kg_m2.value, 0.0, kMost,
                "an inertia from 0kg_m2 to 1e6kg_m2");
  require_range(load, "zero", sheet.zero_rad.value, -rad_from_deg(360.0), rad_from_deg(360.0),
                "an angle from -360deg to 360deg");
  const auto* const facts = std::get_if<PendulumFacts>(&sheet.facts);
  if (facts == nullptr) {
    if (const auto payload = load.find("payload"))
      require_range(*payload, "mass", std::get<UrdfFacts>(sheet.facts).payload_mass_kg.value, 0.0,
                    kMost, "a mass from 0kg to 1e6kg");
    return;
  }
  const YamlValue pendulum = load.at("pendulum");
  require_range(pendulum, "mass", facts->mass_kg.value, 0.0, kMost, "a mass from 0kg to 1e6kg");
  require_range(pendulum, "length", facts->length_m.value, 0.0, kMost, "a length from 0m to 1e6m");
  require_range(pendulum, "arm_mass", facts->arm_mass_kg.value, 0.0, kMost,
                "a mass from 0kg to 1e6kg");
  require_range(pendulum, "inclination", facts->inclination_rad.value, -rad_from_deg(90.0),
                rad_from_deg(90.0),
                "an angle from -90deg to 90deg, of the axis from the horizontal");
}

LoadSheet sheet_of(const YamlValue& file, const std::string& name) {
  file.allow_only({"load", "load_uncertainty"});
  const YamlValue load = file.at("load");
  const bool is_pendulum = load.find("pendulum").has_value();
  if (is_pendulum == load.find("urdf").has_value())
    load.refuse("either 'pendulum' or 'urdf' with 'joint'");
  LoadSheet sheet{.file = name};
  if (is_pendulum) {
    load.allow_only({"pendulum", "joint_inertia", "zero"});
    sheet.facts = pendulum_of(load.at("pendulum"));
  } else {
    load.allow_only({"urdf", "joint", "payload", "pose", "joint_inertia", "zero"});
    sheet.facts = urdf_of(load);
  }
  sheet.joint_inertia_kg_m2 = fitted_fact(load, "joint_inertia", "kg_m2", sheet.fits_joint_inertia);
  sheet.zero_rad = fitted_fact(load, "zero", "rad", sheet.fits_zero);
  require_ranges(load, sheet);
  if (const auto errors = file.find("load_uncertainty")) read_errors(*errors, sheet);
  return sheet;
}

}  // namespace

LoadSheet parse_load_sheet(std::string_view text, const std::string& name) {
  return sheet_of(YamlValue::parse(text, name), name);
}

LoadSheet read_load_sheet(const std::string& path) { return sheet_of(YamlValue::read(path), path); }

}  // namespace torsio

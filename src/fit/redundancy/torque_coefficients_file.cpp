#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>

#include "data/yaml_reader.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/units.hpp"
#include "torsio/fit/redundancy/fit_motor_referenced_torques.hpp"

namespace torsio {
namespace {

constexpr double kLargest = 1e12;           // no product with an angle or a speed overflows
constexpr double kLargestPerDegree = 1e10;  // below it per radian: a file in SI can be read again
constexpr std::size_t kMaxJoints = 1000;

/// A coefficient with its key in SI and, where it is per angle, per degree.
struct Row {
  const char* key;
  const char* key_per_degree;  ///< null: not per angle
  double DeflectionTorque::*value;
};
constexpr std::array kRows{Row{"p0_Nm", nullptr, &DeflectionTorque::offset_Nm},
                           Row{"p1_Nm_rad", "p1_Nm_deg", &DeflectionTorque::stiffness_Nm_rad},
                           Row{"p2_Nms_rad", "p2_Nms_deg", &DeflectionTorque::viscous_Nms_rad},
                           Row{"p3_Nm", nullptr, &DeflectionTorque::coulomb_Nm}};

std::string flow_map(const DeflectionTorque& of) {
  std::string text;
  for (const Row& row : kRows)
    text += fmt::format("{}{}: {}", text.empty() ? "{" : ", ", row.key, of.*row.value);
  return text + "}";
}

double coefficient(const YamlValue& yaml, const Row& row) {
  const auto si = yaml.find(row.key);
  if (row.key_per_degree == nullptr) return yaml.at(row.key).plain_number(kLargest);
  const auto per_degree = yaml.find(row.key_per_degree);
  if (si.has_value() == per_degree.has_value())
    throw Error({.place = yaml.place(),
                 .expected = fmt::format("either {} or {}", row.key_per_degree, row.key),
                 .found = si ? "both" : "neither"});
  return si ? si->plain_number(kLargest)
            : deg_from_rad(per_degree->plain_number(kLargestPerDegree));
}

DeflectionTorque deflection_torque(const YamlValue& yaml) {
  yaml.allow_only({"p0_Nm", "p1_Nm_rad", "p1_Nm_deg", "p2_Nms_rad", "p2_Nms_deg", "p3_Nm"});
  DeflectionTorque all;
  for (const Row& row : kRows) all.*row.value = coefficient(yaml, row);
  return all;
}

double positive(const YamlValue& yaml) {
  const double value = yaml.plain_number(kLargest);
  if (!(value > 0.0)) yaml.refuse("a number above 0");
  return value;
}

std::string name_from(const YamlValue& yaml) {
  std::string name = yaml.text();
  if (std::ranges::any_of(name, [](unsigned char c) { return std::iscntrl(c) != 0; }))
    yaml.refuse("a name in one line");
  return name;
}

JointTorqueCoefficients joint(const YamlValue& yaml) {
  yaml.allow_only({"name", "torque_constant_Nm_A", "gear_ratio", "spring", "gear"});
  return {.name = name_from(yaml.at("name")),
          .parameters = {.torque_constant_Nm_A = positive(yaml.at("torque_constant_Nm_A")),
                         .gear_ratio = positive(yaml.at("gear_ratio")),
                         .gear = deflection_torque(yaml.at("gear")),
                         .spring = deflection_torque(yaml.at("spring"))}};
}

std::vector<JointTorqueCoefficients> joints(const YamlValue& yaml) {
  yaml.allow_only({"joints"});
  const YamlValue list = yaml.at("joints");
  if (!list.is_list()) list.refuse("a list of joints, '- name: ...'");
  const std::vector<YamlValue> items = list.items();
  if (items.empty() || items.size() > kMaxJoints)
    throw Error({.place = list.place(),
                 .expected = fmt::format("1 to {} joints", kMaxJoints),
                 .found = fmt::format("{}", items.size())});
  std::vector<JointTorqueCoefficients> all;
  for (const YamlValue& item : items) {
    JointTorqueCoefficients next = joint(item);
    if (std::ranges::find(all, next.name, &JointTorqueCoefficients::name) != all.end())
      item.at("name").refuse("a name that no joint before it has");
    all.push_back(std::move(next));
  }
  return all;
}

}  // namespace

std::string torque_coefficients_yaml(std::span<const JointTorqueCoefficients> joints) {
  std::string text = "joints:\n";
  for (const JointTorqueCoefficients& joint : joints)
    text += fmt::format(
        "  - name: {}\n    torque_constant_Nm_A: {}\n    gear_ratio: {}\n    spring: {}\n"
        "    gear: {}\n",
        yaml_quoted(joint.name), joint.parameters.torque_constant_Nm_A, joint.parameters.gear_ratio,
        flow_map(joint.parameters.spring), flow_map(joint.parameters.gear));
  return text;
}

std::vector<JointTorqueCoefficients> read_torque_coefficients(const std::string& path,
                                                              const Progress& progress) {
  return joints(YamlValue::read(path, progress));
}

std::vector<JointTorqueCoefficients> parse_torque_coefficients(std::string_view text,
                                                               const std::string& file) {
  return joints(YamlValue::parse(text, file));
}

}  // namespace torsio

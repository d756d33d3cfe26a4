#include "fleet/fleet_text.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <utility>

#include "files/json_text.hpp"
#include "fleet/fleet_tables.hpp"
#include "report/json_text.hpp"
#include "report/result_parts.hpp"

namespace torsio {
namespace {

using FleetTextJson = nlohmann::ordered_json;

/// How many of the planted faults were found.
struct PlantedFaults {
  std::size_t planted = 0;
  std::size_t found = 0;
  std::size_t right = 0;  ///< with their kind
  std::size_t sound = 0;  ///< sound joints that are listed
  bool can_be_found = false;
};

PlantedFaults planted_in(const FleetCalibration& fleet) {
  PlantedFaults faults;
  faults.planted = static_cast<std::size_t>(std::ranges::count_if(
      fleet.joints, [](const CalibratedJoint& joint) { return !joint.fault.empty(); }));
  for (std::size_t i = 0; i < fleet.joints.size(); ++i)
    faults.can_be_found |= !fleet.joints[i].fault.empty() && fleet.is_compared(i);
  for (const FleetOutlier& outlier : fleet.outliers) {
    const CalibratedJoint& joint = fleet.joints[outlier.joint];
    if (joint.fault.empty()) {
      ++faults.sound;
      continue;
    }
    ++faults.found;
    if (joint.fault_trait == outlier.trait) ++faults.right;
  }
  return faults;
}

std::string planted_text(const FleetCalibration& fleet) {
  const PlantedFaults faults = planted_in(fleet);
  if (faults.planted == 0) return {};
  std::string text =
      faults.can_be_found
          ? fmt::format(
                "planted faults: {} of {} found, {} of them with the right kind; {} listed\n",
                faults.found, faults.planted, faults.right, plural(faults.sound, "sound joint"))
          : fmt::format("planted faults: 0 of {} found: fewer than {} joints cannot be compared\n",
                        faults.planted, kLeastMembers);
  for (std::size_t i = 0; i < fleet.joints.size(); ++i)
    if (!fleet.joints[i].fault.empty() &&
        std::ranges::find(fleet.outliers, i, &FleetOutlier::joint) == fleet.outliers.end())
      text += fmt::format("  not found: {}, {}\n", fleet.joints[i].serial, fleet.joints[i].fault);
  return text;
}

FleetTextJson planted_json(const FleetCalibration& fleet) {
  const PlantedFaults faults = planted_in(fleet);
  if (faults.planted == 0) return nullptr;
  return {{"planted", faults.planted},
          {"found", faults.found},
          {"with_right_kind", faults.right},
          {"sound_listed", faults.sound}};
}

FleetTextJson joint_json(const CalibratedJoint& joint) {
  FleetTextJson traits = FleetTextJson::array();
  for (const JointTrait trait : kAllJointTraits) {
    const JointTraits::Value& of = joint.traits[trait];
    traits.push_back({{"name", name(trait)},
                      {"value", json_number(of.value)},
                      {"std_error", json_number(of.std_error)},
                      {"unit", text_or_null(of.unit)}});
  }
  FleetTextJson methods = FleetTextJson::array();
  for (const CalibratedJoint::Method& method : joint.methods)
    methods.push_back({{"name", method.name},
                       {"held_out_rmse", json_number(method.held_out_rmse)},
                       {"test_rmse", json_number(method.test_rmse)}});
  return {{"serial", joint.serial},
          {"type", text_or_null(joint.type)},
          {"fault", text_or_null(joint.fault)},
          {"failure", text_or_null(joint.failure)},
          {"warnings", joint.warnings},
          {"chosen", text_or_null(joint.chosen)},
          {"base_sha256", text_or_null(joint.base_sha256)},
          {"test_rmse", json_number(joint.test_rmse)},
          {"methods", std::move(methods)},
          {"traits", std::move(traits)}};
}

}  // namespace

std::string fleet_text(const FleetCalibration& fleet) {
  constexpr std::size_t kMaxJoints = 60;
  std::string text = head_text(fleet) + "\n";
  for (const FleetCalibration::OfType& type : fleet.types)
    text += fmt::format("\n{}{}\n\n{}{}\n", plural(type.members.size(), "joint"),
                        type.type.empty() ? "" : " of the type " + type.type,
                        traits_table(fleet, type).text(), tails_text(type));
  if (!fleet.outliers.empty())
    text += "\n" + outlier_table(fleet).text() +
            "sound ones expected: number of sound joints of this fleet that lie so far out, at "
            "most\n";
  text += planted_text(fleet);
  text += "\n" + joint_table(fleet, kMaxJoints).text();
  if (fleet.joints.size() > kMaxJoints)
    text += fmt::format("and {} more: --json has all\n", fleet.joints.size() - kMaxJoints);
  return text;
}

std::string fleet_json(const FleetCalibration& fleet) {
  FleetTextJson joints = FleetTextJson::array();
  for (const CalibratedJoint& joint : fleet.joints) joints.push_back(joint_json(joint));
  FleetTextJson types = FleetTextJson::array();
  for (const FleetCalibration::OfType& type : fleet.types) {
    FleetTextJson tests = FleetTextJson::array();
    for (const JointTrait trait : kAllJointTraits) {
      const OutlierTest& test = type.tests.at(static_cast<std::size_t>(trait));
      tests.push_back({{"name", name(trait)},
                       {"median", json_number(natural(trait, test.median))},
                       {"lowest", json_number(natural(trait, test.lowest))},
                       {"highest", json_number(natural(trait, test.highest))},
                       {"has_fitted_tails", test.has_fitted_tails},
                       {"outside", outliers_in(test)}});
    }
    types.push_back({{"type", text_or_null(type.type)},
                     {"joints", type.members.size()},
                     {"is_compared", type.is_compared()},
                     {"traits", std::move(tests)}});
  }
  FleetTextJson outliers = FleetTextJson::array();
  for (const FleetOutlier& outlier : fleet.outliers) {
    FleetTextJson others = FleetTextJson::array();
    for (const JointTrait trait : outlier.others) others.push_back(name(trait));
    outliers.push_back({{"serial", fleet.joints[outlier.joint].serial},
                        {"kind", name(outlier.trait)},
                        {"value", json_number(outlier.value)},
                        {"median", json_number(outlier.median)},
                        {"expected", json_number(outlier.expected)},
                        {"others", std::move(others)}});
  }
  return json_text(FleetTextJson{{"joints", std::move(joints)},
                                 {"types", std::move(types)},
                                 {"outliers", std::move(outliers)},
                                 {"planted_faults", planted_json(fleet)}});
}

}  // namespace torsio

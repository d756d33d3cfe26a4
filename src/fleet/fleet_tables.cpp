#include "fleet/fleet_tables.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "torsio/core/units.hpp"

namespace torsio {
namespace {

std::string also_text(const FleetOutlier& outlier) {
  std::vector<std::string> names;
  names.reserve(outlier.others.size());
  for (const JointTrait trait : outlier.others) names.emplace_back(name(trait));
  return fmt::format("{}", fmt::join(names, ", "));
}

std::string expected_text(double expected) {
  return expected < 1e-6 ? "< 1e-06" : fmt::format("{:.1g}", expected);
}

/// How many differ from the others, or that none could.
std::string difference_text(const FleetCalibration& fleet) {
  std::size_t compared = 0;
  std::size_t alone = 0;  // joints of a type with too few
  for (const FleetCalibration::OfType& type : fleet.types)
    (type.is_compared() ? compared : alone) += type.members.size();
  if (compared + alone == 0) return {};
  if (compared == 0)
    return fmt::format("; not compared with each other ({}, {} of a type are needed)",
                       plural(alone, "joint"), kLeastMembers);
  std::string text =
      fleet.outliers.size() == 1
          ? "; 1 differs from the others of its type"
          : fmt::format("; {} differ from the others of their type", fleet.outliers.size());
  if (alone > 0)
    text += fmt::format(", {} not compared ({} of a type are needed)", alone, kLeastMembers);
  return text;
}

}  // namespace

const JointTraits& example_of(const FleetCalibration& fleet, const std::string& type) {
  return std::ranges::find_if(fleet.joints,
                              [&](const CalibratedJoint& joint) {
                                return joint.type == type && std::isfinite(joint.traits.rmse);
                              })
      ->traits;
}

std::size_t outliers_in(const OutlierTest& test) {
  return static_cast<std::size_t>(std::ranges::count_if(test.scores, &OutlierScore::is_outlier));
}

std::string short_value(double value) {
  return std::isfinite(value) ? fmt::format("{:.3g}", value) : "-";
}

std::string plural(std::size_t count, const char* one) {
  return fmt::format("{} {}{}", count, one, count == 1 ? "" : "s");
}

std::string head_text(const FleetCalibration& fleet) {
  const auto count_of = [&](const auto& is_counted) {
    return static_cast<std::size_t>(std::ranges::count_if(fleet.joints, is_counted));
  };
  const std::size_t failed =
      count_of([](const CalibratedJoint& joint) { return !joint.failure.empty(); });
  const std::size_t models =
      count_of([](const CalibratedJoint& joint) { return !joint.chosen.empty(); });
  const std::size_t sound = fleet.joints.size() - failed;
  const bool is_measured_only = models == 0 && sound > 0;
  return fmt::format("{}: {}{}", plural(fleet.joints.size(), "joint"),
                     is_measured_only ? fmt::format("{} measured, {} not", sound, failed)
                                      : fmt::format("{} with a model, {} without", models,
                                                    fleet.joints.size() - models),
                     difference_text(fleet));
}

std::string tails_text(const FleetCalibration::OfType& type) {
  const bool is_fitted = std::ranges::any_of(type.tests, &OutlierTest::has_fitted_tails);
  if (is_fitted) return "limits: by the tails of the joints themselves";
  return type.is_compared()
             ? "limits: fewer than 100 joints do not show their tails; a normal distribution "
               "is assumed"
             : fmt::format("no limits: fewer than {} joints cannot be compared", kLeastMembers);
}

std::string kind_text(const FleetCalibration& fleet, const FleetOutlier& outlier) {
  std::string text(name(outlier.trait));
  const JointTraits& traits = fleet.joints[outlier.joint].traits;
  if (outlier.trait == JointTrait::encoder_error)
    text += fmt::format(" ({} periods a turn of {})", traits.encoder_periods, traits.encoder);
  return text;
}

std::string trait_text(const JointTraits::Value& of, double value) {
  if (!std::isfinite(value)) return "-";
  if (of.unit.empty()) return fmt::format("{:+.3g} %", 100.0 * value);
  if (of.unit == "rad") return fmt::format("{:.3g} deg", deg_from_rad(value));
  return fmt::format("{:.3g} {}", value, of.unit);
}

TextTable traits_table(const FleetCalibration& fleet, const FleetCalibration::OfType& type) {
  TextTable table;
  table.header({"trait", "median", "lower limit", "upper limit", "outside"});
  const JointTraits& example = example_of(fleet, type.type);
  for (const JointTrait trait : kAllJointTraits) {
    const OutlierTest& test = type.tests.at(static_cast<std::size_t>(trait));
    const auto text = [&](double value) {
      return trait_text(example[trait], natural(trait, value));
    };
    table.row({std::string(name(trait)), text(test.median), text(test.lowest), text(test.highest),
               fmt::format("{}", outliers_in(test))});
  }
  return table;
}

TextTable outlier_table(const FleetCalibration& fleet) {
  const bool has_plants = std::ranges::any_of(
      fleet.joints, [](const CalibratedJoint& joint) { return !joint.fault.empty(); });
  TextTable table;
  table.header({"joint", "kind", "value", "median", "sound ones expected", "also outside"});
  if (has_plants) table.header({"planted"});
  for (const FleetOutlier& outlier : fleet.outliers) {
    const CalibratedJoint& joint = fleet.joints[outlier.joint];
    const JointTraits::Value& of = joint.traits[outlier.trait];
    std::vector<std::string> row{joint.serial,
                                 kind_text(fleet, outlier),
                                 trait_text(of, outlier.value),
                                 trait_text(of, outlier.median),
                                 expected_text(outlier.expected),
                                 also_text(outlier)};
    if (has_plants) row.push_back(joint.fault.empty() ? "no" : joint.fault);
    table.row(std::move(row));
  }
  return table;
}

TextTable joint_table(const FleetCalibration& fleet, std::size_t max_joints) {
  TextTable table;
  table.header({"joint", "model", "RMSE", "RMSE of the base", "warnings"});
  for (const CalibratedJoint& joint : fleet.joints) {
    if (table.rows().size() == max_joints) break;
    if (joint.chosen.empty()) {
      table.row({joint.serial, "none", "-", short_value(joint.traits.rmse), joint.failure});
      continue;
    }
    const double base = joint.methods.empty() ? kNotMeasured : joint.methods.front().test_rmse;
    table.row({joint.serial, joint.chosen, short_value(joint.test_rmse), short_value(base),
               fmt::format("{}", joint.warnings.size())});
  }
  return table;
}

}  // namespace torsio

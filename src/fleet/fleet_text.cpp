#include "fleet/fleet_text.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "files/json_text.hpp"
#include "report/html/report_parts.hpp"
#include "report/json_text.hpp"
#include "report/result_parts.hpp"
#include "torsio/core/units.hpp"

namespace torsio {
namespace {

using FleetTextJson = nlohmann::ordered_json;

std::string short_value(double value) {
  return std::isfinite(value) ? fmt::format("{:.3g}", value) : "-";
}

/// Tests of sizes are of their logarithms.
double natural(JointTrait trait, double value) { return is_size(trait) ? std::exp(value) : value; }

/// A joint of the type, for the units of its traits.
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

std::string also_text(const FleetOutlier& outlier) {
  std::vector<std::string> names;
  names.reserve(outlier.others.size());
  for (const JointTrait trait : outlier.others) names.emplace_back(name(trait));
  return fmt::format("{}", fmt::join(names, ", "));
}

std::string kind_text(const FleetCalibration& fleet, const FleetOutlier& outlier) {
  std::string text(name(outlier.trait));
  const JointTraits& traits = fleet.joints[outlier.joint].traits;
  if (outlier.trait == JointTrait::encoder_error)
    text += fmt::format(" ({} periods a turn of {})", traits.encoder_periods, traits.encoder);
  return text;
}

std::string expected_text(double expected) {
  return expected < 1e-6 ? "< 1e-06" : fmt::format("{:.1g}", expected);
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

TextTable joint_table(const FleetCalibration& fleet, std::size_t most) {
  TextTable table;
  table.header({"joint", "model", "RMSE", "RMSE of the base", "warnings"});
  for (const CalibratedJoint& joint : fleet.joints) {
    if (table.rows().size() == most) break;
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

std::string plural(std::size_t count, const char* one) {
  return fmt::format("{} {}{}", count, one, count == 1 ? "" : "s");
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

std::string tails_text(const FleetCalibration::OfType& type) {
  const bool is_fitted = std::ranges::any_of(type.tests, &OutlierTest::has_fitted_tails);
  if (is_fitted) return "limits: by the tails of the joints themselves";
  return type.is_compared()
             ? "limits: fewer than 100 joints do not show their tails; a normal distribution "
               "is assumed"
             : fmt::format("no limits: fewer than {} joints cannot be compared", kLeastMembers);
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

/// A trait of all joints of a type in the order of the list, with the limits; `joint` is marked.
XyFigure trait_figure(const FleetCalibration& fleet, const FleetCalibration::OfType& type,
                      JointTrait trait, std::size_t joint) {
  const OutlierTest& test = type.tests.at(static_cast<std::size_t>(trait));
  const std::string& unit = example_of(fleet, type.type)[trait].unit;
  const double scale = unit.empty() ? 100.0 : unit == "rad" ? deg_from_rad(1.0) : 1.0;
  XySeries all{.label = "joints",
               .style = CurveStyle::points,
               .role = CurveRole::measured,
               .x = {},
               .y = {}};
  XySeries outside{.label = "outside", .style = CurveStyle::points, .x = {}, .y = {}};
  XySeries one{.label = "this joint",
               .style = CurveStyle::points,
               .role = CurveRole::upper,
               .x = {},
               .y = {}};
  for (std::size_t m = 0; m < type.members.size(); ++m) {
    const CalibratedJoint& of = fleet.joints[type.members[m]];
    XySeries& series = type.members[m] == joint ? one : test.scores[m].is_outlier ? outside : all;
    series.x.push_back(static_cast<double>(m + 1));
    series.y.push_back(scale * of.traits[trait].value);
    series.names.push_back(of.serial);
  }
  XyFigure figure{.title = std::string(name(trait)),
                  .x = {"joint of the list"},
                  .y = {fmt::format("{} [{}]", name(trait),
                                    unit.empty()    ? "%"
                                    : unit == "rad" ? "deg"
                                                    : unit),
                        is_size(trait)},
                  .series = {std::move(all)}};
  if (!outside.x.empty()) figure.series.push_back(std::move(outside));
  if (!one.x.empty()) figure.series.push_back(std::move(one));
  for (const double limit : {test.lowest, test.highest})
    if (std::isfinite(limit))
      figure.series.push_back(
          {.label = "limit",
           .role = CurveRole::limit,
           .x = {1.0, static_cast<double>(type.members.size())},
           .y = {scale * natural(trait, limit), scale * natural(trait, limit)}});
  return figure;
}

}  // namespace

std::string trait_text(const JointTraits::Value& of, double value) {
  if (!std::isfinite(value)) return "-";
  if (of.unit.empty()) return fmt::format("{:+.3g} %", 100.0 * value);
  if (of.unit == "rad") return fmt::format("{:.3g} deg", deg_from_rad(value));
  return fmt::format("{:.3g} {}", value, of.unit);
}

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

ReportDocument fleet_report(const FleetCalibration& fleet) {
  ReportDocument document{.title = "Calibration of a fleet",
                          .summary = {head_text(fleet) + "."},
                          .sections = {},
                          .origin = {}};
  if (!fleet.outliers.empty())
    document.sections.push_back(
        {.heading = "Joints that differ", .tables = {report_table(outlier_table(fleet))}});
  for (const FleetCalibration::OfType& type : fleet.types) {
    ReportSection section{
        .heading = type.type.empty() ? "All joints" : "Joints of the type " + type.type,
        .text = tails_text(type) + ".",
        .tables = {report_table(traits_table(fleet, type))}};
    for (const JointTrait trait : kAllJointTraits)
      section.figures.emplace_back(trait_figure(fleet, type, trait, fleet.joints.size()));
    document.sections.push_back(std::move(section));
  }
  document.sections.push_back(
      {.heading = "Models", .tables = {report_table(joint_table(fleet, fleet.joints.size()))}});
  return document;
}

ReportDocument fleet_joint_report(const FleetCalibration& fleet, std::size_t joint) {
  const CalibratedJoint& of = fleet.joints[joint];
  const auto outlier = std::ranges::find(fleet.outliers, joint, &FleetOutlier::joint);
  ReportDocument document{
      .title = "Joint " + of.serial, .summary = {}, .sections = {}, .origin = {}};
  document.summary.push_back(!of.failure.empty()
                                 ? "There is no model: " + of.failure
                                 : fmt::format("Its model is '{}' with an RMSE of {} in the test.",
                                               of.chosen, short_value(of.test_rmse)));
  if (outlier != fleet.outliers.end())
    document.summary.push_back(fmt::format(
        "It differs from the others of its type: {} {}, median {}.", kind_text(fleet, *outlier),
        trait_text(of.traits[outlier->trait], outlier->value),
        trait_text(of.traits[outlier->trait], outlier->median)));
  TextTable methods;
  methods.header({"method", "held-out RMSE", "test RMSE"});
  for (const CalibratedJoint::Method& method : of.methods)
    methods.row({method.name, short_value(method.held_out_rmse), short_value(method.test_rmse)});
  document.sections.push_back({.heading = "Models", .tables = {report_table(methods)}});
  TextTable traits;
  traits.header({"trait", "value", "standard error"});
  for (const JointTrait trait : kAllJointTraits) {
    const JointTraits::Value& value = of.traits[trait];
    traits.row({std::string(name(trait)), trait_text(value, value.value),
                trait_text(value, value.std_error)});
  }
  ReportSection section{.heading = "Traits", .tables = {report_table(traits)}};
  for (const FleetCalibration::OfType& type : fleet.types)
    if (type.type == of.type && std::isfinite(of.traits.rmse))
      for (const JointTrait trait : kAllJointTraits)
        section.figures.emplace_back(trait_figure(fleet, type, trait, joint));
  document.sections.push_back(std::move(section));
  if (!of.warnings.empty()) {
    ReportTable warnings{.headings = {"warnings of the checks"}, .rows = {}, .is_words = true};
    for (const std::string& warning : of.warnings) warnings.rows.push_back({{warning}});
    document.sections.push_back({.heading = "Checks", .tables = {std::move(warnings)}});
  }
  return document;
}

}  // namespace torsio

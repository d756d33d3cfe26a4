#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "fleet/fleet_tables.hpp"
#include "fleet/fleet_text.hpp"
#include "report/html/report_parts.hpp"
#include "torsio/core/units.hpp"

namespace torsio {
namespace {

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

#include <fmt/format.h>

#include <array>
#include <cstddef>
#include <utility>

#include "report/html/arm_figures.hpp"
#include "report/html/report_parts.hpp"
#include "report/html/time_figure_builder.hpp"
#include "torsio/arm/arm_dynamics.hpp"
#include "torsio/core/units.hpp"
#include "torsio/report/html/verb_reports.hpp"

namespace torsio {
namespace {

constexpr std::size_t kPosesDrawn = 6;
constexpr double kContactMark_s = 0.05;

/// Origins of base, links and flange in one pose.
std::vector<Vector3> skeleton(const ArmDynamics& dynamics, std::span<const double> angle_rad) {
  std::vector<Vector3> points{{0.0, 0.0, 0.0}};
  for (std::size_t j = 0; j < dynamics.size(); ++j)
    points.push_back(dynamics.link(j, angle_rad).position_m);
  points.push_back(dynamics.flange(angle_rad).position_m);
  return points;
}

XyFigure view(const std::string& title, std::size_t across, std::size_t up, const char* x,
              const char* y, const std::vector<std::vector<Vector3>>& skeletons,
              const std::vector<std::string>& labels) {
  XyFigure figure{.title = title, .x = {x}, .y = {y}, .series = {}, .is_equal = true};
  for (std::size_t p = 0; p < skeletons.size(); ++p) {
    XySeries line{.label = labels[p], .x = {}, .y = {}};
    for (const Vector3& point : skeletons[p]) {
      line.x.push_back(point[across]);
      line.y.push_back(point[up]);
    }
    figure.series.push_back(std::move(line));
  }
  return figure;
}

TimeFigure torques(const ArmRun& run) {
  TimeFigureBuilder builder("Torques of the joints", run.record, 3 * run.scores.size(), {},
                            values_of_figure(run.record.size()));
  for (std::size_t j = 0; j < run.scores.size(); ++j) {
    builder.panel(run.scores[j].joint + " [Nm]");
    const auto add = [&](const char* label, CurveRole role, const char* name) {
      builder.add(label, role, true, run.record.channel(run.joint_channel(j, name)).values);
    };
    add("load cell", CurveRole::measured, "torque_Nm");
    add("estimated", CurveRole::model, "estimated_torque_Nm");
    add("external", CurveRole::limit, "external_torque_Nm");
  }
  // Where contacts were found, and which of them are false alarms.
  for (const ArmContact& contact : run.contacts)
    builder.mark({.begin_s = contact.found_s,
                  .end_s = contact.found_s + kContactMark_s,
                  .label = fmt::format("contact in {}{}", contact.joint,
                                       contact.latency_s ? "" : ", a false alarm"),
                  .is_failure = !contact.latency_s});
  return builder.finish();
}

TextTable contact_table(const ArmRun& run) {
  TextTable table;
  table.header({"found at [s]", "joint", "after [ms]", "reaction"});
  for (const ArmContact& contact : run.contacts)
    table.row({fmt::format("{:.3f}", contact.found_s), contact.joint,
               contact.latency_s ? fmt::format("{:.0f}", 1e3 * *contact.latency_s)
                                 : std::string("false alarm"),
               std::string(name(contact.reaction))});
  return table;
}

TextTable impact_table(const ArmImpact& impact) {
  const auto force = [](const std::optional<double>& value) {
    return value ? fmt::format("{:.0f}", *value) : std::string("-");
  };
  TextTable table;
  table.header({"touched at [s]", "first peak [N]", "largest [N]", "later than 80 ms [N]",
                "after 0.5 s [N]"});
  table.row({fmt::format("{:.3f}", impact.touched_s), fmt::format("{:.0f}", impact.first_peak_N),
             fmt::format("{:.0f}", impact.peak_N), force(impact.largest_late_N),
             force(impact.rest_N)});
  return table;
}

/// The force of a plate over time.
TimeFigure plate_force(const ArmRun& run) {
  TimeFigureBuilder builder("Force of the plate", run.record, 1, {},
                            values_of_figure(run.record.size()));
  builder.panel("force [N]");
  builder.add("plate", CurveRole::measured, true, run.record.channel("plate_force_N").values);
  return builder.finish();
}

}  // namespace

std::vector<ReportFigure> arm_figures(const ArmModel& arm,
                                      const std::vector<std::vector<double>>& poses_rad,
                                      const std::vector<std::string>& labels) {
  const ArmDynamics dynamics(arm);
  std::vector<std::vector<Vector3>> skeletons;
  skeletons.reserve(poses_rad.size());
  for (const std::vector<double>& pose : poses_rad) skeletons.push_back(skeleton(dynamics, pose));
  std::vector<ReportFigure> figures;
  figures.emplace_back(view("The arm from the side", 0, 2, "x [m]", "z [m]", skeletons, labels));
  figures.emplace_back(view("The arm from above", 0, 1, "x [m]", "y [m]", skeletons, labels));
  return figures;
}

TextTable arm_scores(const ArmRun& run) {
  const auto scored = [](const std::optional<double>& value, double scale, int digits) {
    return value ? fmt::format("{:.{}f}", scale * *value, digits) : std::string("-");
  };
  TextTable table;
  table.header({"joint", "actuator", "position [mrad]", "torque [Nm]", "external torque [Nm]",
                "largest torque [Nm]", "of the rating [%]", "limited [s]"});
  for (const ArmJointScore& score : run.scores)
    table.row({score.joint, score.actuator, scored(score.position_rmse_rad, 1e3, 2),
               scored(score.torque_rmse_Nm, 1.0, 3), scored(score.external_rmse_Nm, 1.0, 3),
               fmt::format("{:.1f}", score.largest_torque_Nm),
               fmt::format("{:.0f}", 100.0 * score.largest_share),
               fmt::format("{:.2f}", score.limited_s)});
  return table;
}

ReportDocument arm_report(const ArmSetup& setup, const ArmRun& run,
                          std::vector<std::string> summary) {
  summary.emplace_back(
      "Geometry, friction and noise are those of the arm's file and of data sheets; a real arm "
      "differs.");
  ReportDocument document{.title = "Arm " + setup.arm.name,
                          .summary = std::move(summary),
                          .sections = {},
                          .origin = {}};
  ReportSection scores{.heading = "Joints",
                       .text = "Position, torque and external torque: RMSE to the true values."};
  scores.tables.push_back(report_table(arm_scores(run)));
  document.sections.push_back(std::move(scores));
  if (!run.contacts.empty() || run.impact) {
    ReportSection contacts{
        .heading = "Contacts",
        .text =
            "Found where the external torque of a joint is above its threshold. The time after "
            "a contact began, and the force of the plate, are those of the simulation."};
    if (!run.contacts.empty()) contacts.tables.push_back(report_table(contact_table(run)));
    if (run.impact) contacts.tables.push_back(report_table(impact_table(*run.impact)));
    if (run.record.has("plate_force_N")) contacts.figures.emplace_back(plate_force(run));
    document.sections.push_back(std::move(contacts));
  }

  std::vector<std::vector<double>> poses;
  std::vector<std::string> labels;
  const std::size_t samples = run.record.size();
  for (std::size_t p = 0; p < kPosesDrawn && samples > 0; ++p) {
    const std::size_t n = p * (samples - 1) / (kPosesDrawn - 1);
    std::vector<double>& pose = poses.emplace_back();
    for (const Recording& joint : run.joints)
      pose.push_back(joint.channel("joint_angle_rad").values[n]);
    labels.push_back(fmt::format("{:.1f} s", run.record.time_s(n)));
  }
  document.sections.push_back(
      {.heading = "Poses", .figures = arm_figures(setup.arm, poses, labels)});
  ReportSection over_time{.heading = "Over time"};
  over_time.figures.emplace_back(torques(run));
  document.sections.push_back(std::move(over_time));
  return document;
}

}  // namespace torsio

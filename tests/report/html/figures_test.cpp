#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <variant>
#include <vector>

#include "report/html/loop_report.hpp"
#include "report/html/speed_loops.hpp"
#include "report/html/time_figure_builder.hpp"
#include "report/monitor.hpp"
#include "torsio/actuator/joint_parameters.hpp"
#include "torsio/control/design/linear_system.hpp"
#include "torsio/control/torque_controller.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/units.hpp"
#include "torsio/report/html/verb_reports.hpp"
#include "torsio/sim/bench/sheet_file.hpp"
#include "torsio/sim/closed_loop/tracking.hpp"

namespace torsio {
namespace {

using testing::HasSubstr;

constexpr double kTurn = 2.0 * std::numbers::pi;

/// Triangles with three speeds; the torque is proportional to the deflection and has friction that rises with the speed.
struct Motion {
  std::vector<double> deflection_rad;
  std::vector<double> torque_Nm;
};
Motion motion_at(const std::vector<double>& speeds_rad_s) {
  constexpr double kAmplitude_rad = 0.1;
  constexpr double kRate_Hz = 200.0;
  Motion motion;
  for (const double speed_rad_s : speeds_rad_s)
    for (int ramp = 0; ramp < 4; ++ramp) {
      const auto samples = static_cast<int>(2.0 * kAmplitude_rad / speed_rad_s * kRate_Hz);
      const double direction = ramp % 2 == 0 ? 1.0 : -1.0;
      for (int n = 0; n < samples; ++n) {
        motion.deflection_rad.push_back(direction *
                                        (2.0 * kAmplitude_rad * n / samples - kAmplitude_rad));
        motion.torque_Nm.push_back(100.0 * motion.deflection_rad.back() +
                                   direction * 10.0 * speed_rad_s);
      }
    }
  return motion;
}

/// Mean of the rising less the falling branch.
double height_Nm(const XySeries& loop) {
  double sum = 0.0;
  int count = 0;
  const std::size_t bins = loop.y.size() / 2;
  for (std::size_t k = 0; k < bins; ++k) {
    const double height = loop.y[k] - loop.y[loop.y.size() - 1 - k];
    if (!std::isfinite(height)) continue;
    sum += height;
    ++count;
  }
  return sum / count;
}

TEST(SpeedLoops, SeparateAFrictionThatRisesWithTheSpeed) {
  const Motion motion = motion_at({0.02, 0.02, 0.02, 0.02, 0.02, 0.1, 0.5, 0.5, 0.5, 0.5});
  const XyFigure figure = speed_loops("spring_deflection_rad", motion.deflection_rad, "torque_Nm",
                                      motion.torque_Nm, 200.0);
  ASSERT_GE(figure.series.size(), 2U);
  EXPECT_THAT(figure.x.label, HasSubstr("[rad]"));
  EXPECT_THAT(figure.series.front().label, HasSubstr("deg/s"));
  EXPECT_NEAR(height_Nm(figure.series.front()), 2.0 * 10.0 * 0.02, 0.15);
  EXPECT_GT(height_Nm(figure.series.back()), 1.5 * height_Nm(figure.series.front()));
}

TEST(SpeedLoops, HaveOneBandAtOneSpeedAndNoneAtRest) {
  const Motion motion = motion_at({0.1, 0.1, 0.1});
  const XyFigure one = speed_loops("spring_deflection_rad", motion.deflection_rad, "torque_Nm",
                                   motion.torque_Nm, 200.0);
  ASSERT_EQ(one.series.size(), 1U);
  EXPECT_EQ(one.series.front().label, "all speeds");
  EXPECT_NEAR(height_Nm(one.series.front()), 2.0 * 10.0 * 0.1, 0.3);
  const std::vector<double> rest(1000, 0.2);
  EXPECT_TRUE(speed_loops("spring_deflection_rad", rest, "torque_Nm", rest, 200.0).series.empty());
}

TEST(SpeedLoops, LabelARateWithItsUnit) {
  EXPECT_EQ(rate_label("spring_deflection_rad"), "d/dt spring_deflection_rad [rad/s]");
  EXPECT_EQ(rate_label("joint_speed_rad_s"), "d/dt joint_speed_rad_s [rad/s2]");
  EXPECT_EQ(rate_label("abs(support_m)"), "d/dt abs(support_m) [1/s]");
}

/// An integrator with two samples of delay: phase -90 deg less the delay.
LinearSystem delayed_integrator(double gain) {
  constexpr double kRate_Hz = 1000.0;
  return LinearSystem::integrator(kRate_Hz) * LinearSystem::delay(kRate_Hz) *
         LinearSystem::delay(kRate_Hz) * LinearSystem::gain(gain, kRate_Hz);
}

TEST(LoopFigures, DrawTheMarginsOnTheCurves) {
  const DrawnLoop loop{"output locked", delayed_integrator(100.0)};
  const Margins margin = margins(loop.loop);
  const std::vector<ReportFigure> figures = loop_figures({&loop, 1});
  ASSERT_EQ(figures.size(), 3U);
  const auto& magnitude = std::get<XyFigure>(figures[0]);
  const auto& phase = std::get<XyFigure>(figures[1]);
  const auto& nyquist = std::get<XyFigure>(figures[2]);
  const XySeries& at = magnitude.series[1];
  EXPECT_EQ(at.label, "margins");
  ASSERT_EQ(at.names.size(), 2U);
  EXPECT_NEAR(at.x[0], margin.crossover_rad_s / kTurn, 1e-6);
  EXPECT_NEAR(at.y[0], 1.0, 1e-4);
  EXPECT_NEAR(at.y[1], 1.0 / margin.gain, 1e-4);
  EXPECT_NEAR(phase.series[1].y[0], -180.0 + deg_from_rad(margin.phase_rad), 0.01);
  EXPECT_NEAR(phase.series[1].y[1], -180.0, 0.01);
  EXPECT_NEAR(nyquist.series[1].x[1], -1.0 / margin.gain, 1e-4);
  EXPECT_TRUE(nyquist.is_equal);
  for (std::size_t k = 1; k < phase.series[0].y.size(); ++k)
    EXPECT_LT(std::abs(phase.series[0].y[k] - phase.series[0].y[k - 1]), 30.0) << k;
}

TEST(LoopSection, StatesTheMarginsOfEachLoop) {
  const std::vector<DrawnLoop> loops = {{"slow", delayed_integrator(10.0)},
                                        {"fast", delayed_integrator(200.0)}};
  const ReportSection section = loop_section(loops);
  ASSERT_EQ(section.tables.front().rows.size(), 2U);
  EXPECT_GT(std::stod(section.tables.front().rows[0].cells[1]),
            std::stod(section.tables.front().rows[1].cells[1]));
}

TEST(LoopSection, HasForTrackTheLoopOfItsController) {
  const DataSheet sheet = find_data_sheet("dfki-120");
  TrackingSpec spec;
  const TorqueLoopCore core({.deflection = {.joint = series_elastic_joint(sheet),
                                            .bandwidth_rad_s = spec.bandwidth_rad_s,
                                            .damping = spec.damping}},
                            1000.0);
  const Margins of_controller = core.margins_of(JointOutput::locked);
  const Margins of_track = margins(open_torque_loop(sheet, spec));
  EXPECT_NEAR(of_track.phase_rad, of_controller.phase_rad, 1e-9);
  EXPECT_NEAR(of_track.gain, of_controller.gain, 1e-9);
  spec.actuation = DeflectionController::Actuation::velocity;
  EXPECT_THROW((void)open_torque_loop(sheet, spec), UsageError);
}

Recording faulty_recording() {
  Recording recording("elbow", 100.0);
  recording.add({.name = "joint_angle_rad", .values = {0.0, 0.1, 0.2, 0.3}});
  recording.add({.name = "estimated_torque_Nm", .values = {1.0, 1.1, 1.2, 1.3}});
  recording.add({.name = "gear_fault_1", .values = {3.0, 0.0, 0.0, 1.0}});
  recording.add({.name = "monitor_state_1", .values = {0.0, 1.0, 2.0, 3.0}});
  return recording;
}

TEST(TimeFigureBuilder, NamesTheValuesOfFaultsAndStates) {
  const TimeFigure figure = channels_figure(faulty_recording(), "channels", {}, {});
  ASSERT_EQ(figure.panels.size(), 4U);
  EXPECT_TRUE(figure.panels[0].value_names.empty());
  EXPECT_EQ(figure.panels[2].value_names.at(3), name(Fault::warming_up));
  EXPECT_EQ(figure.panels[2].value_names.size(), kFaultCount);
  EXPECT_EQ(figure.panels[3].value_names.back(), "stopped");
}

TEST(MonitorReport, HasARowForEachFinding) {
  MonitorReplay replay{.estimated = {.channels = faulty_recording(), .faults = {}},
                       .suspects = {"gear encoder"}};
  replay.watching_from_s = 0.01;
  replay.stopped_at_s = 0.03;
  MonitorReplay::Finding finding;
  finding.t_s = 0.03;
  finding.fault = Fault::diverged;
  replay.events.push_back(finding);
  replay.injections.push_back({.fault = "encoder jumps", .start_s = 0.02});
  const ReportDocument document = monitor_report({replay}, {});
  const ReportSection& findings = document.sections.front();
  ASSERT_EQ(findings.tables.size(), 2U);
  ASSERT_EQ(findings.tables[0].rows.size(), 1U);
  EXPECT_THAT(findings.tables[0].rows[0].cells[1], HasSubstr("stop at 0.030 s"));
  EXPECT_EQ(findings.tables[0].rows[0].cells[2], "gear encoder");
  ASSERT_EQ(findings.tables[1].rows.size(), 2U);
  EXPECT_EQ(findings.tables[1].rows[0].cells[1], "0.030");
  EXPECT_EQ(findings.tables[1].rows[0].cells[5], name(Fault::diverged));
  EXPECT_THAT(findings.tables[1].rows[1].cells[4], HasSubstr("encoder jumps: stop after 10 ms"));
}

}  // namespace
}  // namespace torsio

#include "torsio/actuator/controller_file.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <string_view>

#include "support/error_message.hpp"
#include "torsio/actuator/joint_parameters.hpp"

namespace torsio {
namespace {

using testing::AllOf;
using testing::HasSubstr;

ControllerFile example(DeflectionController::Actuation actuation) {
  const DataSheet sheet = data_sheet("dfki-120");
  const SeriesElasticJoint joint = series_elastic_joint(sheet);
  const double rated_Nm = joint.drive.rated_current_A * joint.drive.torque_per_current();
  return {.actuator = "dfki-120",
          .sample_rate_Hz = 1000.0,
          .settings = {.torque = {.deflection = {.joint = joint,
                                                 .actuation = actuation,
                                                 .bandwidth_rad_s = 31.0 / 3.0}},
                       .limits = {.lowest_rad = -0.7,
                                  .speed_rad_s = speed_limit_of(sheet),
                                  .max_unmeasured_load_Nm = 0.05 * rated_Nm,
                                  .max_measured_load_Nm = 0.6 * rated_Nm}},
          .stop = joint_stop_settings(sheet, 10.0)};
}

void expect_same(const ControllerFile& found, const ControllerFile& expected) {
  const DeflectionController::Settings& a = found.settings.torque.deflection;
  const DeflectionController::Settings& b = expected.settings.torque.deflection;
  EXPECT_EQ(found.actuator, expected.actuator);
  EXPECT_EQ(found.sample_rate_Hz, expected.sample_rate_Hz);
  EXPECT_EQ(a.joint.stiffness_Nm_rad, b.joint.stiffness_Nm_rad);
  EXPECT_EQ(a.joint.drive.resistance_Ohm, b.joint.drive.resistance_Ohm);
  EXPECT_EQ(a.bandwidth_rad_s, b.bandwidth_rad_s);
  EXPECT_EQ(a.actuation, b.actuation);
  EXPECT_EQ(a.gains.has_value(), b.gains.has_value());
  EXPECT_EQ(found.settings.limits.lowest_rad, expected.settings.limits.lowest_rad);
  EXPECT_EQ(found.settings.limits.highest_rad, expected.settings.limits.highest_rad);
  EXPECT_EQ(found.settings.torque.observer_cutoff_Hz, expected.settings.torque.observer_cutoff_Hz);
  ASSERT_EQ(found.stop.has_value(), expected.stop.has_value());
  if (found.stop) {
    EXPECT_EQ(found.stop->brake_static_Nm, expected.stop->brake_static_Nm);
    EXPECT_EQ(found.stop->drive.ratio, expected.stop->drive.ratio);
  }
  // All that is written.
  EXPECT_EQ(controller_yaml(found), controller_yaml(expected));
}

TEST(ControllerFiles, ReadBackBitForBit) {
  using Actuation = DeflectionController::Actuation;
  ControllerFile file = example(Actuation::velocity);
  expect_same(parse_controller(controller_yaml(file), "a.yaml"), file);
  file = example(Actuation::current);
  file.settings.torque.deflection.bandwidth_rad_s = 50.0;
  file.settings.torque.deflection.gains = Pid::Gains{100.0, 20.0 / 3.0, 5.0};
  file.settings.torque.friction = FrictionCompensation{.share = 0.3, .speed_rad_s = 0.01};
  file.settings.torque.feeds_rate_forward = true;
  file.settings.torque.largest_torque_Nm = 80.0;
  file.settings.gains = JointCascade::gains_for(file.settings.torque.deflection.joint.drive, 40.0);
  file.stop = std::nullopt;
  file.actuator = "an \"arm\": joint #1";
  expect_same(parse_controller(controller_yaml(file), "b.yaml"), file);
}

std::string with(std::string text, std::string_view from, std::string_view to) {
  const std::size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return text.replace(at, from.size(), to);
}

std::string complaint(const std::string& text) {
  return test::error_message([&] { (void)parse_controller(text, "loop.yaml"); });
}

TEST(ControllerFiles, NameFileLineAndWhatIsWrong) {
  const std::string text = controller_yaml(example(DeflectionController::Actuation::velocity));
  EXPECT_EQ(complaint(text), "");
  EXPECT_THAT(complaint(with(text, "torsio.controller", "torsio.model")),
              AllOf(HasSubstr("loop.yaml"), HasSubstr("tune-loop")));
  EXPECT_THAT(complaint(with(text, "version: 1", "version: 2")), HasSubstr("version"));
  EXPECT_THAT(complaint(with(text, "damping", "dampening")),
              AllOf(HasSubstr("dampening"), HasSubstr("damping")));
  EXPECT_THAT(complaint(with(text, "  damping: 0.9\n", "")), HasSubstr("damping"));
  EXPECT_THAT(complaint(with(text, "damping: 0.9", "damping: high")), HasSubstr("number"));
  EXPECT_THAT(complaint(with(text, "damping: 0.9", "damping: .nan")), HasSubstr("damping"));
  EXPECT_THAT(complaint(with(text, "damping: 0.9", "damping: -1")), HasSubstr("damping"));
  EXPECT_THAT(complaint(with(text, "actuation: velocity", "actuation: torque")),
              HasSubstr("current or velocity"));
  EXPECT_THAT(complaint(with(text, "anti_windup: conditional", "anti_windup: none")),
              HasSubstr("back_calculation"));
  EXPECT_THAT(complaint(with(text, "sample_rate_Hz: 1000", "sample_rate_Hz: 0")),
              HasSubstr("sample_rate_Hz"));
  EXPECT_THAT(
      complaint(with(text, "  feeds_rate_forward: false\n", "  friction_speed_rad_s: 0.1\n")),
      HasSubstr("friction_share"));
  EXPECT_THAT(complaint(with(text, "bandwidth_rad_s: 10.333333333333334", "bandwidth_rad_s: 900")),
              HasSubstr("stable"));
  EXPECT_THAT(complaint("[]"), HasSubstr("loop.yaml"));
  EXPECT_THAT(complaint(""), HasSubstr("loop.yaml"));
}

TEST(ControllerFiles, EveryTruncatedFileIsRefused) {
  const std::string text = controller_yaml(example(DeflectionController::Actuation::velocity));
  for (std::size_t length = 0; length < text.find("limits:"); ++length)
    EXPECT_NE(complaint(text.substr(0, length)), "") << length;
}

}  // namespace
}  // namespace torsio

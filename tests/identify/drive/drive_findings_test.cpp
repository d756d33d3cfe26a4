// What the checks before and after a fit find, and what they do not.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include "identify/drive/drive_checks.hpp"
#include "identify/drive/drive_logs.hpp"
#include "identify/drive/known_servo.hpp"
#include "identify/drive/servo_recordings.hpp"
#include "support/error_message.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/units.hpp"
#include "torsio/identify/drive/identify_drive.hpp"
#include "torsio/sim/experiments/experiment.hpp"

namespace torsio {
namespace {

using test::error_message;
using ::testing::AllOf;
using ::testing::Contains;
using ::testing::Field;
using ::testing::HasSubstr;
using ::testing::Not;
using testing::servo_recording;

LoadSheet hanging_mass(const std::string& mass = "0.5kg") {
  return parse_load_sheet("load: {pendulum: {mass: " + mass + ", length: 0.1m}}", "load.yaml");
}

DriveSheet servo_law() {
  return parse_drive_sheet(
      "drive: {law: position, gain: kp_1, error_gain: 0.003, supply: supply_V}", "drive.yaml");
}

/// The same recording with other values of some channels.
Recording changed(const Recording& from, const std::string& name,
                  const std::function<void(Channel&)>& change) {
  Recording recording(name, from.sample_rate_Hz());
  for (Channel channel : from.channels()) {
    change(channel);
    recording.add(std::move(channel));
  }
  return recording;
}

Recording without_power(const Recording& from, const std::string& name) {
  return changed(from, name, [](Channel& channel) {
    if (channel.name == "enabled_1") std::ranges::fill(channel.values, 0.0);
  });
}

std::vector<DriveFinding> findings_before(const std::vector<Recording>& recordings,
                                          const LoadSheet& load = hanging_mass()) {
  return check_drive_logs(recordings, drive_logs(recordings, load, servo_law()));
}

auto has_subject(const std::string& subject) {
  return Contains(Field(&DriveFinding::subject, subject));
}

TEST(DriveFindings, OfSaturationDoNotCountRecordingsWithoutPower) {
  const Recording saturated = servo_recording({}, 1e6, 0.7, 0.8, false, 1);
  const std::vector<Recording> recordings{saturated, without_power(saturated, "off"),
                                          without_power(saturated, "off again")};
  EXPECT_THAT(findings_before(recordings), has_subject("saturation"));
  EXPECT_THAT(findings_before({servo_recording({}, 200.0, 0.7, 0.3, false, 1), recordings[1]}),
              Not(has_subject("saturation")));
}

TEST(DriveFindings, NameTheGearRatioThatIsMissing) {
  const Recording geared =
      changed(servo_recording({}, 200.0, 0.7, 0.3, false, 1), "geared", [](Channel& channel) {
        if (channel.name != "joint_angle_rad") return;
        channel.name = "motor_angle_rad";
        for (double& value : channel.values) value *= 50.0;
      });
  const std::vector<DriveFinding> findings = findings_before({geared});
  EXPECT_THAT(findings,
              Contains(Field(&DriveFinding::text, AllOf(HasSubstr("times as far as its goal"),
                                                        HasSubstr("gear_ratio")))));
  EXPECT_THAT(findings, Not(has_subject("saturation")));
}

TEST(DriveFindings, OfARepeatCompareLoadSupplyAndPower) {
  const Recording first = servo_recording({}, 200.0, 0.7, 0.3, false, 1);
  const Recording again = servo_recording({}, 200.0, 0.7, 0.3, false, 2);
  EXPECT_THAT(findings_before({first, again}), Not(has_subject("repeat")));
  EXPECT_THAT(findings_before({first, without_power(again, "off")}), has_subject("repeat"));
  const Recording other_supply = changed(again, "12 V", [](Channel& channel) {
    if (channel.name == "supply_V") std::ranges::fill(channel.values, 12.0);
  });
  EXPECT_THAT(findings_before({first, other_supply}), has_subject("repeat"));
  std::vector<Recording> masses{first, again};
  masses[0].add_condition("mass_kg", 0.5);
  masses[1].add_condition("mass_kg", 1.0);
  EXPECT_THAT(findings_before(masses, hanging_mass("mass_kg")), has_subject("repeat"));
}

std::string refused(const std::function<void(Channel&)>& change) {
  std::vector<Recording> recordings;
  for (const Recording& recording : testing::servo_recordings({}))
    recordings.push_back(changed(recording, recording.name(), change));
  return error_message([&] {
    (void)identify_drive(recordings, hanging_mass(), servo_law(),
                         {.terms = drive_terms({DriveTerm::base, DriveTerm::delay}),
                          .starts = 1,
                          .has_standard_errors = false});
  });
}

TEST(DriveFindings, RefuseAnAngleThatCountsInTheOtherDirection) {
  EXPECT_THAT(refused([](Channel& channel) {
                if (channel.name == "joint_angle_rad")
                  for (double& value : channel.values) value = -value;
              }),
              AllOf(HasSubstr("does not explain the motion"), HasSubstr("'sign: -1'"),
                    Not(HasSubstr("'zero:"))));
}

TEST(DriveFindings, RefuseAZeroThatIsNotWhereTheLoadHangs) {
  EXPECT_THAT(refused([](Channel& channel) {
                if (channel.name.ends_with("angle_rad"))
                  for (double& value : channel.values) value += std::numbers::pi;
              }),
              AllOf(HasSubstr("'zero: 180deg'"), Not(HasSubstr("sign"))));
}

/// An elastic joint, identified as one mass from the motor's angle.
std::vector<DriveFinding> findings_of_one_mass(bool has_joint_angle) {
  std::vector<Recording> recordings;
  for (std::uint64_t seed = 1; seed < 3; ++seed) {
    ExperimentSpec spec{.actuator = "dfki-50",
                        .experiment = "air-chirp",
                        .seed = seed,
                        .duration_s = 8.0,
                        .lever_m = 0.2,
                        .mass_kg = 9.0};
    const Recording both = simulate(spec);
    Recording recording(both.name() + std::to_string(seed), both.sample_rate_Hz());
    for (const Channel& channel : both.channels())
      if (has_joint_angle ||
          (channel.name != "joint_angle_rad" && channel.name != "gear_angle_rad"))
        recording.add(channel);
    recordings.push_back(std::move(recording));
  }
  const LoadSheet load =
      parse_load_sheet("load: {pendulum: {mass: mass_kg, length: lever_m}}", "load.yaml");
  using enum DriveTerm;
  return identify_drive(recordings, load, assumed_drive_sheet(recordings.front()),
                        {.terms = drive_terms({base, delay, load_friction, direction}),
                         .starts = 1,
                         .has_standard_errors = false})
      .findings;
}

TEST(DriveFindings, SuggestASpringWhereTheAnglesOfMotorAndJointDiffer) {
  EXPECT_THAT(findings_of_one_mass(true),
              Contains(AllOf(Field(&DriveFinding::subject, "spring"),
                             Field(&DriveFinding::text,
                                   AllOf(HasSubstr("of the motor after the gear and of the joint"),
                                         HasSubstr("--spring"))))));
}

TEST(DriveFindings, SuggestASpringWhereADelayAtItsBoundReplacesOne) {
  EXPECT_THAT(
      findings_of_one_mass(false),
      Contains(AllOf(Field(&DriveFinding::subject, "spring"),
                     Field(&DriveFinding::text, HasSubstr("at the bound of its range, and")))));
}

TEST(DriveFindings, DoNotBlameTheLoadForADirectionThatCanBeTrue) {
  const std::vector<Recording> recordings{servo_recording({}, 200.0, 0.7, 0.3, false, 1)};
  DriveIdentification identified = testing::known_servo();
  identified.terms = drive_terms({DriveTerm::base, DriveTerm::direction});
  identified.parameters = {
      {.parameter = DriveParameter::direction, .value = -1.0, .is_at_bound = true}};
  at(identified.values, DriveParameter::direction) = -1.0;
  const std::vector<DriveFinding> findings = check_identified(
      recordings, drive_logs(recordings, identified.load, identified.drive), identified);
  EXPECT_THAT(findings,
              Contains(Field(&DriveFinding::text,
                             AllOf(HasSubstr("only the torque of gravity counts"),
                                   HasSubstr("That can be so"), Not(HasSubstr("is wrong"))))));
}

}  // namespace
}  // namespace torsio

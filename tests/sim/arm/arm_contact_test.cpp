#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <string>
#include <vector>

#include "sim/arm/arm_energy_audit.hpp"
#include "support/arm_drives.hpp"
#include "support/error_message.hpp"
#include "support/temporary_folder.hpp"
#include "torsio/core/units.hpp"
#include "torsio/sim/arm/arm_run.hpp"

namespace torsio {
namespace {

using testing::AllOf;
using testing::HasSubstr;

const std::vector<double> kContactStart = {0.0, -1.05, 1.75, 0.0, 0.7, 0.0};

/// Thresholds far above the errors of linear springs with 8 kg.
ContactDetector::Settings coarse_contacts() {
  ContactDetector::Settings settings;
  for (const double sigma_Nm : {1.5, 4.5, 2.5, 0.8, 1.1, 0.2})
    settings.joints.push_back(
        {.error = {.coefficients = {sigma_Nm * sigma_Nm, 0.0, 0.0, 0.0}}, .factor = 4.0});
  return settings;
}

/// The flange moves down onto a plate that is 60 mm below it.
ArmRunSpec onto_a_plate(ContactReaction reaction) {
  ArmStep move{.task = ArmTask::move, .to_rad = {0.0, -0.7, 1.75, 0.0, 0.7, 0.0}};
  move.plate = ArmPlate{.at_m = {0.0, 0.0, -0.06}, .normal = {0.0, 0.0, 1.0}};
  return {.program = {.start_rad = kContactStart,
                      .steps = {{.task = ArmTask::hold, .duration_s = 0.8},
                                std::move(move),
                                {.task = ArmTask::hold, .duration_s = 2.0}},
                      .reaction = reaction},
          .contacts = coarse_contacts(),
          .has_gear_stage = false};
}

// What the plate does to the arm is stored in its stiffness and motion, or lost in its damping.
TEST(ArmPlate, KeepsTheEnergyBalance) {
  for (const double mass_kg : {0.0, 4.4}) {
    ArmPlant arm(test::arm6_with_8_kg(), test::arm6_drives(), FirstStageForm::rigid, 2e-5);
    ASSERT_EQ(arm.reset(kContactStart), Fault::none);
    const Vector3 flange_m = arm.dynamics().flange(kContactStart).position_m;
    arm.use(ArmPlate{.at_m = {flange_m[0], flange_m[1], flange_m[2] - 0.01},
                     .normal = {0.0, 0.0, 1.0},
                     .mass_kg = mass_kg});
    ArmEnergyAudit audit(arm);
    const std::vector<PlantCommand> commands(6);  // it falls
    double largest_N = 0.0;
    double work_J = 0.0;  // done by the plate on the arm
    ArmDynamics::PerJoint last_rad_s = {};
    for (int n = 0; n < 15'000; ++n) {
      ASSERT_EQ(arm.step(commands, {}, 2e-5), Fault::none);
      audit.observe(arm, 2e-5);
      for (std::size_t j = 0; j < arm.size(); ++j) {
        const double speed_rad_s = arm.state(j).joint_speed_rad_s;
        work_J += arm.external_torque(j) * 1e-5 * (last_rad_s[j] + speed_rad_s);
        last_rad_s[j] = speed_rad_s;
      }
      largest_N = std::max(largest_N, arm.plate()->force_N());
    }
    EXPECT_GT(largest_N, 50.0);
    EXPECT_LT(std::abs(audit.residual()), 2e-3 * audit.throughput()) << mass_kg;
    std::vector<double> angle_rad;
    for (std::size_t j = 0; j < arm.size(); ++j) angle_rad.push_back(arm.state(j).joint_angle_rad);
    const double plate_J = arm.plate()->energy(arm.dynamics().flange(angle_rad).position_m);
    EXPECT_NEAR(plate_J, -work_J, 0.02 * audit.throughput()) << mass_kg;
  }
}

TEST(ArmPlate, NeverPulls) {
  PlateContact plate(ArmPlate{.normal = {0.0, 0.0, 1.0}, .damping_Ns_m = 1e4});
  EXPECT_EQ(plate.find_force({0.0, 0.0, 0.001}, {0.0, 0.0, -1.0}), 0.0);
  EXPECT_GT(plate.find_force({0.3, 0.2, -0.001}, {0.0, 0.0, -1.0}), 75.0);
  EXPECT_EQ(plate.find_force({0.0, 0.0, -0.001}, {0.0, 0.0, 1.0}), 0.0);
}

TEST(ArmRun, FindsAPlateAndReactsToIt) {
  const ArmRun none = run_arm(arm6_setup(), onto_a_plate(ContactReaction::none));
  ASSERT_TRUE(none.impact.has_value());
  ASSERT_FALSE(none.contacts.empty());
  EXPECT_EQ(none.contacts.front().reaction, ContactReaction::none);
  EXPECT_LT(none.contacts.front().latency_s.value(), 0.1);
  const double clamped_N = none.impact->largest_late_N.value();
  EXPECT_GT(clamped_N, 100.0);

  const ArmRun stopped = run_arm(arm6_setup(), onto_a_plate(ContactReaction::stop));
  EXPECT_EQ(stopped.cause, ArmStopCause::contact);
  EXPECT_EQ(stopped.stopped_joint, stopped.contacts.front().joint);
  EXPECT_TRUE(stopped.at_rest_s.has_value());

  for (const ContactReaction reaction : {ContactReaction::retract, ContactReaction::floating}) {
    const ArmRun of = run_arm(arm6_setup(), onto_a_plate(reaction));
    SCOPED_TRACE(std::string(name(reaction)));
    EXPECT_EQ(of.cause, ArmStopCause::none);
    ASSERT_FALSE(of.contacts.empty());
    EXPECT_EQ(of.contacts.front().reaction, reaction);
    EXPECT_LT(of.impact->rest_N.value(), reaction == ContactReaction::retract ? 1.0 : 60.0);
    EXPECT_LT(of.duration_s, of.contacts.front().found_s + 1.1);
  }
  const ArmRun held = run_arm(arm6_setup(), onto_a_plate(ContactReaction::hold));
  EXPECT_LT(held.impact->largest_late_N.value(), clamped_N);
  EXPECT_EQ(held.record.channel("plate_force_N").values.size(), held.record.size());
}

TEST(ArmRun, AFaultDuringAReactionStopsTheArmWithItsReason) {
  for (const ContactReaction reaction :
       {ContactReaction::hold, ContactReaction::retract, ContactReaction::floating}) {
    SCOPED_TRACE(std::string(name(reaction)));
    ArmRunSpec spec = onto_a_plate(reaction);
    const double found_s = run_arm(arm6_setup(), spec).contacts.at(0).found_s;
    spec.faults.resize(6);
    spec.faults[1].faults.push_back(parse_injection(
        "joint_angle=nan@" + std::to_string(found_s + 0.05) + "s", arm6_setup().joints[1].sheet));
    const ArmRun of = run_arm(arm6_setup(), spec);
    EXPECT_EQ(of.cause, ArmStopCause::measurement);
    EXPECT_EQ(of.stopped_joint, "joint2");
    EXPECT_NEAR(of.stopped_s, found_s + 0.055, 0.01);
    EXPECT_TRUE(of.at_rest_s.has_value());
    EXPECT_LT(of.largest_drop_m, 0.1);
  }
}

TEST(ArmRun, DoesNotReactToAHandThatGuidesIt) {
  ArmRunSpec spec{.program = {.start_rad = kContactStart,
                              .steps = {{.task = ArmTask::guide,
                                         .duration_s = 1.5,
                                         .pushes = {{.start_s = 0.8,
                                                     .duration_s = 0.4,
                                                     .force_N = {0.0, 60.0, 0.0}}}}},
                              .reaction = ContactReaction::stop},
                  .contacts = coarse_contacts(),
                  .has_gear_stage = false};
  const ArmRun of = run_arm(arm6_setup(), spec);
  EXPECT_EQ(of.cause, ArmStopCause::none);
  ASSERT_FALSE(of.contacts.empty());
  EXPECT_EQ(of.contacts.front().reaction, ContactReaction::none);
}

TEST(ArmRun, AContactEndsHalfASecondAfterTheLastThreshold) {
  const auto push = [](double start_s) {
    return ArmPush{.start_s = start_s, .duration_s = 0.1, .force_N = {0.0, 60.0, 0.0}};
  };
  const ArmRunSpec spec{.program = {.start_rad = kContactStart,
                                    .steps = {{.task = ArmTask::hold,
                                               .duration_s = 4.0,
                                               .pushes = {push(0.8), push(1.35), push(3.0)}}}},
                        .contacts = coarse_contacts(),
                        .has_gear_stage = false};
  const ArmRun of = run_arm(arm6_setup(), spec);
  ASSERT_EQ(of.contacts.size(), 2U);
  EXPECT_NEAR(of.contacts[0].found_s, 0.81, 0.02);
  EXPECT_NEAR(of.contacts[1].found_s, 3.01, 0.02);
}

TEST(ArmRun, RefusesAReactionWithoutThresholds) {
  ArmRunSpec spec = onto_a_plate(ContactReaction::retract);
  spec.contacts.reset();
  EXPECT_THAT(test::error_message([&] { (void)run_arm(arm6_setup(), spec); }),
              AllOf(HasSubstr("retract"), HasSubstr("--contacts")));
  spec.contacts = coarse_contacts();
  spec.contacts->joints.pop_back();
  EXPECT_THAT(test::error_message([&] { (void)run_arm(arm6_setup(), spec); }),
              HasSubstr("thresholds of contacts for 6 joints"));
  spec.contacts = coarse_contacts();
  spec.program.steps[1].plate->normal = {0.0, 0.0, 2.0};
  EXPECT_THAT(test::error_message([&] { (void)run_arm(arm6_setup(), spec); }),
              HasSubstr("a normal of length 1"));
}

class PlatePrograms : public testing::Test {
 protected:
  std::string error(const std::string& plate, const std::string& rest = {}) {
    folder_.file("moves.yaml",
                 "start: [0, -1, 1.7, 0, 0.7, 0]\nprogram:\n  - hold: 1s\n    plate: " + plate +
                     "\n" + rest);
    return test::error_message(
        [&] { program_ = read_arm_program(folder_.path("moves.yaml"), arm6_setup()); });
  }

  TemporaryFolder folder_;
  ArmProgram program_;
};

TEST_F(PlatePrograms, AreRead) {
  ASSERT_EQ(error("{from_flange: [50mm, 0, 0], normal: [-2, 0, 0], stiffness_N_m: 75000, "
                  "mass: 4.4kg, damping_Ns_m: 20}",
                  "contact: float\n"),
            "");
  const ArmPlate& plate = program_.steps.at(0).plate.value();
  EXPECT_TRUE(plate.is_from_flange);
  EXPECT_NEAR(plate.at_m[0], 0.05, 1e-12);
  EXPECT_EQ(plate.normal, (Vector3{-1.0, 0.0, 0.0}));
  EXPECT_EQ(plate.stiffness_N_m, 75e3);
  EXPECT_EQ(plate.mass_kg, 4.4);
  EXPECT_EQ(program_.reaction, ContactReaction::floating);
}

TEST_F(PlatePrograms, ThatCannotBeAreRefusedWithFileAndLine) {
  const std::string good = "normal: [0, 0, 1], stiffness_N_m: 75000";
  EXPECT_THAT(error("{" + good + "}"),
              AllOf(HasSubstr("moves.yaml: line 4"), HasSubstr("one of at")));
  EXPECT_THAT(error("{at: [0, 0, 0], from_flange: [0, 0, 0], " + good + "}"),
              HasSubstr("one of at"));
  EXPECT_THAT(error("{at: [0, 0], " + good + "}"), HasSubstr("three numbers"));
  EXPECT_THAT(error("{at: [0, 0, 1N], " + good + "}"), HasSubstr("line 4"));
  EXPECT_THAT(error("{at: [0, 0, 0], normal: [0, 0, 0], stiffness_N_m: 75000}"),
              HasSubstr("not three zeros"));
  EXPECT_THAT(error("{at: [0, 0, 0], normal: [0, 0, 1]}"), HasSubstr("stiffness_N_m"));
  EXPECT_THAT(error("{at: [0, 0, 0], normal: [0, 0, 1], stiffness_N_m: -1}"), HasSubstr("above 0"));
  EXPECT_THAT(error("{at: [0, 0, 0], normal: [0, 0, 1], stiffness_N_m: 1e9}"), HasSubstr("line 4"));
  EXPECT_THAT(error("{at: [0, 0, 0], mass: 0kg, " + good + "}"),
              AllOf(HasSubstr("0.5 kg or more"), HasSubstr("clamped")));
  EXPECT_THAT(error("{at: [0, 0, 0], damping_Ns_m: -1, " + good + "}"), HasSubstr("0 or more"));
  EXPECT_THAT(error("{at: [0, 0, 0], friction: 1, " + good + "}"), HasSubstr("friction"));
  EXPECT_THAT(error("{at: [0, 0, 0], " + good + "}", "contact: jump\n"),
              AllOf(HasSubstr("moves.yaml: line 5"), HasSubstr("retract and float")));
}

}  // namespace
}  // namespace torsio

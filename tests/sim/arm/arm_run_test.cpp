#include "torsio/sim/arm/arm_run.hpp"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

#include "arm/vector3.hpp"
#include "sim/arm/arm_bench.hpp"
#include "support/error_message.hpp"
#include "support/file_bytes.hpp"
#include "support/temporary_folder.hpp"
#include "torsio/core/units.hpp"

namespace torsio {
namespace {

using testing::AllOf;
using testing::HasSubstr;

constexpr std::size_t kArm6 = 6;

std::vector<double> deg(std::vector<double> angles) {
  for (double& angle : angles) angle = rad_from_deg(angle);
  return angles;
}
const std::vector<double> kFolded_deg = {0, -60, 100, 0, 40, 0};

ArmRun run(std::vector<ArmStep> steps, std::vector<FaultSchedule> faults = {}) {
  return run_arm(arm6_setup(),
                 {.program = {.start_rad = deg(kFolded_deg), .steps = std::move(steps)},
                  .faults = std::move(faults),
                  .with_truth = true});
}

/// Where the flange truly is at each tick.
std::vector<Vector3> flange(const ArmRun& of) {
  const ArmDynamics dynamics(arm6_setup().arm);
  std::vector<Vector3> places;
  for (std::size_t n = 0; n < of.record.size(); ++n) {
    std::vector<double> angle_rad;
    for (const Recording& joint : of.joints)
      angle_rad.push_back(joint.channel("truth_angle_rad").values[n]);
    places.push_back(dynamics.flange(angle_rad).position_m);
  }
  return places;
}

std::vector<FaultSchedule> fault_of(std::size_t joint, const std::string& text) {
  std::vector<FaultSchedule> schedules(kArm6);
  schedules[joint].faults.push_back(parse_injection(text, arm6_setup().joints[joint].sheet));
  return schedules;
}

TEST(ArmRun, ItsLinksFollowAMove) {
  const ArmRun of = run({{.task = ArmTask::move, .to_rad = deg({30, -40, 80, 20, 50, 20})},
                         {.task = ArmTask::move, .to_rad = deg(kFolded_deg)}});
  EXPECT_EQ(of.cause, ArmStopCause::none);
  for (const ArmJointScore& score : of.scores) {
    EXPECT_LT(score.position_rmse_rad.value(), 4e-3) << score.joint;
    EXPECT_LT(score.largest_share, 1.0) << score.joint;
    EXPECT_EQ(score.limited_s, 0.0) << score.joint;
  }
}

// Before links were damped, the second joint began to swing after a minute and did not stop.
TEST(ArmRun, DoesNotSwingInALongRun) {
  std::vector<ArmStep> steps;
  for (int k = 0; k < 12; ++k)
    steps.push_back({.task = ArmTask::move,
                     .to_rad = deg({30.0 - 60.0 * (k % 2), -90.0 + 50.0 * std::sin(k),
                                    90.0 * std::cos(2 * k), 60.0 * std::sin(3 * k), 75, 0})});
  steps.push_back({.task = ArmTask::hold, .duration_s = 30.0});
  const ArmRun of = run(std::move(steps));
  for (const Recording& joint : of.joints) {
    const std::vector<double>& angle = joint.channel("truth_angle_rad").values;
    const auto [low, high] = std::ranges::minmax_element(angle.end() - 5000, angle.end());
    EXPECT_LT(*high - *low, 2e-4) << joint.name();
  }
}

TEST(ArmRun, IsTheSameForASeed) {
  const std::vector<ArmStep> steps = {{.task = ArmTask::guide, .duration_s = 0.3}};
  const ArmRun a = run(steps);
  const ArmRun b = run(steps);
  ASSERT_EQ(a.record.channels().size(), b.record.channels().size());
  for (std::size_t c = 0; c < a.record.channels().size(); ++c)
    EXPECT_EQ(a.record.channels()[c].values, b.record.channels()[c].values);
}

TEST(ArmRun, FindsAPushInTheExternalTorques) {
  const ArmRun of =
      run({{.task = ArmTask::hold,
            .duration_s = 1.5,
            .pushes = {{.start_s = 0.5, .duration_s = 1.0, .force_N = {0, 0, -40}}}}});
  // 40 N at about 0.6 m from joint 2; before and during the push.
  const std::vector<double>& estimated = of.record.channel("joint2_external_torque_Nm").values;
  const std::vector<double>& truth = of.joints[1].channel("truth_external_torque_Nm").values;
  EXPECT_GT(std::abs(truth[1400]), 15.0);
  EXPECT_NEAR(estimated[1400] - estimated[400], truth[1400], 0.25 * std::abs(truth[1400]));
}

TEST(ArmRun, IsMovedByHandAndStaysWhereItIsLeft) {
  const ArmRun of =
      run({{.task = ArmTask::guide,
            .duration_s = 4.0,
            .pushes = {{.start_s = 0.5, .duration_s = 0.5, .force_N = {0, 25, 0}},
                       {.start_s = 1.0, .duration_s = 0.45, .force_N = {0, -25, 0}}}}});
  EXPECT_EQ(of.cause, ArmStopCause::none);
  const std::vector<Vector3> places = flange(of);
  const auto distance = [&](std::size_t a, std::size_t b) {
    const Vector3 way = places[b] - places[a];
    return std::sqrt(dot(way, way));
  };
  EXPECT_LT(distance(0, 499), 0.003);    // it does not sink
  EXPECT_GT(distance(499, 1450), 0.05);  // a hand moves it
  // And comes nearly to rest: the torques of linear springs are wrong by more than the friction that holds it.
  EXPECT_LT(distance(2900, 3900), 0.04);
}

TEST(ArmRun, ACartesianImpedanceYieldsLikeASpring) {
  const ArmRun of = run({{.task = ArmTask::cartesian,
                          .duration_s = 3.0,
                          .pushes = {{.start_s = 0.5, .duration_s = 2.5, .force_N = {0, 0, 40}}}}});
  EXPECT_EQ(of.cause, ArmStopCause::none);
  const std::vector<Vector3> places = flange(of);
  // 40 N over 800 N/m are 50 mm; the springs of the joints (hysteresis) and friction leave some of it.
  EXPECT_NEAR(places[2990][2] - places[490][2], 0.05, 0.02);
  EXPECT_NEAR(places[2990][1] - places[490][1], 0.0, 0.01);
}

TEST(ArmRun, AJointImpedanceCarriesTheArm) {
  const ArmRun of = run({{.task = ArmTask::impedance,
                          .duration_s = 1.5,
                          .stiffness_Nm_rad = {300, 300, 120, 30, 30, 10},
                          .damping_Nms_rad = {30, 30, 12, 2, 2, 1}}});
  const std::vector<Vector3> places = flange(of);
  const Vector3 way = places.back() - places.front();
  EXPECT_LT(std::sqrt(dot(way, way)), 0.05);
}

TEST(ArmRun, AFaultInOneJointDuringHandGuidingStopsTheArm) {
  for (const std::size_t joint : {std::size_t{0}, std::size_t{1}, std::size_t{2}, std::size_t{4}}) {
    for (const char* fault : {"joint_angle=nan@1s", "gear_angle=nan@1s", "motor_angle=nan@1s"}) {
      SCOPED_TRACE(std::to_string(joint + 1) + " " + fault);
      const ArmRun of =
          run({{.task = ArmTask::guide,
                .duration_s = 3.0,
                .pushes = {{.start_s = 0.7, .duration_s = 0.5, .force_N = {10, 15, 0}}}}},
              fault_of(joint, fault));
      EXPECT_EQ(of.cause, ArmStopCause::measurement);
      EXPECT_EQ(of.stopped_joint, "joint" + std::to_string(joint + 1));
      EXPECT_NEAR(of.stopped_s, 1.0, 0.01);
      EXPECT_LT(of.largest_drop_m, 0.03);
    }
  }
}

TEST(ArmRun, AFrozenEncoderIsStoppedByTheOverload) {
  // What no monitor watches is found late: the spring seems to hold while the arm falls.
  const ArmRun of =
      run({{.task = ArmTask::guide, .duration_s = 3.0}}, fault_of(1, "gear_angle=freeze@0.5s"));
  EXPECT_LT(of.largest_drop_m, 0.1);
}

TEST(ArmController, MovesAgainAfterAStopIsReleased) {
  const ArmSetup setup = arm6_setup();
  const std::vector<double> start_rad = deg(kFolded_deg);
  ArmBench bench(setup, FirstStageForm::rigid, {}, 3, start_rad);
  ArmController arm(arm_controller_settings(setup), kBenchRate_Hz);
  ArmReference hold;
  std::ranges::copy(start_rad, hold.position_rad.begin());
  std::vector<ArmBench::Command> commands(kArm6);
  const auto tick = [&](const ArmReference& reference) -> const ArmController::Output& {
    bench.sense();
    const auto& output = arm.step(reference, bench.samples());
    for (std::size_t j = 0; j < kArm6; ++j)
      commands[j] = {output.joints[j].current_A, output.joints[j].is_powered,
                     output.joints[j].is_brake_open};
    bench.act(commands, {});
    return output;
  };
  const auto is_running = [&] {
    const auto& output = tick(hold);
    return std::all_of(output.joints.begin(), output.joints.begin() + kArm6,
                       [](const auto& joint) { return joint.phase == JointStop::Phase::running; });
  };
  EXPECT_EQ(tick(hold).cause, ArmStopCause::requested);  // it begins with closed brakes
  EXPECT_FALSE(arm.release());                           // and is not known to rest yet
  for (int n = 0; n < 100; ++n) tick(hold);
  EXPECT_TRUE(arm.release());
  int ticks = 0;
  while (!is_running() && ticks < 3000) ++ticks;
  EXPECT_LT(ticks, 3000);
  EXPECT_EQ(tick(hold).cause, ArmStopCause::none);

  arm.stop(StopCategory::ramp_and_brake);
  for (int n = 0; n < 1000; ++n) tick(hold);
  EXPECT_EQ(tick(hold).cause, ArmStopCause::requested);
  EXPECT_TRUE(tick(hold).is_at_rest);
  EXPECT_TRUE(arm.release());
  for (ticks = 0; !is_running() && ticks < 3000;) ++ticks;
  EXPECT_LT(ticks, 3000);
  // A position that is far away is refused: the arm holds.
  ArmReference far = hold;
  far.position_rad[0] += 0.5;
  arm.stop(StopCategory::ramp_and_brake);
  for (int n = 0; n < 1000; ++n) tick(far);
  EXPECT_TRUE(arm.release());
  for (int n = 0; n < 1500; ++n) tick(far);
  EXPECT_TRUE(tick(far).is_reference_refused);
  EXPECT_NEAR(bench.plant().state(0).joint_angle_rad, start_rad[0], 0.02);
  far.position_rad[1] = std::nan("");
  EXPECT_TRUE(tick(far).is_reference_refused);
  far.mode = ArmMode::cartesian;  // not configured
  far.position_rad = hold.position_rad;
  EXPECT_TRUE(tick(far).is_reference_refused);
}

class ArmFiles : public testing::Test {
 protected:
  std::string arm_error(const std::string& text) {
    folder_.file("arm.yaml", text);
    return test::error_message([&] { (void)read_arm(folder_.path("arm.yaml")); });
  }
  std::string program_error(const std::string& text) {
    folder_.file("moves.yaml", text);
    return test::error_message(
        [&] { (void)read_arm_program(folder_.path("moves.yaml"), arm6_setup()); });
  }
  /// The arm that comes with torsio, with one line replaced.
  std::string changed_arm(const std::string& line, const std::string& by) {
    const std::filesystem::path share = std::filesystem::path(TORSIO_SOURCE) / "share/torsio";
    std::filesystem::copy_file(share / "arm6.urdf", folder_.path("arm6.urdf"),
                               std::filesystem::copy_options::overwrite_existing);
    std::string text = test::file_bytes(share / "arm6.yaml");
    const std::size_t at = text.find(line);
    EXPECT_NE(at, std::string::npos) << line;
    return text.replace(at, line.size(), by);
  }

  TemporaryFolder folder_;
};

TEST_F(ArmFiles, TheReadyArmIsThatOfItsFile) {
  const ArmSetup file =
      read_arm((std::filesystem::path(TORSIO_SOURCE) / "share/torsio/arm6.yaml").string());
  const ArmSetup ready = arm6_setup();
  ASSERT_EQ(file.joints.size(), ready.joints.size());
  EXPECT_EQ(file.arm.payload.mass_kg, ready.arm.payload.mass_kg);
  for (std::size_t j = 0; j < ready.joints.size(); ++j) {
    EXPECT_EQ(full_name(file.joints[j].sheet), full_name(ready.joints[j].sheet));
    EXPECT_EQ(file.arm.joints[j].body.mass_kg, ready.arm.joints[j].body.mass_kg);
    EXPECT_EQ(file.moves[j].jerk_rad_s3, ready.moves[j].jerk_rad_s3);
    // The URDF file permits 1 rad/s, the rating of dfki-300 a little less.
    EXPECT_LE(file.arm.joints[j].speed_rad_s, file.joints[j].sheet.rating.speed_rad_s.value);
  }
}

TEST_F(ArmFiles, AJointIsAsStrongAsItsActuator) {
  folder_.file("arm.yaml",
               changed_arm("joint1: {actuator: dfki-300}", "joint1: {actuator: dfki-120}"));
  const ArmSetup setup = read_arm(folder_.path("arm.yaml"));
  EXPECT_EQ(setup.arm.joints[0].effort_Nm, setup.joints[0].sheet.rating.torque_Nm.value);
  EXPECT_EQ(setup.arm.joints[1].effort_Nm, 300.0);
}

TEST_F(ArmFiles, AnArmThatCannotBeIsRefusedWithFileAndLine) {
  EXPECT_THAT(arm_error(changed_arm("  joint4: {actuator: dfki-28}\n", "")),
              AllOf(HasSubstr("arm.yaml: line 8"), HasSubstr("an actuator for joint 'joint4'")));
  EXPECT_THAT(arm_error(changed_arm("  joint4:", "  joint7: {actuator: dfki-28}\n  joint4:")),
              HasSubstr("joint7"));
  EXPECT_THAT(
      arm_error(changed_arm("joint4: {actuator: dfki-28}", "joint4: {actuator: elastomer}")),
      AllOf(HasSubstr("arm.yaml: line 11"), HasSubstr("a series-elastic actuator")));
  EXPECT_THAT(arm_error(changed_arm("dfki-120", "dfki-121")), HasSubstr("dfki-120"));
  EXPECT_THAT(arm_error(changed_arm("mass: 8kg", "mass: 20kg")),
              AllOf(HasSubstr("beyond the rating of joint"), HasSubstr("Reduce the payload")));
  EXPECT_THAT(arm_error(changed_arm("mass: 8kg", "mass: 8Nm")), HasSubstr("line 5"));
  EXPECT_THAT(arm_error(changed_arm("mass: 8kg", "mass: -8kg")), HasSubstr("0 kg or more"));
  EXPECT_THAT(arm_error(changed_arm("[0.0136, 0.0136, 0.0136]", "[0.0136, 0.0136]")),
              HasSubstr("a list of 3 numbers"));
  EXPECT_THAT(arm_error(changed_arm("arm6.urdf\n", "missing.urdf\n")),
              AllOf(HasSubstr("missing.urdf"), HasSubstr("cannot be read")));
  EXPECT_THAT(arm_error(changed_arm("speed_up: 0.5s", "speed_up: 0s")), HasSubstr("line 6"));
  EXPECT_THAT(arm_error(changed_arm("joint1: {actuator: dfki-300}",
                                    "joint1: {actuator: dfki-300, model: no.safetensors}")),
              testing::IsEmpty());  // the file of a model is read when the arm is run
}

TEST_F(ArmFiles, AProgramThatCannotBeIsRefusedWithFileAndLine) {
  const std::string start = "start: [0, -1, 1.7, 0, 0.7, 0]\nprogram:\n";
  EXPECT_THAT(
      program_error(start + "  - move: [0, -1, 3.5, 0, 0.7, 0]\n"),
      AllOf(HasSubstr("moves.yaml: line 3"), HasSubstr("joint 'joint3' within its limits")));
  EXPECT_THAT(program_error(start + "  - move: [0, -1]\n"), HasSubstr("6 angles"));
  EXPECT_THAT(program_error(start + "  - hold: 0s\n"), HasSubstr("line 3"));
  EXPECT_THAT(program_error(start + "  - hold: 1Nm\n"), HasSubstr("line 3"));
  EXPECT_THAT(program_error(start + "  - dance: 1s\n"), HasSubstr("one of move, follow, hold"));
  EXPECT_THAT(program_error(start + "  - hold: 1s\n    pull: {}\n"), HasSubstr("pull"));
  EXPECT_THAT(program_error(start + "  - hold: 1s\n    push: {force: [1N, 2N], for: 1s}\n"),
              HasSubstr("three numbers"));
  EXPECT_THAT(program_error(start + "  - hold: 1s\n    push: {torque: {elbow: 1Nm}, for: 1s}\n"),
              HasSubstr("elbow"));
  EXPECT_THAT(program_error("start: [0, 0, 0, 0, 0, 0]\nprogram: [{cartesian: 1s}]\n"),
              AllOf(HasSubstr("step 1 (cartesian)"), HasSubstr("singular configuration")));
  EXPECT_THAT(program_error("start: [0, 0, 0, 0, 0, 0]\nprogram: []\n"),
              HasSubstr("1 to 1000 steps"));
}

TEST_F(ArmFiles, ATrajectoryThatCrossesALimitIsRefusedWithTheLineOfItsFile) {
  const auto error = [&](double third_rad, double start_rad) {
    std::string text =
        "t_s,joint1_angle_rad,joint2_angle_rad,joint3_angle_rad,joint4_angle_rad,joint5_angle_rad,"
        "joint6_angle_rad\n";
    for (int n = 0; n < 5; ++n)
      text += fmt::format("{},0,-1,{},0,0.7,0\n", 1e-3 * n, n == 3 ? third_rad : start_rad);
    folder_.file("path.csv", text);
    return program_error("start: [0, -1, 1.7, 0, 0.7, 0]\nprogram: [{follow: path.csv}]\n");
  };
  EXPECT_THAT(error(1.7, 1.7), testing::IsEmpty());
  EXPECT_THAT(error(2.9, 1.7),
              AllOf(HasSubstr("path.csv: line 5"), HasSubstr("crosses a limit of joint 'joint3'")));
  EXPECT_THAT(error(1.71, 1.7),
              AllOf(HasSubstr("path.csv: line 5"), HasSubstr("too fast for joint 'joint3'")));
  EXPECT_THAT(error(1.5, 1.5), HasSubstr("does not begin where"));
  // Joint 2 goes from rest to nearly its full speed within one tick; the joint that it then turns is the first that is too weak.
  std::string text =
      "t_s,joint1_angle_rad,joint2_angle_rad,joint3_angle_rad,joint4_angle_rad,joint5_angle_rad,"
      "joint6_angle_rad\n";
  for (int n = 0; n < 200; ++n)
    text += fmt::format("{},0,{},1.7,0,0.7,0\n", 1e-3 * n, -1.0 + 0.7e-3 * std::max(n - 100, 0));
  folder_.file("path.csv", text);
  EXPECT_THAT(program_error("start: [0, -1, 1.7, 0, 0.7, 0]\nprogram: [{follow: path.csv}]\n"),
              AllOf(HasSubstr("path.csv: line"), HasSubstr("more torque than joint 'joint3' has")));
  folder_.file("path.csv", "t_s,joint1_angle_rad\n0,0\n0.001,0\n");
  EXPECT_THAT(program_error("start: [0, -1, 1.7, 0, 0.7, 0]\nprogram: [{follow: path.csv}]\n"),
              HasSubstr("a channel 'joint2_angle_rad'"));
}

}  // namespace
}  // namespace torsio

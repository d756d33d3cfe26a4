// The verb arm, as a user types it.
#include <nlohmann/json.hpp>

#include "program/program.hpp"
#include "support/file_bytes.hpp"

namespace torsio::test {
namespace {

class Arm : public Program {
 protected:
  void write_program(const std::string& steps) const {
    folder_.file("moves.yaml",
                 "start: [0deg, -60deg, 100deg, 0deg, 40deg, 0deg]\nprogram:\n" + steps);
  }
  void expect_refusal(const std::string& call, const std::string& text) {
    const Outcome outcome = torsio("arm " + call);
    EXPECT_NE(outcome.exit_code, 0) << call;
    EXPECT_NE(outcome.err.find(text), std::string::npos) << outcome.err;
  }
};

TEST_F(Arm, MovesRecordsAndReports) {
  write_program("  - move: [20deg, -40deg, 80deg, 0deg, 50deg, 0deg]\n  - hold: 0.5s\n");
  const Outcome outcome = torsio(
      "arm --program moves.yaml -o arm.csv --joints joints --json arm.json --report arm.html");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_NE(outcome.out.find("The program was carried out to its end."), std::string::npos)
      << outcome.out;
  const auto document = nlohmann::json::parse(contents("arm.json"));
  EXPECT_EQ(document["stop"], "none");
  ASSERT_EQ(document["joints"].size(), 6U);
  EXPECT_LT(document["joints"][0]["position_rmse_rad"], 0.01);
  EXPECT_GT(document["joints"][1]["largest_torque_Nm"], 20.0);
  EXPECT_EQ(contents("arm.csv").substr(0, 27), "t_s,joint1_motor_angle_rad,");
  EXPECT_NE(contents("arm.html").find("The arm from the side"), std::string::npos);
  // A joint's own recording is one of a bench.
  EXPECT_EQ(torsio("convert joints/joint2.csv -o joint2.mcap").exit_code, 0);
  EXPECT_EQ(contents("joints/joint2.csv").substr(0, 20), "t_s,motor_angle_rad,");
}

TEST_F(Arm, StopsAfterAFaultInOneJoint) {
  write_program("  - guide: 2s\n");
  const Outcome outcome =
      torsio("arm --program moves.yaml --fault joint2:joint_angle=nan@1s --json -");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const auto document = nlohmann::json::parse(outcome.out);
  EXPECT_EQ(document["stop"], "measurement");
  EXPECT_EQ(document["stopped_joint"], "joint2");
  EXPECT_LT(document["flange_moved_m"], 0.05);
}

// With closed brakes the torque of the current is not that of the spring: the monitor is proven once they are open.
TEST_F(Arm, IsStoppedByTheMonitorOfAJoint) {
  std::string steps;
  for (int k = 0; k < 3; ++k)
    steps +=
        "  - move: [60deg, -95deg, 40deg, 40deg, 70deg, 0deg]\n"
        "  - move: [-60deg, -15deg, 110deg, -60deg, -60deg, 0deg]\n"
        "  - guide: 3s\n"
        "  - move: [20deg, -70deg, 20deg, 0deg, 40deg, 0deg]\n"
        "  - move: [0deg, -20deg, 60deg, 0deg, 40deg, 0deg]\n"
        "  - move: [0deg, -60deg, 100deg, 0deg, 40deg, 0deg]\n"
        "  - guide: 3s\n    push: {force: [0N, 10N, -20N], at: 1s, for: 0.5s}\n";
  write_program(steps);
  for (const std::string seed : {"1", "2"})
    ASSERT_EQ(torsio("arm --program moves.yaml --rigid-gears --seed " + seed + " --joints " + seed)
                  .exit_code,
              0);
  const std::string speed = "lowpass(rate(motor_angle_rad), 50Hz)";
  for (const std::string& fit :
       {"current.safetensors --inputs 'lowpass(motor_current_A, 50Hz), rate(" + speed + "), " +
            speed + ", lowpass(dahl(motor_angle_rad, 0.02), 50Hz)'",
        std::string("spring.safetensors --inputs 'lowpass(spring_deflection_rad, 50Hz)'")})
    ASSERT_EQ(torsio("fit 1/joint2.csv --model linear --set rates=true -o " + fit).exit_code, 0);
  const Outcome calibrated = torsio(
      "monitor --calibrate 1/joint2.csv 2/joint2.csv -o joint2.monitor.json --source "
      "spring=spring.safetensors:gear_encoder+joint_encoder --source "
      "current=current.safetensors:current_sensor+motor_encoder --valid-until 2099-01-01 "
      "--false-alarms-per-hour 200");
  ASSERT_EQ(calibrated.exit_code, 0) << calibrated.err;
  std::string arm = file_bytes(std::string(TORSIO_SOURCE) + "/share/torsio/arm6.yaml");
  folder_.file("arm6.urdf", file_bytes(std::string(TORSIO_SOURCE) + "/share/torsio/arm6.urdf"));
  const std::string joint = "joint2: {actuator: dfki-300";
  ASSERT_NE(arm.find(joint), std::string::npos);
  folder_.file("arm.yaml",
               arm.insert(arm.find(joint) + joint.size(), ", monitor: joint2.monitor.json"));

  write_program("  - guide: 2s\n    push: {force: [0N, 10N, -20N], at: 0.5s, for: 1s}\n");
  const auto run = [&](const std::string& call) {
    const Outcome outcome = torsio("arm " + call + " --program moves.yaml --rigid-gears --json -");
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    return nlohmann::json::parse(outcome.out);
  };
  EXPECT_EQ(run("arm.yaml")["stop"], "none");
  const std::string fault = " --fault joint2:gear_angle=freeze@1s";
  const auto alone = run("arm6" + fault);
  const auto watched = run("arm.yaml" + fault);
  EXPECT_EQ(alone["stop"], "overload");
  EXPECT_EQ(watched["stop"], "monitor");
  EXPECT_EQ(watched["stopped_joint"], "joint2");
  EXPECT_NE(watched["stop_reason"], "monitor");
  EXPECT_LT(watched["flange_moved_m"], 0.5 * alone["flange_moved_m"].get<double>());

  // The monitor of another joint.
  arm.erase(arm.find(", monitor"), std::string(", monitor: joint2.monitor.json").size());
  folder_.file("arm.yaml", arm.insert(arm.find("joint3: {actuator: dfki-120") + 27,
                                      ", monitor: joint2.monitor.json"));
  expect_refusal("arm.yaml --program moves.yaml --rigid-gears", "joint 'joint3'");
}

TEST_F(Arm, DescribesTheArm) {
  const Outcome outcome = torsio("arm --describe --payload 3kg");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_NE(outcome.out.find("a payload of 3 kg"), std::string::npos) << outcome.out;
  EXPECT_NE(outcome.out.find("dfki-120"), std::string::npos);
}

TEST_F(Arm, RefusesWhatCannotBeWithPlaceAndReason) {
  expect_refusal("--describe --payload 20kg", "beyond the rating of joint");
  expect_refusal("--fault joint9:current=zero@1s", "joint1, joint2");
  write_program("  - move: [0deg, -60deg, 200deg, 0deg, 40deg, 0deg]\n");
  expect_refusal("--program moves.yaml", "moves.yaml: line 3");
  write_program("  - dance: 1s\n");
  expect_refusal("--program moves.yaml", "one of move, follow, hold");
  folder_.file("moves.yaml", "start: [0, 0, 0, 0, 0, 0]\nprogram: [{cartesian: 1s}]\n");
  expect_refusal("--program moves.yaml", "singular");
  folder_.file("arm.yaml", "urdf: missing.urdf\njoints: {}\n");
  expect_refusal("arm.yaml --describe", "missing.urdf");
  expect_refusal("nothing.yaml --describe", "nothing.yaml");
}

TEST_F(Arm, RefusesPushesThatDoNothing) {
  write_program("  - hold: 1s\n    push: {force: [1N, 0N, 0N], at: 0.8s, for: 0.5s}\n");
  expect_refusal("--program moves.yaml", "within the 1 s of its step");
  write_program("  - hold: 1s\n    push: {at: 0.1s, for: 0.5s}\n");
  expect_refusal("--program moves.yaml", "a force, a moment or a torque");
}

TEST_F(Arm, ReplacesNoFileThatItReads) {
  std::string path = "t_s";
  for (int j = 1; j <= 6; ++j) path += ",joint" + std::to_string(j) + "_angle_rad";
  for (int n = 0; n < 50; ++n) path += "\n" + std::to_string(1e-3 * n) + ",0,-1,1.7,0,0.7,0";
  folder_.file("path.csv", path + "\n");
  folder_.file("moves.yaml",
               "start: [0, -1, 1.7, 0, 0.7, 0]\nprogram: [{follow: path.csv}, {hold: 0.1s}]\n");
  expect_refusal("--program moves.yaml -o path.csv", "path.csv");
  EXPECT_EQ(contents("path.csv"), path + "\n");
  ASSERT_EQ(torsio("arm --program moves.yaml --joints new/folder").exit_code, 0);
  EXPECT_NE(contents("new/folder/joint6.csv"), "");
  // What was too short for filters to settle has no score.
  const Outcome outcome = torsio("arm --program moves.yaml");
  EXPECT_NE(outcome.out.find("joint6  dfki-28                 -"), std::string::npos)
      << outcome.out;
}

TEST_F(Arm, StatesThatAReferenceWasRefused) {
  std::string path = "t_s";
  for (int j = 1; j <= 6; ++j) path += ",joint" + std::to_string(j) + "_angle_rad";
  for (int n = 0; n < 700; ++n) path += "\n" + std::to_string(1e-3 * n) + ",0,-1,1.7,0,0.7,0";
  folder_.file("path.csv", path + "\n");
  folder_.file("moves.yaml",
               "start: [0, -1, 1.7, 0, 0.7, 0]\nprogram:\n"
               "  - guide: 2s\n    push: {force: [0N, 60N, 0N], at: 0.2s, for: 0.8s}\n"
               "  - follow: path.csv\n");
  const Outcome outcome = torsio("arm --program moves.yaml");
  EXPECT_NE(outcome.out.find("was not carried out"), std::string::npos) << outcome.out;
}

TEST_F(Arm, RemarksOnWhatTheResultDoesNotShow) {
  write_program("  - hold: 1s\n    push: {torque: {joint6: 60Nm}, at: 0.2s, for: 0.01s}\n");
  const Outcome outcome = torsio("arm --program moves.yaml --fault joint2:joint_angle=nan@9s");
  EXPECT_NE(outcome.err.find("the fault of joint2 at 9 s is after the end"), std::string::npos)
      << outcome.err;
  EXPECT_NE(outcome.err.find("joint6 reached"), std::string::npos) << outcome.err;
}

TEST_F(Arm, NamesTheWrongWord) {
  expect_refusal("arm6 --progam moves.yaml", "there is no option '--progam'");
  expect_refusal("--progam moves.yaml", "there is no option '--progam'");
  expect_refusal("arm6 identify moves.csv", "nothing between the two words");
}

TEST_F(Arm, LearnsContactsAndRetractsFromAPlate) {
  ASSERT_EQ(torsio("arm learn-contacts --payload 3kg --hours 0.02 -o contacts.json").exit_code, 0);
  folder_.file("moves.yaml",
               "start: [0deg, -60deg, 100deg, 0deg, 40deg, 0deg]\ncontact: retract\nprogram:\n"
               "  - hold: 1s\n  - move: [0deg, -40deg, 100deg, 0deg, 40deg, 0deg]\n"
               "    plate: {from_flange: [0mm, 0mm, -60mm], normal: [0, 0, 1], stiffness_N_m: "
               "75000}\n");
  const std::string call = "arm --payload 3kg --program moves.yaml";
  const Outcome outcome = torsio(call + " --contacts contacts.json -o arm.csv --json arm.json");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const auto document = nlohmann::json::parse(contents("arm.json"));
  ASSERT_EQ(document["contacts"].size(), 1U) << document.dump();
  EXPECT_EQ(document["contacts"][0]["reaction"], "retract");
  EXPECT_LT(document["contacts"][0]["latency_s"], 0.03);
  EXPECT_EQ(document["plate"]["largest_after_80_ms_N"], 0.0);
  EXPECT_NE(contents("arm.csv").find("plate_force_N"), std::string::npos);

  expect_refusal("learn-contacts --hours 0.02 --false-alarms-per-hour 1 -o few.json",
                 "the motion is too short for this rate");
  expect_refusal("--payload 5kg --program moves.yaml --contacts contacts.json", "payload");
  std::string text = contents("contacts.json");
  folder_.file("cut.json", text.substr(0, text.size() / 2));
  expect_refusal("--payload 3kg --program moves.yaml --contacts cut.json", "cut.json");
}

TEST_F(Arm, RunsTheExample) {
  const Outcome outcome = shell(std::string(TORSIO_EXAMPLES) + "/example_12_move_arm " +
                                TORSIO_SOURCE + "/share/torsio/arm6.urdf");
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_NE(outcome.out.find("joint2   needs at most"), std::string::npos) << outcome.out;
}

}  // namespace
}  // namespace torsio::test

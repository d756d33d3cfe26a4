// The verb arm identify, as a user types it.
#include <cmath>
#include <nlohmann/json.hpp>

#include "program/program.hpp"

namespace torsio::test {
namespace {

class ArmIdentify : public Program {
 protected:
  /// Moves of six poses with 8 kg.
  void record() {
    folder_.file("moves.yaml",
                 "start: [0deg, -60deg, 100deg, 0deg, 40deg, 0deg]\nprogram:\n"
                 "  - move: [-40deg, -30deg, 60deg, 90deg, -60deg, 60deg]\n"
                 "  - move: [50deg, -80deg, 120deg, -60deg, 70deg, -90deg]\n"
                 "  - move: [0deg, -100deg, 60deg, 30deg, 90deg, 100deg]\n"
                 "  - move: [-60deg, -50deg, 80deg, 120deg, 40deg, 0deg]\n"
                 "  - move: [20deg, -20deg, 40deg, -90deg, -80deg, -60deg]\n"
                 "  - move: [0deg, -60deg, 100deg, 0deg, 40deg, 0deg]\n");
    const Outcome outcome =
        torsio("arm --rigid-gears --program moves.yaml -o moves.csv --json arm.json");
    ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  }
  /// A recording of an arm that keeps its pose.
  void write_rows(const std::string& file, int rows, const std::string& angle) const {
    std::string text = "t_s";
    for (int j = 1; j <= 6; ++j)
      text += ",joint" + std::to_string(j) + "_joint_angle_rad,joint" + std::to_string(j) +
              "_estimated_torque_Nm";
    for (int n = 0; n < rows; ++n) {
      text += "\n" + std::to_string(0.01 * n);
      for (int j = 1; j <= 6; ++j) text += (n == 3 ? "," + angle : std::string(",0.5")) + ",1.5";
    }
    folder_.file(file, text + "\n");
  }
  void expect_refusal(const std::string& call, const std::string& text) {
    const Outcome outcome = torsio("arm identify " + call);
    EXPECT_NE(outcome.exit_code, 0) << call;
    EXPECT_NE(outcome.err.find(text), std::string::npos) << outcome.err;
  }
};

TEST_F(ArmIdentify, FindsThePayloadAndWritesTheLineOfTheArm) {
  record();
  const Outcome outcome = torsio("arm identify moves.csv -o payload.yaml --json found.json");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_NE(outcome.out.find("centre of mass, x"), std::string::npos) << outcome.out;
  const auto document = nlohmann::json::parse(contents("found.json"));
  const auto& mass = document["mass_kg"];
  EXPECT_TRUE(mass["is_determined"]);
  EXPECT_NEAR(mass["value"].get<double>(), 8.0, 4.0 * mass["standard_error"].get<double>());
  EXPECT_LT(mass["standard_error"].get<double>(), 0.4);
  const std::string line = contents("payload.yaml");
  EXPECT_EQ(line.substr(0, 15), "payload: {mass:") << line;
  // The arm's file takes the line.
  folder_.file("arm.yaml", "urdf: " TORSIO_SOURCE "/share/torsio/arm6.urdf\n" + line +
                               "joints:\n  joint1: {actuator: dfki-300}\n"
                               "  joint2: {actuator: dfki-300}\n  joint3: {actuator: dfki-120}\n"
                               "  joint4: {actuator: dfki-28}\n  joint5: {actuator: dfki-28}\n"
                               "  joint6: {actuator: dfki-28}\n");
  EXPECT_EQ(torsio("arm arm.yaml --describe").exit_code, 0);
  // Joint 2 of this arm cannot carry it.
  folder_.file("weak.yaml", "urdf: " TORSIO_SOURCE
                            "/share/torsio/arm6.urdf\n"
                            "joints:\n  joint1: {actuator: dfki-300}\n"
                            "  joint2: {actuator: dfki-120}\n  joint3: {actuator: dfki-120}\n"
                            "  joint4: {actuator: dfki-28}\n  joint5: {actuator: dfki-28}\n"
                            "  joint6: {actuator: dfki-28}\n");
  expect_refusal("moves.csv --arm weak.yaml -o weak_payload.yaml",
                 "the payload is beyond the rating of joint 'joint2'");
  EXPECT_EQ(contents("weak_payload.yaml"), "");
}

TEST_F(ArmIdentify, CorrectsTheLinks) {
  record();
  const Outcome outcome =
      torsio("arm identify moves.csv --links --test moves.csv --json found.json");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_NE(outcome.out.find("in parentheses: not determined"), std::string::npos) << outcome.out;
  const auto document = nlohmann::json::parse(contents("found.json"));
  ASSERT_EQ(document["links"].size(), 6U);
  EXPECT_FALSE(document["links"][0]["mass_kg"]["is_determined"]);
  EXPECT_EQ(document["test_rmse_after_Nm"].size(), 6U);
  expect_refusal("moves.csv --test moves.csv", "--links beside it");
  expect_refusal("moves.csv --links -o payload.yaml", "it is for the payload");
}

TEST_F(ArmIdentify, RefusesRecordingsThatDetermineNothingWithPlaceAndReason) {
  write_rows("still.csv", 3000, "0.5");
  expect_refusal("still.csv", "the arm does not move");
  write_rows("short.csv", 100, "0.7");
  expect_refusal("short.csv", "the motion is too short");
  write_rows("gap.csv", 3000, "nan");
  expect_refusal("gap.csv", "joint1_joint_angle_rad at 0.030 s");
  write_rows("far.csv", 3000, "4.5");
  expect_refusal("far.csv", "the recording is of another arm");
  folder_.file("bench.csv", "t_s,joint_angle_rad,torque_Nm\n0,0,0\n0.01,0,0\n0.02,0,0\n");
  expect_refusal("bench.csv", "joint1_joint_angle_rad");
  expect_refusal("missing.csv", "missing.csv");
  expect_refusal("", "RECORDING");
  write_rows("rest.csv", 3000, "0.7");
  expect_refusal("rest.csv --window 0s", "window_s");
  expect_refusal("rest.csv --torque-within 200", "torque_scale_share");
  expect_refusal("rest.csv --links-com 3kg", "--links-com");
}

}  // namespace
}  // namespace torsio::test

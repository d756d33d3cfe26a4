// The verbs arm excite and arm calibrate, as a user types them.
#include <nlohmann/json.hpp>

#include "program/program.hpp"

namespace torsio::test {
namespace {

class ArmCalibrate : public Program {
 protected:
  /// arm6 with 8 kg, 100 mm beside the axis of the last joint.
  void write_arm(const std::string& file, const std::string& payload,
                 const std::string& joint2 = "dfki-300") const {
    folder_.file(file,
                 "urdf: " TORSIO_SOURCE "/share/torsio/arm6.urdf\nbase_tilt: 30deg\n" + payload +
                     "joints:\n  joint1: {actuator: dfki-300}\n  joint2: {actuator: " + joint2 +
                     "}\n  joint3: {actuator: dfki-120}\n  joint4: {actuator: dfki-28}\n"
                     "  joint5: {actuator: dfki-28}\n  joint6: {actuator: dfki-28}\n");
  }
  void expect_refusal(const std::string& call, const std::string& text) {
    const Outcome outcome = torsio("arm " + call);
    EXPECT_NE(outcome.exit_code, 0) << call;
    EXPECT_NE(outcome.err.find(text), std::string::npos) << outcome.err;
  }
  static constexpr const char* kSide = "payload: {mass: 8kg, center_of_mass: [80mm, 0, 100mm]}\n";
};

TEST_F(ArmCalibrate, RecordsAnExcitingProgramAndGivesTrainingData) {
  write_arm("side_30.yaml", kSide);
  const Outcome excited = torsio(
      "arm excite side_30.yaml --for springs --moves 6 --candidates 6 -o moves.yaml --json "
      "excited.json");
  ASSERT_EQ(excited.exit_code, 0) << excited.err;
  EXPECT_NE(torsio("arm excite side_30.yaml --moves 4 --candidates 6 -o payload.yaml")
                .out.find("condition number of the regressor"),
            std::string::npos);
  EXPECT_EQ(nlohmann::json::parse(contents("excited.json"))["moves"], 6);
  const Outcome moved =
      torsio("arm side_30.yaml --rigid-gears --program moves.yaml -o side_30.csv --json arm.json");
  ASSERT_EQ(moved.exit_code, 0) << moved.err;
  const Outcome outcome =
      torsio("arm calibrate side_30.csv=side_30.yaml -o joints --json calibrated.json");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_NE(outcome.out.find("+- target [Nm]"), std::string::npos) << outcome.out;
  const auto joints = nlohmann::json::parse(contents("calibrated.json"))["joints"];
  ASSERT_EQ(joints.size(), 6U);
  EXPECT_TRUE(joints[1]["is_determined"]) << joints[1];
  EXPECT_EQ(contents("joints/joint2_1.csv").substr(0, 20), "t_s,motor_angle_rad,");
  EXPECT_EQ(torsio("fit joints/joint2_1.csv --model linear -o joint2.safetensors").exit_code, 0);
  expect_refusal("calibrate side_30.csv -o joints", "RECORDING=ARM.yaml");
  expect_refusal("calibrate side_30.csv=missing.yaml -o joints", "missing.yaml");
  write_arm("weak.yaml", kSide, "dfki-120");
  expect_refusal("calibrate side_30.csv=weak.yaml -o joints", "beyond the rating");
  write_arm("empty.yaml", "");
  expect_refusal("calibrate side_30.csv=empty.yaml -o joints", "no known weight");
}

TEST_F(ArmCalibrate, RefusesProgramsThatCannotBe) {
  expect_refusal("excite --moves 2 -o moves.yaml", "moves: expected 3 to");
  expect_refusal("excite --height 3m -o moves.yaml", "no pose for move 1");
  expect_refusal("excite --for dancing -o moves.yaml", "payload, links or springs");
  expect_refusal("excite -o moves.csv", ".yaml");
  expect_refusal("excite", "--output");
}

}  // namespace
}  // namespace torsio::test

// The verb arm, as a user types it.
#include <nlohmann/json.hpp>

#include "program/program.hpp"

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

TEST_F(Arm, RunsTheExample) {
  const Outcome outcome = shell(std::string(TORSIO_EXAMPLES) + "/example_12_move_arm " +
                                TORSIO_SOURCE + "/share/torsio/arm6.urdf");
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_NE(outcome.out.find("joint2   needs at most"), std::string::npos) << outcome.out;
}

}  // namespace
}  // namespace torsio::test

// A log of unknown columns: what it contains, a draft of its mapping, and a model's check with it.
#include <nlohmann/json.hpp>

#include "program/program.hpp"

namespace torsio::test {
namespace {

class MapVerb : public Program {
 protected:
  /// A simulated recording with the names and units of a stranger.
  void record() {
    ASSERT_EQ(torsio("simulate dfki-50 sweep --lever 0.17m --duration 40s -o sweep.csv").exit_code,
              0);
    ASSERT_EQ(shell("sed '1s/.*/Zeit,theta_m,pos_gear,pos_link,i_q,Drehmoment,neu,soll_pos/' "
                    "sweep.csv > log.csv")
                  .exit_code,
              0);
  }
};

TEST_F(MapVerb, WritesADraftThatCheckReads) {
  record();
  const Outcome draft = torsio("map log.csv -o mapping.yaml");
  ASSERT_EQ(draft.exit_code, 0) << draft.err;
  EXPECT_NE(draft.out.find("torque_fresh_1"), std::string::npos) << draft.out;
  const Outcome check = torsio("check log.csv --mapping mapping.yaml --json -");
  EXPECT_EQ(check.exit_code, 0) << check.err << contents("mapping.yaml");
  EXPECT_EQ(check.out.find("\"resolution\", \"WARN\""), std::string::npos) << check.out;
}

TEST_F(MapVerb, WritesTheDraftAloneToStandardOutput) {
  record();
  const Outcome draft = torsio("map log.csv");
  ASSERT_EQ(draft.exit_code, 0) << draft.err;
  EXPECT_TRUE(draft.out.starts_with("# Draft by torsio map of log.csv")) << draft.out;
  EXPECT_NE(draft.err.find("reasons"), std::string::npos);
  const auto json = nlohmann::json::parse(torsio("map log.csv --json -").out);
  EXPECT_EQ(json.at("mapping"), draft.out);
  EXPECT_EQ(json.at("columns").size(), 8U);
}

TEST_F(MapVerb, RefusesWhatIsNoLogInOneSentence) {
  folder_.file("empty.csv", "");
  folder_.file("header.csv", "t_s,q\n");
  folder_.file("words.csv", "a,b\nx,y\nz,w\n");
  folder_.file("rest.csv", "t,q,tau\n0,1,2\n0.1,1,2\n0.2,1,2\n");
  folder_.file("one.csv", "t\n0\n0.1\n0.2\n");
  folder_.file("noise.csv", std::string("\x01\x02\xff\x00\x03\n", 6));
  folder_.file("cut.mat", std::string("MATLAB 5.0 MAT-file") + std::string(120, ' '));
  for (const char* const file : {"empty.csv", "header.csv", "words.csv", "rest.csv", "one.csv",
                                 "noise.csv", "cut.mat", "."}) {
    const Outcome refused = torsio(std::string("map ") + file + " -o m.yaml");
    EXPECT_EQ(refused.exit_code, kWorkFailed) << file;
    EXPECT_TRUE(refused.err.starts_with("torsio: ")) << refused.err;
    EXPECT_NE(refused.err.find(file), std::string::npos) << refused.err;
    EXPECT_EQ(contents("m.yaml"), "");
  }
  record();
  EXPECT_EQ(torsio("map log.csv -o log.csv").exit_code, kCallWasWrong);
}

TEST_F(MapVerb, ListsTheColumnsOfALogThatCheckCannotRead) {
  record();
  const Outcome list = torsio("check --list log.csv");
  ASSERT_EQ(list.exit_code, 0) << list.err;
  for (const char* const part : {"Zeit", "pos_link", "highest", "40000 rows"})
    EXPECT_NE(list.out.find(part), std::string::npos) << list.out;
  const auto json = nlohmann::json::parse(torsio("check --list sweep.csv --json -").out);
  EXPECT_EQ(json.at("clock"), "t_s");
  EXPECT_EQ(json.at("columns").at(5).at("unit"), "Nm");
}

TEST_F(MapVerb, ListsSeveralFilesAndStatesHowToListOne) {
  folder_.file("a.csv", "t_s,q_rad\n0,1\n0.1,2\n0.2,3\n");
  folder_.file("b.csv", "t_s,tau_Nm\n0,1\n0.1,2\n0.2,3\n");
  const Outcome none = torsio("check --list");
  EXPECT_EQ(none.exit_code, kCallWasWrong);
  EXPECT_NE(none.err.find("such as  torsio check --list log.csv"), std::string::npos) << none.err;
  const Outcome both = torsio("check --list a.csv b.csv");
  ASSERT_EQ(both.exit_code, 0) << both.err;
  for (const char* const part : {"a.csv:\n", "b.csv:\n", "q_rad", "tau_Nm"})
    EXPECT_NE(both.out.find(part), std::string::npos) << both.out;
  const auto json = nlohmann::json::parse(torsio("check --list a.csv b.csv --json -").out);
  EXPECT_EQ(json.at("files").at(1).at("file"), "b.csv");
  EXPECT_EQ(json.at("files").at(1).at("columns").at(1).at("column"), "tau_Nm");
}

TEST_F(MapVerb, TakesSeveralLogsOfOneJoint) {
  record();
  ASSERT_EQ(shell("cp log.csv free.csv").exit_code, 0);
  const Outcome draft = torsio("map log.csv free.csv -o mapping.yaml");
  ASSERT_EQ(draft.exit_code, 0) << draft.err;
  EXPECT_NE(draft.err.find("next  torsio check log.csv free.csv --mapping mapping.yaml"),
            std::string::npos)
      << draft.err;
  EXPECT_EQ(torsio("map log.csv sweep.csv").exit_code, kWorkFailed);
}

TEST_F(MapVerb, AnAngleBeforeTheGearIsNamedInTheMessage) {
  record();
  folder_.file(
      "m.yaml",
      "channels: {t_s: {from: Zeit, unit: s}, motor_angle_rad: {from: theta_m, unit: rad}, "
      "joint_angle_rad: {from: pos_link, unit: rad}, torque_Nm: {from: Drehmoment, unit: "
      "Nm}}\n");
  const Outcome refused = torsio("check log.csv --mapping m.yaml");
  EXPECT_NE(refused.exit_code, 0);
  EXPECT_NE(refused.err.find("motor_angle_rad is before the gear. In the mapping, name it "
                             "gear_angle_rad and state the ratio"),
            std::string::npos)
      << refused.err;
  ASSERT_EQ(shell("sed -i 's/motor_angle_rad: {from: theta_m, unit: rad/gear_angle_rad: {from: "
                  "theta_m, unit: rad, gear_ratio: 120/' m.yaml")
                .exit_code,
            0);
  EXPECT_EQ(torsio("check log.csv --mapping m.yaml").exit_code, 0);
}

}  // namespace
}  // namespace torsio::test

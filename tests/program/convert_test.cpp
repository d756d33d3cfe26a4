// Recordings from one format to another, and one bag with several joints.
#include <nlohmann/json.hpp>

#include "program/program.hpp"

namespace torsio::test {
namespace {

class ConvertVerb : public Program {};

TEST_F(ConvertVerb, GivesTheSameBytesBackThroughEveryFormat) {
  ASSERT_EQ(torsio("simulate dfki-50 sweep --duration 3s -o a.csv").exit_code, 0);
  for (const std::string name : {"b.mcap", "b.npz", "b.mat", "b.csv.gz"}) {
    const Outcome there = torsio("convert a.csv -o " + name + " --json -");
    ASSERT_EQ(there.exit_code, 0) << there.err;
    EXPECT_EQ(nlohmann::json::parse(there.out).at("samples"), 3000);
    ASSERT_EQ(torsio("convert " + name + " -o c.csv").exit_code, 0);
    EXPECT_EQ(contents("c.csv"), contents("a.csv")) << name;
  }
  ASSERT_EQ(torsio("simulate dfki-50 sweep --duration 3s -o a.mcap").exit_code, 0);
  EXPECT_EQ(contents("a.mcap"), contents("b.mcap"));
}

TEST_F(ConvertVerb, RefusesWhatItCannotDo) {
  ASSERT_EQ(torsio("simulate dfki-50 sweep --duration 3s -o a.csv").exit_code, 0);
  const std::string before = contents("a.csv");
  EXPECT_EQ(torsio("convert a.csv -o a.csv").exit_code, kCallWasWrong);
  EXPECT_EQ(torsio("convert a.csv -o a.xlsx").exit_code, kCallWasWrong);
  EXPECT_EQ(torsio("convert a.csv -o no_folder/a.mcap").exit_code, kCallWasWrong);
  EXPECT_EQ(torsio("convert a.csv --joint elbow -o b.csv").exit_code, kCallWasWrong);
  EXPECT_EQ(torsio("convert no.csv -o b.csv").exit_code, kWorkFailed);
  EXPECT_EQ(torsio("convert run.tsr --rate 100Hz -o b.csv").exit_code, kCallWasWrong);
  ASSERT_EQ(torsio("convert a.csv -o b.mcap").exit_code, 0);
  const Outcome full = shell("ulimit -f 8; {torsio} convert a.csv -o b.mcap");
  EXPECT_NE(full.exit_code, 0);
  EXPECT_EQ(torsio("convert b.mcap -o c.csv").exit_code, 0) << "the file before is whole";
  EXPECT_EQ(contents("c.csv"), before);
}

TEST_F(ConvertVerb, RemarksOnceOnWhatItAssumed) {
  static_cast<void>(folder_.file("log.csv",
                                 "Logger v2\n\n,date,time,q,tau,adc0,adc1\n,,,deg,Nm,V,-\n"
                                 "0,2024-03-01,12:00:00.0,1,NA,5,x\n"
                                 "1,2024-03-01,12:00:00.5,2,3,5,x\n"));
  static_cast<void>(
      folder_.file("map.yaml", "channels: {torque_Nm: tau}\ndrop: [adc*, torqe_Nm]\n"));
  const Outcome call = torsio("convert log.csv --mapping map.yaml -o a.csv");
  ASSERT_EQ(call.exit_code, 0) << call.err;
  EXPECT_EQ(contents("a.csv").substr(0, 20), "t_s,torque_Nm,q_rad\n");
  for (const char* remark :
       {"line 3 is read as the header", "line 4 is read as a row of units",
        "columns without a name are not read: 1", "'NA' (1)", "the dates in 'date' are added",
        "the times in 'time' are the clock", "read as UTC"}) {
    const std::size_t at = call.err.find(remark);
    EXPECT_NE(at, std::string::npos) << remark << "\n" << call.err;
    EXPECT_EQ(call.err.find(remark, at + 1), std::string::npos) << remark;
  }
}

TEST_F(ConvertVerb, AModelsMappingMayDropAColumnThatALogDoesNotHave) {
  ASSERT_EQ(torsio("simulate dfki-50 sweep --duration 20s -o a.csv").exit_code, 0);
  ASSERT_EQ(shell("awk -F, -v OFS=, '{ print NR == 1 ? \"i_1\" : NR, $0 }' a.csv >b.csv; "
                  "echo 'drop: [i_1]' >map.yaml")
                .exit_code,
            0);
  const Outcome fit = torsio("fit b.csv --mapping map.yaml --model linear -o m.safetensors");
  ASSERT_EQ(fit.exit_code, 0) << fit.err;
  EXPECT_EQ(torsio("estimate m.safetensors a.csv -o e.csv").exit_code, 0);
  EXPECT_EQ(torsio("evaluate m.safetensors a.csv").exit_code, 0);
}

TEST_F(ConvertVerb, OneBagMakesAModelForEachOfItsJoints) {
  ASSERT_EQ(torsio("simulate dfki-50 sweep --duration 20s -o a.csv").exit_code, 0);
  ASSERT_EQ(
      shell("awk -F, -v OFS=, 'NR == 1 { print $1, \"elbow_gear_rad\", \"elbow_joint_rad\", "
            "\"elbow_torque_Nm\", \"wrist_gear_rad\", \"wrist_joint_rad\", \"wrist_torque_Nm\" "
            "} NR > 1 { print $1, $3, $4, $6, 2 * $3, 2 * $4, $6 }' a.csv >both.csv; "
            "{torsio} convert both.csv -o both.npz")
          .exit_code,
      0);
  ASSERT_EQ(
      shell("printf 'joints: [elbow, wrist]\nchannels:\n"
            "  gear_angle_rad: \"{joint}_gear_rad\"\n  joint_angle_rad: \"{joint}_joint_rad\"\n"
            "  torque_Nm: \"{joint}_torque_Nm\"\n' >arm.yaml")
          .exit_code,
      0);
  const std::string fit =
      "fit both.npz --mapping arm.yaml --model linear --inputs "
      "'gear_angle_rad - joint_angle_rad' ";
  const Outcome each = torsio(fit + "-o '{joint}.safetensors' --json '{joint}.json'");
  ASSERT_EQ(each.exit_code, 0) << each.err;
  const auto rmse_Nm = [&](const std::string& joint) {
    const Outcome shown = torsio("evaluate " + joint + ".safetensors both.npz --json -");
    EXPECT_EQ(shown.exit_code, 0) << shown.err;  // with the mapping of the joint, from the model
    return nlohmann::json::parse(shown.out).at("results").at(0).at("rmse").get<double>();
  };
  EXPECT_NEAR(rmse_Nm("elbow"), rmse_Nm("wrist"), 1e-4);
  EXPECT_NE(contents("elbow.json"), "");
  const Outcome one = torsio(fit + "-o m.safetensors");
  EXPECT_EQ(one.exit_code, kCallWasWrong);
  EXPECT_NE(one.err.find("one of the joints elbow, wrist"), std::string::npos) << one.err;
  EXPECT_EQ(torsio(fit + "--joint wrist -o m.safetensors").exit_code, 0);
  EXPECT_EQ(torsio(fit + "-o '{joint}.safetensors' --json one.json").exit_code, kCallWasWrong);
  EXPECT_EQ(torsio(fit + "--joint elbow,knee -o '{joint}.safetensors'").exit_code, kCallWasWrong);
}

}  // namespace
}  // namespace torsio::test

// The torque of a log without a torque channel, and the mapping that a model file contains.
#include <nlohmann/json.hpp>

#include "program/program.hpp"

namespace torsio::test {
namespace {

class EstimateVerb : public Program {
 protected:
  /// a.csv, the model m.safetensors, and log.csv without the torque.
  void record() {
    ASSERT_EQ(torsio("simulate dfki-50 sweep --duration 20s --lever 0.24m -o a.csv").exit_code, 0);
    ASSERT_EQ(torsio("fit a.csv --model linear_coulomb -o m.safetensors").exit_code, 0);
    remove_columns("a.csv", "log.csv");
  }
  /// Copies what is not named torque.
  void remove_columns(const std::string& from, const std::string& to) {
    ASSERT_EQ(shell("awk -F, -v OFS=, 'NR == 1 { for (i = 1; i <= NF; ++i) if ($i !~ /torque/) "
                    "keep[++n] = i } { row = $keep[1]; for (k = 2; k <= n; ++k) row = row OFS "
                    "$keep[k]; print row }' " +
                    from + " >" + to)
                  .exit_code,
              0);
    ASSERT_EQ(contents(to).find("torque"), std::string::npos);
  }
  void expect_refused(const std::string& call, int exit_code, const std::string& text) {
    const Outcome outcome = torsio(call);
    EXPECT_EQ(outcome.exit_code, exit_code) << call << "\n" << outcome.err;
    EXPECT_NE(outcome.err.find(text), std::string::npos) << call << "\n" << outcome.err;
    EXPECT_EQ(outcome.out, "");
  }
};

TEST_F(EstimateVerb, GivesTheTorqueOfALogWithoutATorqueChannel) {
  record();
  EXPECT_NE(torsio("evaluate m.safetensors log.csv").exit_code, 0) << "it scores";
  const Outcome outcome = torsio("estimate m.safetensors log.csv -o out.csv --json out.json");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_NE(outcome.out.find("no fault %"), std::string::npos) << outcome.out;
  EXPECT_NE(outcome.out.find("largest error bar"), std::string::npos) << outcome.out;
  const std::string csv = contents("out.csv");
  EXPECT_EQ(csv.substr(0, csv.find('\n')),
            "t_s,gear_angle_rad,joint_angle_rad,estimated_torque_Nm,torque_std_dev_Nm,fault,"
            "recording");
  EXPECT_NE(csv.find(",warming_up,log\n"), std::string::npos);
  EXPECT_NE(csv.find(",none,log\n"), std::string::npos);
  const auto json = nlohmann::json::parse(contents("out.json"));
  const auto& row = json.at("results").at(0);
  EXPECT_EQ(row.at("samples"), 20000);
  EXPECT_GT(row.at("faults").at("none"), 19000);
  EXPECT_GT(row.at("highest"), row.at("lowest"));
  EXPECT_EQ(torsio("estimate m.safetensors log.csv --json -").out, contents("out.json"));
  EXPECT_EQ(torsio("estimate m.safetensors log.csv -o -").out, csv);
}

TEST_F(EstimateVerb, TakesSeveralRecordingsAndManifests) {
  record();
  ASSERT_EQ(
      shell("cp log.csv second.csv; printf 'files: [log.csv, second.csv]\n' >set.yaml").exit_code,
      0);
  for (const char* recordings : {"log.csv second.csv", "set.yaml"}) {
    const Outcome outcome =
        torsio(std::string("estimate m.safetensors ") + recordings + " -o out.csv");
    ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
    const std::string csv = contents("out.csv");
    EXPECT_NE(csv.find(",none,log\n"), std::string::npos) << recordings;
    EXPECT_NE(csv.find(",none,second\n"), std::string::npos) << recordings;
  }
}

TEST_F(EstimateVerb, NeverOverwritesWhatItReads) {
  record();
  shell("printf 'files: [log.csv]\n' >set.yaml");
  const std::string log = contents("log.csv");
  for (const char* call :
       {"estimate m.safetensors log.csv -o log.csv", "estimate m.safetensors set.yaml -o log.csv",
        "estimate m.safetensors set.yaml --json log.csv"})
    expect_refused(call, kCallWasWrong, "this output would replace a file that is read");
  EXPECT_EQ(contents("log.csv"), log);
  expect_refused("estimate m.safetensors log.csv -o m.safetensors", kCallWasWrong,
                 "would replace a file that is read");
  expect_refused("estimate m.safetensors log.csv -o out.json", kCallWasWrong,
                 "a file that ends in .csv or .gz");
  expect_refused("estimate m.safetensors", kCallWasWrong, "at least one recording");
  shell("printf 't_s,joint_angle_rad\\n0,1\\n0.001,1\\n0.002,1\\n' >half.csv");
  expect_refused("estimate m.safetensors half.csv -o out.csv", kWorkFailed, "gear_angle_rad");
  EXPECT_EQ(contents("out.csv"), "");
}

TEST_F(EstimateVerb, PredictionsWithoutARecordingAreRefused) {
  record();
  expect_refused("evaluate m.safetensors --predictions out.csv", kCallWasWrong,
                 "--predictions: expected a recording that it refers to");
  expect_refused("evaluate m.safetensors --rate 100Hz", kCallWasWrong, "--rate: expected");
}

TEST_F(EstimateVerb, DescribesStiffnessLoopWidthAndFriction) {
  record();
  const Outcome outcome = torsio("evaluate m.safetensors");
  for (const char* text : {"stiffness ", "Nm/rad", "loop width ", "friction "})
    EXPECT_NE(outcome.out.find(text), std::string::npos) << outcome.out;
  for (const char* key : {"fit_percent", "max_abs", "std_abs"})
    EXPECT_EQ(outcome.out.find(key), std::string::npos) << outcome.out;
  const auto json = nlohmann::json::parse(torsio("evaluate m.safetensors --json -").out);
  EXPECT_NEAR(json.at("slow_cycle").at("stiffness_Nm_rad"), 573.0, 100.0);
  EXPECT_EQ(json.at("slow_cycle").at("points").size(), 9U);
}

/// A log with columns of its own, and the model that was trained with the mapping of that log.
class MappingOfAModel : public EstimateVerb {
 protected:
  void record_foreign() {
    ASSERT_EQ(torsio("simulate dfki-50 sweep --duration 20s --lever 0.24m -o a.csv").exit_code, 0);
    ASSERT_EQ(shell("sed -e '1s/gear_angle_rad/enc1/;1s/joint_angle_rad/enc2/;"
                    "1s/torque_Nm/cell/;1s/torque_fresh_1/cell_fresh_1/' a.csv >foreign.csv")
                  .exit_code,
              0);
    folder_.file("map.yaml",
                 "channels:\n  gear_angle_rad: enc1\n  joint_angle_rad: enc2\n"
                 "  torque_Nm: {from: cell, sign: -1}\n");
    ASSERT_NE(torsio("fit foreign.csv --model linear -o m.safetensors").exit_code, 0);
    const Outcome fit =
        torsio("fit foreign.csv --mapping map.yaml --model linear -o m.safetensors");
    ASSERT_EQ(fit.exit_code, 0) << fit.err;
    shell("rm map.yaml");
  }
};

TEST_F(MappingOfAModel, IsUsedUnlessAnotherIsGiven) {
  record_foreign();
  const Outcome evaluate = torsio("evaluate m.safetensors foreign.csv --json out.json");
  ASSERT_EQ(evaluate.exit_code, 0) << evaluate.err;
  EXPECT_NE(evaluate.err.find("the mapping that the model was trained with"), std::string::npos)
      << evaluate.err;
  const auto rmse = nlohmann::json::parse(contents("out.json")).at("results").at(0).at("rmse");
  EXPECT_LT(rmse, 5.0);
  // Without the torque, whose rule then has no column.
  shell("sed -e '1s/cell/torque/g' foreign.csv >named.csv");
  remove_columns("named.csv", "log.csv");
  const Outcome estimate = torsio("estimate m.safetensors log.csv -o out.csv");
  EXPECT_EQ(estimate.exit_code, 0) << estimate.err;
  // Another one: the torque with the other sign.
  folder_.file("plus.yaml",
               "channels: {gear_angle_rad: enc1, joint_angle_rad: enc2, torque_Nm: cell}");
  const Outcome other =
      torsio("evaluate m.safetensors foreign.csv --mapping plus.yaml --json out.json");
  EXPECT_EQ(other.exit_code, 0) << other.err;
  EXPECT_EQ(other.err.find("the mapping that the model was trained with"), std::string::npos);
  EXPECT_GT(nlohmann::json::parse(contents("out.json")).at("results").at(0).at("rmse"), 5.0);
  // None: the columns have no units.
  expect_refused("evaluate m.safetensors foreign.csv --mapping none", kWorkFailed, "enc1");
  // A log that has the channels by their names.
  expect_refused("evaluate m.safetensors a.csv", kWorkFailed, "--mapping none");
  EXPECT_EQ(torsio("evaluate m.safetensors a.csv --mapping none").exit_code, 0);
  EXPECT_NE(torsio("evaluate m.safetensors").out.find("torque_Nm: {from: cell"), std::string::npos);
}

TEST_F(MappingOfAModel, ReadsTheRecordingThatTrackReplays) {
  record_foreign();
  const std::string call =
      "track --actuator dfki-50 --reference replay --replay foreign.csv --duration 5s ";
  expect_refused(call, kWorkFailed, "enc1");
  // A model for a torque loop has a torque that rises with the deflection.
  folder_.file("plus.yaml",
               "channels: {gear_angle_rad: enc1, joint_angle_rad: enc2, torque_Nm: cell}");
  ASSERT_EQ(torsio("fit foreign.csv --mapping plus.yaml --model linear -o p.safetensors").exit_code,
            0);
  const Outcome outcome = torsio(call + "--model p.safetensors");
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
}

}  // namespace
}  // namespace torsio::test

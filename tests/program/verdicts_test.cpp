// What fit, compare and crossvalidate report where a person relies on a verdict: models that did not
// run, fits that diverged, recordings that `check` fails, motion of another kind.
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>

#include "program/program.hpp"

namespace torsio::test {
namespace {

class Verdicts : public Program {
 protected:
  void simulate(const std::string& arguments) {
    const Outcome outcome = torsio("simulate " + arguments);
    ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  }

  static void expect_in(const std::string& text, const std::string& part) {
    EXPECT_NE(text.find(part), std::string::npos) << part << " is not in\n" << text;
  }
};

TEST_F(Verdicts, CompareDoesNotRankTheFallbackOfTheGuards) {
  simulate("dfki-50 chirp --amplitude 5Nm --duration 40s --seed 1 -o small.csv");
  simulate("dfki-50 chirp --amplitude 30Nm --duration 40s --seed 2 -o large.csv");
  const Outcome tables =
      torsio("compare small.csv --test large.csv --models linear,polynomial -o best.safetensors");
  EXPECT_EQ(tables.exit_code, 1);
  expect_in(tables.out, "not ranked\nNO RANKING: in ");
  expect_in(tables.err, "no model can be ranked");
  EXPECT_TRUE(contents("best.safetensors").empty());
  const Outcome document =
      torsio("compare small.csv --test large.csv --models linear,polynomial --json -");
  expect_in(document.err, "NO RANKING: in ");
  const auto json = nlohmann::json::parse(document.out);
  EXPECT_EQ(json.at("rankings").at(0).at("is_ranked"), false);
  EXPECT_LT(json.at("rankings").at(0).at("common_samples"),
            json.at("rankings").at(0).at("scored_samples"));
}

TEST_F(Verdicts, CompareStatesTheShareOfTheRankedSamples) {
  simulate("dfki-50 chirp --amplitude 20Nm --duration 40s --seed 1 -o train.csv");
  simulate("dfki-50 chirp --amplitude 26Nm --duration 40s --seed 2 -o test.csv");
  const Outcome compare = torsio("compare train.csv --test test.csv --models linear,polynomial");
  EXPECT_EQ(compare.exit_code, 0) << compare.err;
  expect_in(compare.out, "best first\nWARNING: in ");
  expect_in(compare.out, "in 1 sd %  in 2 sd %");
}

TEST_F(Verdicts, AModelThatDivergesOnItsTrainingDataIsNotWritten) {
  simulate("dfki-50 chirp --amplitude 5Nm --duration 40s --seed 1 -o a.csv");
  simulate("dfki-50 chirp --amplitude 4.5Nm --duration 40s --seed 2 -o b.csv");
  folder_.file("m.safetensors", "precious");
  const std::string inputs = " --inputs spring_deflection_rad ";
  const Outcome fit =
      torsio("fit a.csv --model arx --set refine=false -o m.safetensors --json m.json" + inputs);
  EXPECT_EQ(fit.exit_code, 1);
  expect_in(fit.err, "arx: diverged on its own training data: free run left the output's range");
  EXPECT_EQ(contents("m.safetensors"), "precious");
  const auto rows = nlohmann::json::parse(contents("m.json")).at("results");
  EXPECT_EQ(rows.at(0).at("status"), "diverged");

  const std::string models = " --models linear,arx:refine=false";
  const Outcome compare = torsio("compare a.csv --test b.csv" + models + inputs);
  EXPECT_EQ(compare.exit_code, 0) << compare.err;
  expect_in(compare.out, "not in the ranking:\n  arx[refine=false]: diverged: on its own training");
  const Outcome folds = torsio("crossvalidate a.csv b.csv --by record" + models + inputs);
  EXPECT_EQ(folds.exit_code, 0) << folds.err;
  expect_in(folds.out, "arx[refine=false]: diverged in 2 of 2 folds; a: on its own training data");
}

TEST_F(Verdicts, RepeatWhatCheckFails) {
  simulate("dfki-50 sweep --duration 40s --lever 0.24m --seed 1 -o a.csv");
  simulate("dfki-50 sweep --duration 40s --lever 0.17m --seed 2 -o b.csv");
  folder_.file("inverted.yaml",
               "channels: {torque_Nm: {from: torque_Nm, sign: -1}, torque_fresh_1: {from: "
               "torque_fresh_1}}\n");
  for (const std::string& call :
       {std::string("fit a.csv b.csv --model linear -o m.safetensors"),
        std::string("compare a.csv --test b.csv --models linear"),
        std::string("crossvalidate a.csv b.csv --by record --models linear")}) {
    const Outcome wrong = torsio(call + " --mapping inverted.yaml");
    EXPECT_EQ(wrong.exit_code, 0) << wrong.err;
    expect_in(wrong.err, "warning: torsio check: FAIL sign: a: torque_Nm falls with");
    EXPECT_EQ(torsio(call).err.find("torsio check"), std::string::npos) << call;
  }
}

TEST_F(Verdicts, WarnOfMotionOfAnotherKind) {
  simulate("dfki-50 sweep --duration 40s --lever 0.24m --seed 1 -o a.csv");
  simulate("dfki-50 sweep --duration 40s --lever 0.17m --seed 2 -o b.csv");
  simulate("dfki-50 random-walk --duration 40s --seed 3 -o walk.csv");
  const Outcome compare = torsio("compare a.csv b.csv --test walk.csv --models linear");
  expect_in(compare.err, "warning: walk moves spring_deflection_rad in another way");
  const Outcome folds = torsio("crossvalidate a.csv b.csv walk.csv --by record --models linear");
  expect_in(folds.err, "warning: walk: walk moves spring_deflection_rad in another way");
  EXPECT_EQ(torsio("compare a.csv --test b.csv --models linear").err.find("in another way"),
            std::string::npos);
}

TEST_F(Verdicts, DoNotWarnOfAMotionBetweenTwoOfTheTrainingAndHaveTheWarningOnThePage) {
  const std::string triangles = "elastomer triangles --duration 30s --amplitude ";
  simulate(triangles + "2Nm --frequency 0.4Hz -o slow.csv");
  simulate(triangles + "2Nm --frequency 4Hz --seed 2 -o fast.csv");
  simulate(triangles + "2Nm --frequency 1.26Hz --seed 3 -o between.csv");
  simulate(triangles + "0.2Nm --frequency 1.26Hz --seed 4 -o small.csv");
  const std::string call = "compare slow.csv fast.csv --models linear --report page.html --test ";
  const Outcome between = torsio(call + "between.csv");
  ASSERT_EQ(between.exit_code, 0) << between.err;
  EXPECT_EQ(between.err.find("in another way"), std::string::npos) << between.err;
  EXPECT_EQ(contents("page.html").find("in another way"), std::string::npos);
  expect_in(torsio("compare slow.csv --models linear --test between.csv").err, "in another way");
  expect_in(torsio(call + "small.csv").err, "warning: small moves");
  EXPECT_NE(contents("page.html").find("in another way"), std::string::npos);
}

TEST_F(Verdicts, SuggestTheChannelThatIsMeant) {
  simulate("dfki-50 sweep --duration 40s -o a.csv");
  const auto suggests = [this](const std::string& call, const std::string& channel) {
    const Outcome outcome = torsio(call);
    EXPECT_NE(outcome.exit_code, 0) << call;
    expect_in(outcome.err, "Did you mean '" + channel + "'?");
  };
  const std::string fit = "fit a.csv --model linear -o m.safetensors ";
  suggests(fit + "--target torqe_Nm", "torque_Nm");
  suggests(fit + "--inputs gear_angel_rad", "gear_angle_rad");
  suggests(fit + "--inputs spring_deflction_rad", "spring_deflection_rad");
  suggests(fit + "--inputs gear_angle_rad,joint_angle_rad --set schedule=joint_angel_rad",
           "joint_angle_rad");
  suggests("crossvalidate a.csv --models linear --by recrod", "record");
  folder_.file("wrong.yaml", "channels: {torque_Nm: {from: torqe_Nm}}\n");
  suggests(fit + "--mapping wrong.yaml", "torque_Nm");
}

}  // namespace
}  // namespace torsio::test

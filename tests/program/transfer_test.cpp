// A model of one joint used on another, as a user calls it.
#include <nlohmann/json.hpp>

#include "program/program.hpp"

namespace torsio::test {
namespace {

class TransferVerb : public Program {
 protected:
  void SetUp() override {
    for (const char* const call :
         {"simulate dfki-120#03 chirp --amplitude 60Nm --duration 60s -o base.csv",
          "simulate dfki-50#11 short-chirp --seed 4 -o new.csv",
          "simulate dfki-50#11 random-walk --amplitude 10Nm --duration 30s --seed 5 -o walk.csv",
          "fit base.csv --model grey_box --set residual=none -o base.safetensors"})
      ASSERT_EQ(torsio(call).exit_code, 0) << call;
  }
  void expect_refused(const std::string& call, int exit_code, const std::string& text) {
    const std::string before = contents("base.safetensors");
    const Outcome outcome = torsio(call);
    EXPECT_EQ(outcome.exit_code, exit_code) << call << "\n" << outcome.err;
    EXPECT_NE(outcome.err.find(text), std::string::npos) << call << "\n" << outcome.err;
    EXPECT_EQ(contents("base.safetensors"), before);
    EXPECT_EQ(contents("new.safetensors"), "");
  }
};

TEST_F(TransferVerb, MakesAModelOfTheNewJoint) {
  const Outcome outcome = torsio(
      "transfer base.safetensors new.csv --test walk.csv --base-actuator dfki-120 --actuator "
      "dfki-50 --curve 5s,10s --plot curve.svg --device-serial J-11 -o new.safetensors --json "
      "t.json");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  for (const char* const text : {"data_sheets", "scaled", "refit", "chosen", "10 s of new data",
                                 "Learning curve, RMSE in Nm"})
    EXPECT_NE(outcome.out.find(text), std::string::npos) << text << "\n" << outcome.out;
  const auto json = nlohmann::json::parse(contents("t.json"));
  double base = 0.0;
  double chosen = 0.0;
  for (const auto& of : json.at("methods")) {
    if (of.at("method") == "none") base = of.at("rmse");
    if (of.at("method") == json.at("chosen")) chosen = of.at("rmse");
  }
  EXPECT_GT(base, 5.0);
  EXPECT_LT(chosen, 0.3);
  EXPECT_EQ(json.at("curve").size(), 2U);
  EXPECT_NE(contents("curve.svg").find("<svg"), std::string::npos);
  const Outcome evaluated = torsio("evaluate new.safetensors walk.csv --json e.json");
  EXPECT_EQ(evaluated.exit_code, 0) << evaluated.err;
}

TEST_F(TransferVerb, RefusesWhatItCannotUse) {
  const std::string call = "transfer base.safetensors new.csv --test walk.csv -o new.safetensors ";
  expect_refused(call + "--use 0.1s", 1, "samples with a measured torque_Nm after the filters");
  expect_refused("transfer base.safetensors new.csv -o new.safetensors", 1,
                 "something is left to score on");
  expect_refused(call + "--method best", 2, "expected one of auto, none, offset");
  expect_refused(call + "--method data_sheets", 2, "rated torque of both joints");
  expect_refused(call + "--actuator dfki-50", 2, "both or none");
  expect_refused(call + "--curve 5s,50s", 2, "ascending times of at most 10 s");
  expect_refused(call + "--stiffness-ratio -1", 2, "must be positive");
  ASSERT_EQ(shell("sed '1s/gear_angle_rad/other_rad/' new.csv > lacks.csv; "
                  "awk -F, -v OFS=, 'NR > 1 {$6 = 1.5} {print}' new.csv > dead.csv; "
                  "sed '1s/torque_Nm/force_N/' new.csv > unit.csv")
                .exit_code,
            0);
  expect_refused("transfer base.safetensors lacks.csv --test walk.csv -o new.safetensors", 1,
                 "gear_angle_rad");
  expect_refused("transfer base.safetensors dead.csv --test walk.csv -o new.safetensors", 1,
                 "a target that changes");
  expect_refused("transfer base.safetensors unit.csv --test walk.csv -o new.safetensors", 1,
                 "torque_Nm");
}

}  // namespace
}  // namespace torsio::test

// A model that is compared with recordings of a later day, as a user calls it.
#include <nlohmann/json.hpp>

#include "program/program.hpp"

namespace torsio::test {
namespace {

class DriftVerb : public Program {
 protected:
  void calibrate(const std::string& fit_options = "") {
    simulate("dfki-50#11 sweep --lever 0.24m --seed 1 -o a.csv");
    simulate("dfki-50#11 sweep --lever 0.17m --seed 2 -o b.csv");
    ASSERT_EQ(
        torsio("fit a.csv b.csv --model grey_box -o joint.safetensors " + fit_options).exit_code,
        0);
    simulate("dfki-50#11 sweep --lever 0.21m --inclination 10deg --seed 5 -o same.csv");
  }
  void simulate(const std::string& arguments) {
    const Outcome outcome = torsio("simulate " + arguments);
    ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  }
  void expect_refused(const std::string& call, int exit_code, const std::string& text) {
    const Outcome outcome = torsio(call);
    EXPECT_EQ(outcome.exit_code, exit_code) << call << "\n" << outcome.err;
    EXPECT_NE(outcome.err.find(text), std::string::npos) << call << "\n" << outcome.err;
    EXPECT_EQ(outcome.out, "");
  }
};

TEST_F(DriftVerb, ReportsAnAgedJointAndNotASoundOne) {
  calibrate();
  const std::string model = contents("joint.safetensors");
  const Outcome sound = torsio("drift joint.safetensors same.csv");
  EXPECT_EQ(sound.exit_code, 0) << sound.err;
  EXPECT_NE(sound.out.find("The joint has not changed"), std::string::npos) << sound.out;
  simulate("dfki-50#11 sweep --lever 0.21m --seed 6 --age 0.6 -o old.csv");
  const Outcome aged = torsio("drift joint.safetensors old.csv --json drift.json");
  EXPECT_EQ(aged.exit_code, 0) << aged.err;
  EXPECT_NE(aged.out.find("explain it:\na new calibration is worth it."), std::string::npos)
      << aged.out;
  const auto document = nlohmann::json::parse(contents("drift.json"));
  EXPECT_EQ(document.at("joint"), "changed");
  EXPECT_EQ(document.at("advice"), "calibrate");
  const auto& stiffness = document.at("quantities").at(1);
  EXPECT_EQ(stiffness.at("name"), "stiffness or gain");
  // -0.06; the break-away angles, which age by 0.6 as the friction does, take part of it (docs/robot/drift.md).
  EXPECT_NEAR(stiffness.at("relative").get<double>(), -0.05, 0.02);
  const auto& friction = document.at("quantities").at(2);
  EXPECT_NEAR(friction.at("relative").get<double>(), 0.6, 0.15);
  EXPECT_EQ(contents("joint.safetensors"), model);
}

TEST_F(DriftVerb, RefusesBadInput) {
  calibrate("--device-serial J-07");
  expect_refused("drift", kCallWasWrong, "no model file");
  expect_refused("drift joint.safetensors", kCallWasWrong, "REC");
  expect_refused("drift joint.safetensors same.csv --device-serial J-08", kWorkFailed, "J-08");
  expect_refused("drift joint.safetensors same.csv --json joint.safetensors", kCallWasWrong,
                 "joint.safetensors");
  expect_refused("drift joint.safetensors --campaign 2", kCallWasWrong, "no model file");
  shell("head -100 same.csv > brief.csv");
  expect_refused("drift joint.safetensors brief.csv", kWorkFailed, "too short");
  shell("cut -d, -f1-5 same.csv > no_torque.csv");
  expect_refused("drift joint.safetensors no_torque.csv", kWorkFailed, "torque_Nm");
  shell("awk -F, -v OFS=, 'NR > 1 { $6 = 3 } 1' same.csv > dead.csv");
  expect_refused("drift joint.safetensors dead.csv", kWorkFailed, "does not follow");
  shell("awk -F, -v OFS=, 'NR == 500 { $3 = \"nan\" } 1' same.csv > hole.csv");
  expect_refused("drift joint.safetensors hole.csv", kWorkFailed, "gear_angle_rad");
}

TEST_F(DriftVerb, RunsACampaignThatContinues) {
  const std::string call = "drift --campaign 2 --seed 3 --resume units.jsonl --json ";
  const Outcome first = torsio(call + "first.json");
  EXPECT_EQ(first.exit_code, 0) << first.err;
  EXPECT_NE(first.out.find("changed specimens found, with the right sign: 2 of 2"),
            std::string::npos)
      << first.out;
  const std::string units = contents("units.jsonl");
  EXPECT_EQ(torsio(call + "second.json").exit_code, 0);
  EXPECT_EQ(contents("first.json"), contents("second.json"));
  EXPECT_EQ(contents("units.jsonl"), units);
  expect_refused("drift --campaign 2 --seed 4 --resume units.jsonl", kWorkFailed, "units.jsonl");
}

}  // namespace
}  // namespace torsio::test

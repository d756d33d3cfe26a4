// A spring that is learned from a known load instead of a torque sensor.
#include <nlohmann/json.hpp>

#include "program/program.hpp"

namespace torsio::test {
namespace {

class KnownLoadProgram : public Program {
 protected:
  /// Sweeps with two levers, their manifest without the sensor, and the load file.
  void record() {
    for (const std::string lever : {"0.1", "0.24"})
      ASSERT_EQ(torsio("simulate dfki-50 sweep --duration 20s --truth --lever " + lever + "m -o l" +
                       lever + ".csv")
                    .exit_code,
                0);
    (void)folder_.file("sweeps.yaml",
                       "mapping: {drop: [torque_Nm, torque_fresh_1, 'truth_*']}\n"
                       "files:\n"
                       "  - {file: l0.1.csv, conditions: {lever_m: 0.1}}\n"
                       "  - {file: l0.24.csv, conditions: {lever_m: 0.24}}\n");
    write_load("0.15kg_m2");
  }
  void write_load(const std::string& joint_inertia) {
    (void)folder_.file(
        "load.yaml",
        "load:\n  pendulum: {mass: 9kg, length: lever_m}\n  joint_inertia: " + joint_inertia +
            "\n  zero: 0deg\nload_uncertainty: {mass: 0.5%, length: 1mm}\n");
  }
  Outcome fit(const std::string& more = {}) {
    return torsio("fit sweeps.yaml --load load.yaml --model grey_box -o m.safetensors " + more);
  }
};

TEST_F(KnownLoadProgram, LearnsASpringThatIsScoredAgainstAnyTorque) {
  record();
  const Outcome fitted = fit();
  ASSERT_EQ(fitted.exit_code, 0) << fitted.err;
  EXPECT_NE(fitted.err.find("the target is the torque of the load in load.yaml"), std::string::npos)
      << fitted.err;
  const Outcome truth =
      torsio("evaluate m.safetensors l0.24.csv --target truth_torque_Nm --json truth.json");
  ASSERT_EQ(truth.exit_code, 0) << truth.err;
  const auto json = nlohmann::json::parse(contents("truth.json"));
  EXPECT_EQ(json.at("target"), "truth_torque_Nm");
  EXPECT_LT(json.at("results").at(0).at("rmse"), 0.15);
  // The sensor of the bench, whose column the training did not read.
  EXPECT_EQ(torsio("evaluate m.safetensors l0.24.csv").exit_code, 0);
  const Outcome load = torsio("evaluate m.safetensors sweeps.yaml --load load.yaml");
  EXPECT_EQ(load.exit_code, 0) << load.err;
  const Outcome described = torsio("evaluate m.safetensors --json card.json");
  EXPECT_EQ(described.exit_code, 0) << described.err;
  const auto card = nlohmann::json::parse(contents("card.json"));
  EXPECT_EQ(card.at("load").at("loads").size(), 2U);
  EXPECT_GT(card.at("load").at("load_error_Nm"), 0.0);
}

TEST_F(KnownLoadProgram, IsRefusedWhereItIsNoLoadOrTheInputIsItsComputation) {
  record();
  const Outcome leak = fit("--inputs 'spring_deflection_rad, joint_angle_rad'");
  EXPECT_EQ(leak.exit_code, kCallWasWrong);
  EXPECT_NE(leak.err.find("only occurs in the deflection"), std::string::npos) << leak.err;
  (void)folder_.file("all.yaml", "files: [{file: l0.24.csv, conditions: {lever_m: 0.24}}]");
  const Outcome twice = torsio("fit all.yaml --load load.yaml --model linear -o m.safetensors");
  EXPECT_EQ(twice.exit_code, kCallWasWrong);
  EXPECT_NE(twice.err.find("--target load_torque_Nm"), std::string::npos) << twice.err;
  EXPECT_EQ(torsio("fit all.yaml --load load.yaml --target load_torque_Nm --model linear -o "
                   "m.safetensors")
                .exit_code,
            0);
  const Outcome unit = torsio("evaluate m.safetensors all.yaml --target gear_angle_rad");
  EXPECT_EQ(unit.exit_code, kCallWasWrong);
  write_load("fit");
  const Outcome one = torsio("check all.yaml --load load.yaml --target load_torque_Nm");
  EXPECT_EQ(one.exit_code, kWorkFailed);
  EXPECT_NE(one.err.find("all recordings have the same load"), std::string::npos) << one.err;
}

TEST_F(KnownLoadProgram, IsTheTargetOfComparisonsAndFolds) {
  record();
  ASSERT_EQ(
      torsio("simulate dfki-50 sweep --duration 20s --lever 0.17m --seed 7 -o new.csv").exit_code,
      0);
  (void)folder_.file("new.yaml",
                     "mapping: {drop: [torque_Nm, torque_fresh_1]}\n"
                     "files: [{file: new.csv, conditions: {lever_m: 0.17}}]\n");
  const std::string models = " --load load.yaml --models linear,polynomial,maxwell_slip --json -";
  const Outcome compared = torsio("compare sweeps.yaml --test new.yaml" + models);
  ASSERT_EQ(compared.exit_code, 0) << compared.err;
  EXPECT_LT(nlohmann::json::parse(compared.out).at("results").at(0).at("rmse"), 1.5);
  const Outcome folds = torsio("crossvalidate sweeps.yaml --folds 3" + models);
  ASSERT_EQ(folds.exit_code, 0) << folds.err;
  EXPECT_EQ(nlohmann::json::parse(folds.out).at("target"), "torque_Nm");
}

TEST_F(KnownLoadProgram, IsChecked) {
  record();
  const Outcome checked = torsio("check sweeps.yaml --load load.yaml");
  EXPECT_EQ(checked.exit_code, 0) << checked.out << checked.err;
  EXPECT_NE(checked.out.find("known load"), std::string::npos) << checked.out;
}

TEST_F(KnownLoadProgram, LearnsFromTheConditionsThatAnExperimentInTheAirLogs) {
  for (const std::string lever : {"0.1", "0.2"})
    ASSERT_EQ(
        torsio("simulate harmonic-drive:soft air-chirp --duration 30s --highest 4Hz --mass 12kg "
               "--lever " +
               lever + "m -o a" + lever + ".csv --json a.json")
            .exit_code,
        0);
  const auto json = nlohmann::json::parse(contents("a.json"));
  EXPECT_EQ(json.at("mass_kg"), 12.0);
  EXPECT_EQ(json.at("highest_frequency_Hz"), 4.0);
  EXPECT_TRUE(json.at("lowest_frequency_Hz").is_null());
  (void)folder_.file(
      "load.yaml",
      "load:\n  pendulum: {mass: mass_kg, length: lever_m}\n  joint_inertia: 1kg_m2\n");
  const Outcome fitted = torsio(
      "fit a0.1.csv a0.2.csv --load load.yaml --target load_torque_Nm --model linear "
      "--inputs 'motor_angle_rad / 2 - wave_generator_angle_rad' -o m.safetensors");
  ASSERT_EQ(fitted.exit_code, 0) << fitted.err;
  const Outcome refused = torsio("simulate dfki-50 air-chirp --lever 0.5m --mass 20kg -o b.csv");
  EXPECT_EQ(refused.exit_code, kCallWasWrong);
  EXPECT_NE(refused.err.find("the lever is too heavy"), std::string::npos) << refused.err;
}

}  // namespace
}  // namespace torsio::test

// A drive that is identified, and used again from its file.
#include <nlohmann/json.hpp>

#include "program/program.hpp"

namespace torsio::test {
namespace {

class IdentifyProgram : public Program {
 protected:
  void record(int count) {
    for (int seed = 1; seed <= count; ++seed)
      ASSERT_EQ(torsio("simulate dfki-50 air-chirp --duration 8s --lever 0.2m --mass 9kg --seed " +
                       std::to_string(seed) + " -o air" + std::to_string(seed) + ".csv")
                    .exit_code,
                0);
    (void)folder_.file("load.yaml", "load: {pendulum: {mass: mass_kg, length: lever_m}}\n");
  }
};

TEST_F(IdentifyProgram, EvaluatesADriveFromItsFileWithoutAFit) {
  record(3);
  const Outcome identified = torsio(
      "identify air1.csv air2.csv --load load.yaml --terms load_friction --starts 1 -o joint.json");
  ASSERT_EQ(identified.exit_code, 0) << identified.err;
  const Outcome again = torsio("identify air1.csv air2.csv --from joint.json --json again.json");
  ASSERT_EQ(again.exit_code, 0) << again.err;
  const auto fitted = nlohmann::json::parse(contents("joint.json"));
  const auto evaluated = nlohmann::json::parse(contents("again.json"));
  EXPECT_EQ(fitted.at("schema_version"), 1);
  EXPECT_NEAR(evaluated.at("mae_rad").get<double>(), fitted.at("mae_rad").get<double>(), 1e-12);
  EXPECT_EQ(evaluated.at("groups"), 0);
  const Outcome other = torsio(
      "identify air3.csv --from joint.json --write mjcf joint.xml --starts 1 --report page.html");
  ASSERT_EQ(other.exit_code, 0) << other.err;
  EXPECT_NE(other.out.find("air3"), std::string::npos);
  EXPECT_NE(other.out.find("nothing was fitted here"), std::string::npos);
  EXPECT_NE(contents("joint.xml").find("<mujoco"), std::string::npos);
  EXPECT_NE(contents("page.html").find("that were not fitted here"), std::string::npos);
}

TEST_F(IdentifyProgram, RefusesOptionsThatHaveNoEffectOnADriveFromAFile) {
  record(1);
  for (const char* const more : {"--terms delay", "--spring", "--no-nested", "-o other.json"}) {
    const Outcome outcome = torsio(std::string("identify air1.csv --from joint.json ") + more);
    EXPECT_EQ(outcome.exit_code, kCallWasWrong) << more;
  }
  const Outcome missing = torsio("identify air1.csv --from joint.json");
  EXPECT_EQ(missing.exit_code, kWorkFailed);
  EXPECT_NE(missing.err.find("joint.json"), std::string::npos) << missing.err;
  EXPECT_EQ(torsio("identify air1.csv").exit_code, kCallWasWrong);
}

TEST_F(IdentifyProgram, RefusesAFileThatItCannotWriteBeforeTheFit) {
  record(1);
  for (const char* const more : {"--write bam servo.json", "--write mjcf a.xml --name 2go",
                                 "--spring --terms delay", "--name elbow"}) {
    const Outcome outcome =
        torsio(std::string("identify air1.csv --load load.yaml --starts 100 ") + more);
    EXPECT_EQ(outcome.exit_code, kCallWasWrong) << more;
    EXPECT_EQ(outcome.out, "") << more;
  }
}

TEST_F(IdentifyProgram, RefusesALawThatTheValuesAreNotOf) {
  record(2);
  ASSERT_EQ(torsio("identify air1.csv air2.csv --load load.yaml --terms load_friction --starts 1 "
                   "--no-standard-errors -o joint.json")
                .exit_code,
            0);
  (void)folder_.file("torque.yaml", "drive: {law: torque}\n");
  const Outcome outcome = torsio("identify air1.csv --from joint.json --drive torque.yaml");
  EXPECT_EQ(outcome.exit_code, kCallWasWrong);
  EXPECT_NE(outcome.err.find("expected the law 'pd'"), std::string::npos) << outcome.err;
}

/// The recordings of a drive without a spring: the command, one angle and the conditions.
constexpr const char* kOneAngle =
    "mapping: {drop: [gear_angle_rad, joint_angle_rad, torque_Nm, torque_fresh_1]}\n"
    "target: motor_angle_rad\nfiles: [air1.csv, air2.csv]\n";

TEST_F(IdentifyProgram, IsAdvisedByTheCheckOfADriveWithoutASpring) {
  record(2);
  (void)folder_.file("drive.yaml", kOneAngle);
  const Outcome outcome =
      torsio("check drive.yaml --load load.yaml --advise --json check.json --report check.html");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_NE(outcome.err.find("the drive is identified for the advice"), std::string::npos)
      << outcome.err;
  EXPECT_NE(outcome.out.find("WARN  drive: recordings"), std::string::npos) << outcome.out;
  const auto advice = nlohmann::json::parse(contents("check.json")).at("drive_advice");
  ASSERT_GE(advice.size(), 3U);
  EXPECT_LT(advice.front().at("standard_error_ratio").get<double>(), 1.0);
  EXPECT_NE(outcome.out.find(advice.front().at("recording").get<std::string>()), std::string::npos);
  EXPECT_NE(contents("check.html").find("What to record next for torsio identify"),
            std::string::npos);
  EXPECT_EQ(torsio("check drive.yaml --load load.yaml --drive law.yaml").exit_code, kCallWasWrong);
  EXPECT_EQ(torsio("check drive.yaml --advise --drive law.yaml").exit_code, kCallWasWrong);
}

}  // namespace
}  // namespace torsio::test

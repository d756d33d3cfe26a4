// The coupling by finite elements as a user types it.
#include <nlohmann/json.hpp>

#include "program/program.hpp"

namespace torsio::test {
namespace {

class DesignCoupling : public Program {
 protected:
  bool solver_installed() { return shell("command -v ccx").exit_code == 0; }

  static void expect_error(const Outcome& outcome, int exit_code, const std::string& text) {
    EXPECT_EQ(outcome.exit_code, exit_code) << outcome.err;
    EXPECT_NE(outcome.err.find(text), std::string::npos) << outcome.err;
  }
};

TEST_F(DesignCoupling, RefusesACallBeforeAnySolverIsStarted) {
  const std::string coupling = "design coupling --json a.json ";
  const std::string rubber = "--shear-modulus 4MPa ";
  expect_error(torsio(coupling + "--angle 3deg"), kCallWasWrong,
               "--measured-torque or --shear-modulus");
  expect_error(torsio(coupling + "--angle 3deg --measured-torque 5Nm " + rubber), kCallWasWrong,
               "found both");
  expect_error(torsio(coupling + rubber), kCallWasWrong, "--angle");
  expect_error(torsio(coupling + rubber + "--angle 3deg --geometry omega"), kCallWasWrong,
               "alpha, beta, gamma, delta");
  expect_error(torsio(coupling + rubber + "--angle 3deg --half-width 5mm"), kCallWasWrong,
               "jaws between the lobes");
  // A flank radius below 0 is a convex jaw, and is read as such.
  expect_error(torsio(coupling + rubber + "--angle 3deg --flank-radius -1mm"), kCallWasWrong,
               "at least half the flank's chord");
  expect_error(torsio(coupling + rubber + "--angle 3deg --bulk-ratio 0"), kCallWasWrong,
               "bulk modulus of rubber");
  expect_error(torsio(coupling + rubber + "--angle 40deg"), kCallWasWrong, "0.01 to 30 degrees");
  expect_error(torsio(coupling + rubber + "--angle 3deg --mesh tiny"), kCallWasWrong, "medium");
  expect_error(torsio(coupling + rubber + "--angle 3deg --jobs 0"), kCallWasWrong, "jobs");
  expect_error(torsio(coupling + rubber + "--angle 3deg --strain-limit 0pct"), kCallWasWrong,
               "--strain-limit");
  expect_error(torsio(coupling + "--search 5"), kCallWasWrong, "--shear-modulus");
  expect_error(torsio(coupling + rubber + "--search 5 --angle 3deg"), kCallWasWrong,
               "a call without --search");
  expect_error(torsio(coupling + rubber + "--search 5 --half-width 2mm"), kCallWasWrong,
               "a call without --search");
  expect_error(torsio(coupling + rubber + "--search 0"), kCallWasWrong, "--search");
  expect_error(torsio(coupling + rubber + "--angle 3deg --layers 50"), kCallWasWrong, "layers");
  EXPECT_EQ(contents("a.json"), "");
}

TEST_F(DesignCoupling, NamesThePackageOfASolverThatIsMissing) {
  expect_error(
      shell("PATH=/nowhere {torsio} design coupling --angle 3deg --shear-modulus 4MPa --sheet "
            "a.yaml"),
      kWorkFailed, "apt-get install calculix-ccx");
  EXPECT_EQ(contents("a.yaml"), "");
}

TEST_F(DesignCoupling, IsCalibratedOnOnePointAndSimulated) {
  if (!solver_installed()) GTEST_SKIP() << "CalculiX (ccx) is not installed";
  const std::string coupling = "design coupling --mesh coarse --angle 3deg ";
  const Outcome table = torsio(coupling +
                               "--measured-torque 6Nm --json a.json --yaml a.yaml --sheet "
                               "joint.yaml --plot a.svg");
  ASSERT_EQ(table.exit_code, 0) << table.err;
  const auto json = nlohmann::json::parse(contents("a.json"));
  EXPECT_NEAR(json.at("torque").at("at_3_deg_Nm"), 6.0, 1e-9);
  EXPECT_NE(contents("a.yaml").find("shear_modulus_MPa"), std::string::npos);
  EXPECT_NE(contents("a.svg").find("<desc>Strain of the compressed lobe at 3 deg"),
            std::string::npos);
  EXPECT_NE(contents("joint.yaml").find("torque_curve"), std::string::npos);
  EXPECT_EQ(torsio("simulate joint.yaml static-cycle --duration 5s -o a.csv").exit_code, 0);
  // The modulus of the calibration gives the measured torque again, with one solver at a time, too.
  const double modulus_MPa = json.at("material").at("shear_modulus_MPa");
  ASSERT_EQ(torsio(coupling + "--jobs 1 --json b.json --shear-modulus " +
                   std::to_string(modulus_MPa) + "MPa")
                .exit_code,
            0);
  EXPECT_NEAR(nlohmann::json::parse(contents("b.json")).at("torque").at("at_3_deg_Nm"), 6.0, 1e-4);
}

TEST_F(DesignCoupling, FindsTheTwistOfAStrainAndWritesNoSheetWhereItIsNotReached) {
  if (!solver_installed()) GTEST_SKIP() << "CalculiX (ccx) is not installed";
  const std::string coupling =
      "design coupling --mesh coarse --angle 3deg --shear-modulus 4MPa --json a.json ";
  ASSERT_EQ(torsio(coupling + "--strain-limit 15pct").exit_code, 0);
  const auto found = nlohmann::json::parse(contents("a.json"));
  EXPECT_GT(found.at("at_strain_limit").at("angle_deg"), 0.5);
  EXPECT_LT(found.at("at_strain_limit").at("angle_deg"), 3.0);
  EXPECT_LT(found.at("at_strain_limit").at("torque_Nm"), found.at("torque").at("at_3_deg_Nm"));
  expect_error(torsio(coupling + "--strain-limit 90pct --sheet joint.yaml --plot a.svg"),
               kWorkFailed, "is not reached up to 3 deg");
  const auto missing = nlohmann::json::parse(contents("a.json"));
  EXPECT_EQ(missing.at("feasible"), false);
  EXPECT_EQ(missing.at("at_strain_limit").at("angle_deg"), "not reached");
  EXPECT_EQ(contents("joint.yaml") + contents("a.svg"), "");
}

TEST_F(DesignCoupling, RemovesItsFolderAfterASignal) {
  if (!solver_installed()) GTEST_SKIP() << "CalculiX (ccx) is not installed";
  const Outcome stopped = shell(
      "mkdir tmp; export TMPDIR=$PWD/tmp; {torsio} design coupling --angle 15deg --shear-modulus "
      "4MPa --mesh fine --sheet a.yaml & job=$!; while ! ls tmp/* >/dev/null 2>&1; do sleep 0.02; "
      "done; kill -TERM $job; wait $job; code=$?; ls -A tmp; exit $code");
  EXPECT_EQ(stopped.exit_code, 143) << stopped.err;
  EXPECT_EQ(stopped.out, "");
  EXPECT_EQ(contents("a.yaml"), "");
}

}  // namespace
}  // namespace torsio::test

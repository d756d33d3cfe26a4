#include "torsio/design/coupling/lobe_twist.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <fstream>
#include <sstream>

#include "torsio/core/error.hpp"

namespace torsio::design {
namespace {

using testing::HasSubstr;

LobeMesh coarse_delta() {
  return mesh_lobe(paper_lobe("delta"), {.radial = 8, .across = 6, .grading = 1.0});
}

const Rubber kRubber = {.shear_modulus_MPa = 1.0, .bulk_modulus_MPa = 500.0};

bool solver_installed() { return std::system("command -v ccx > /dev/null 2>&1") == 0; }

TEST(LobeTwist, RefusesMaterialsWithoutABulkModulusAndTwistsOutOfRange) {
  const LobeMesh mesh = coarse_delta();
  EXPECT_THROW((void)twist_deck(mesh, {1.0, 0.0}, {1.0}), UsageError);
  EXPECT_THROW((void)twist_deck(mesh, {NAN, 500.0}, {1.0}), UsageError);
  EXPECT_THROW((void)twist_deck(mesh, kRubber, {}), UsageError);
  EXPECT_THROW((void)twist_deck(mesh, kRubber, {90.0}), UsageError);
}

TEST(LobeTwist, KeepsNoStepOfOutputThatIsMissingOrGarbled) {
  const LobeMesh mesh = coarse_delta();
  for (const char* text : {"", "garbage",
                           " forces (fx,fy,fz) for set MOV and time  0.1000000E+01\n"
                           "\n  1  nan 1 2\n"}) {
    const TwistCurve curve = read_twists(mesh, {1.0, 2.0}, text);
    EXPECT_TRUE(curve.steps.empty());
    EXPECT_THAT(curve.stopped_by, HasSubstr("twist of 1 degrees not reached"));
  }
}

TEST(LobeTwist, SaysWhatToInstallWithoutASolver) {
  try {
    (void)twist_lobe(coarse_delta(), kRubber, {1.0}, {.program = "no_such_solver"});
    FAIL() << "a missing solver was accepted";
  } catch (const Error& error) {
    EXPECT_THAT(error.what(), HasSubstr("calculix-ccx"));
  }
}

TEST(LobeTwist, TakesNoResultFromAProgramThatSucceedsWithoutOutput) {
  const TwistCurve curve = twist_lobe(coarse_delta(), kRubber, {1.0}, {.program = "true"});
  EXPECT_TRUE(curve.steps.empty());
  EXPECT_THAT(curve.stopped_by, HasSubstr("no result"));
}

TEST(LobeTwist, ReadsRecordedOutputAndKeepsTheStepsBeforeADefect) {
  const LobeMesh mesh = mesh_lobe(paper_lobe("delta"), {.radial = 2, .across = 2, .grading = 1.0});
  std::ifstream file(RECORDED_OUTPUT "/delta_2x2_1_and_3_degrees.dat");
  std::ostringstream recorded;
  recorded << file.rdbuf();
  const std::string text = recorded.str();
  const TwistCurve whole = read_twists(mesh, {1.0, 3.0}, text);
  ASSERT_EQ(whole.steps.size(), 2U) << whole.stopped_by;
  EXPECT_EQ(whole.stopped_by, "");
  const double ratio = whole.steps[1].torque_N / whole.steps[0].torque_N;
  EXPECT_GT(ratio, 3.0);  // compression stiffens the lobe
  EXPECT_LT(ratio, 4.5);
  const TwistCurve cut = read_twists(mesh, {1.0, 3.0}, text.substr(0, text.size() - 200));
  ASSERT_EQ(cut.steps.size(), 1U);
  EXPECT_THAT(cut.stopped_by, HasSubstr("twist of 3 degrees not reached"));
}

// Reference: 79.0 Nmm/mm and 34.4 Nmm/mm on an 8 x 6 mesh of wedges with K/G = 500, from another
// mesher and reader (a feasibility study).
TEST(LobeTwist, ReproducesTheTorquesOfDeltaAtSixDegrees) {
  if (!solver_installed()) GTEST_SKIP() << "CalculiX (ccx) is not installed";
  const TwistCurve compressed = twist_lobe(coarse_delta(), kRubber, {1.0, 3.0, 6.0}, {});
  ASSERT_EQ(compressed.steps.size(), 3U) << compressed.stopped_by;
  EXPECT_NEAR(std::abs(compressed.steps[2].torque_N), 79.0, 0.8);
  EXPECT_GE(compressed.steps[2].strain, compressed.steps[2].strain_outside_300um);
  EXPECT_GE(compressed.steps[2].strain_outside_300um, compressed.steps[2].strain_outside_800um);
  const TwistCurve stretched = twist_lobe(coarse_delta(), kRubber, {-1.0, -6.0}, {});
  ASSERT_EQ(stretched.steps.size(), 2U) << stretched.stopped_by;
  EXPECT_NEAR(std::abs(stretched.steps[1].torque_N), 34.4, 0.35);
  EXPECT_LT(stretched.steps[1].torque_N * compressed.steps[2].torque_N, 0.0);
}

TEST(LobeTwist, KeepsTheStepsBeforeTheOneThatDoesNotConverge) {
  if (!solver_installed()) GTEST_SKIP() << "CalculiX (ccx) is not installed";
  const TwistCurve curve = twist_lobe(coarse_delta(), kRubber, {1.0, 30.0}, {});
  ASSERT_EQ(curve.steps.size(), 1U);
  EXPECT_THAT(curve.stopped_by, HasSubstr("twist of 30 degrees not reached"));
}

}  // namespace
}  // namespace torsio::design

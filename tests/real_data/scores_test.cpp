// What the families make of the real recordings: brackets around what was measured, 20 % headroom,
// to be tightened by each improvement.
#include <string>

#include "real_data/real_data.hpp"
#include "torsio/data/load.hpp"
#include "torsio/evaluate/comparison.hpp"

namespace torsio {
namespace {

struct Model {
  const char* family;
  const char* variant;
  const char* input_set;
};

/// RMSE on the test split: on one recording, or on all together.
double test_rmse(const Results& results, const Model& model, const std::string& recording = {}) {
  for (const ResultRow& row : results.rows)
    if (row.split == Role::test && row.family == model.family && row.variant == model.variant &&
        row.input_set == model.input_set && row.recording.value_or("") == recording)
      return row.score.metrics.rmse;
  ADD_FAILURE() << model.family << " " << model.variant << " " << model.input_set << " "
                << recording;
  return 0.0;
}

TEST(DesrFootScores, OfTheDualCamBetweenTrainedSupports) {
  TORSIO_NEEDS_DATA("desr_dualcam");
  const Results results = compared("desr_dualcam", "all");
  EXPECT_EQ(results.label, "support positions between the trained ones");
  const Model linear{"linear", "", "plain"};
  EXPECT_NEAR(test_rmse(results, linear, "dualcam_x10"), 11.3, 0.2);
  EXPECT_NEAR(test_rmse(results, linear, "dualcam_x35"), 12.4, 0.2);
  const Model products{"linear", "", "scheduled"};
  EXPECT_NEAR(test_rmse(results, products, "dualcam_x10"), 4.9, 0.7);
  EXPECT_NEAR(test_rmse(results, products, "dualcam_x35"), 10.8, 0.5);
  const Model scheduled{"polynomial", "schedule=support_m", "plain"};
  EXPECT_LT(test_rmse(results, scheduled, "dualcam_x10"), 1.47);
  EXPECT_LT(test_rmse(results, scheduled, "dualcam_x35"), 2.98);
  const Model grey_box{"grey_box", "schedule=support_m", "plain"};
  EXPECT_LT(test_rmse(results, grey_box, "dualcam_x10"), 0.63);
  EXPECT_LT(test_rmse(results, grey_box, "dualcam_x35"), 1.58);
}

TEST(DesrFootScores, WithinOneCycleAndOnAnotherMechanism) {
  TORSIO_NEEDS_DATA("desr_cam1_interpolation");
  const Model polynomial{"polynomial", "", "plain"};
  const Model linear{"linear", "", "plain"};
  const Model dgmm{"dgmm", "", "plain"};
  const Results cam1 = compared("desr_cam1_interpolation", "linear,polynomial,dgmm");
  EXPECT_EQ(cam1.label, "interpolation within one cycle");
  EXPECT_LT(test_rmse(cam1, polynomial), 3.04);
  EXPECT_LT(test_rmse(cam1, dgmm), 1.85);
  const Results cam2 = compared("desr_cam2_interpolation", "linear,polynomial,dgmm");
  EXPECT_LT(test_rmse(cam2, polynomial), 3.81);
  EXPECT_LT(test_rmse(cam2, dgmm), 2.86);
  const Results other = compared("desr_cam1_to_cam2", "linear,polynomial,dgmm");
  EXPECT_EQ(other.label, "different mechanism");
  EXPECT_GT(test_rmse(other, polynomial),
            0.7 * test_rmse(other, linear));  // nothing carries over between the cams
}

class CycloidalScores : public testing::TestWithParam<std::string> {};

TEST_P(CycloidalScores, OfOtherPreloadsOfTheSameDrive) {
  TORSIO_NEEDS_DATA(GetParam());
  const Results results = compared(GetParam(), "linear,linear_coulomb,polynomial");
  EXPECT_TRUE(results.non_causal_zero);
  const double linear = test_rmse(results, {"linear", "", "plain"});
  EXPECT_LT(linear, 6.1);
  EXPECT_LT(test_rmse(results, {"linear_coulomb", "", "plain"}), 0.9 * linear);
  EXPECT_LT(test_rmse(results, {"polynomial", "", "plain"}), 0.65 * linear);
}

TEST_P(CycloidalScores, RefuseTheCurrentThatTheTorqueWasComputedFrom) {
  TORSIO_NEEDS_DATA(GetParam());
  const Dataset dataset = load_dataset({manifest_path(GetParam())}, {});
  const auto choices = model_choices(dataset, "linear", {"output_angle_rad", "iq_A"});
  EXPECT_THROW((void)compare(dataset, choices, 1, false), UsageError);
}

INSTANTIATE_TEST_SUITE_P(All, CycloidalScores,
                         testing::Values("cycloidal_base910_reamed", "cycloidal_base_onyx_runin",
                                         "cycloidal_split_onyx_runin", "cycloidal_split_onyx_6pre"),
                         [](const auto& design) { return design.param; });

}  // namespace
}  // namespace torsio

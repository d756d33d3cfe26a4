#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "evaluate/left_ranges.hpp"
#include "evaluate/slope_change.hpp"
#include "evaluate/trained.hpp"
#include "evaluate/unused_inputs.hpp"
#include "model/grey_box/grey_box.hpp"
#include "support/bench_dataset.hpp"
#include "torsio/files/model_file.hpp"

namespace torsio {
namespace {

using test::trained;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

std::vector<std::string> slopes_of(const ModelFile& file, const test::BenchOptions& options,
                                   double torque_factor = 1.0) {
  Dataset dataset;
  test::add_record(dataset,
                   test::changed(test::bench_recording("today", options),
                                 [&](Channel& channel) {
                                   if (channel.name != "torque_Nm") return;
                                   for (double& value : channel.values) value *= torque_factor;
                                 }),
                   Role::test);
  const std::vector<ScoredRun> runs = scored_runs(make_estimator(file), dataset, {});
  return slope_warnings(file, runs);
}

TEST(SlopeWarnings, StateTheFactorOfASofterJoint) {
  const ModelFile file = trained(test::bench_dataset(), "linear_coulomb").file;
  EXPECT_THAT(slopes_of(file, {.seed = 9}), IsEmpty());
  EXPECT_THAT(slopes_of(file, {.stiffness_Nm_rad = 490.0, .seed = 9}), IsEmpty());
  EXPECT_THAT(slopes_of(file, {.stiffness_Nm_rad = 350.0, .seed = 9}),
              ElementsAre(HasSubstr("today: torque_Nm rises 0.7")));
  EXPECT_THAT(slopes_of(file, {.seed = 9}, 0.1),
              ElementsAre(HasSubstr("rises 0.10 times as steeply with spring_deflection_rad as in "
                                    "the training")));
  EXPECT_THAT(slopes_of(file, {.seed = 9}, -1.0),
              ElementsAre(HasSubstr("torque_Nm falls where it rose")));
}

TEST(SlopeWarnings, TakeNoNoiseForAnotherSlope) {
  const ModelFile file = trained(test::bench_dataset(), "linear_coulomb").file;
  EXPECT_THAT(slopes_of(file, {.noise_Nm = 5.0, .seed = 9}), IsEmpty());
}

TEST(UnusedInputs, AreThoseOfAGreyBoxWhoseCoefficientsAre0) {
  const Dataset dataset = test::bench_dataset();
  ModelFile file = trained(dataset, "grey_box").file;
  const std::size_t last = file.settings.features.inputs.size() - 1;
  auto* const box = file.parameters.get_if<GreyBox::Parameters>();
  ASSERT_NE(box, nullptr);
  box->terms.banks.clear();
  box->residual.reset();
  Matrix& values = box->coefficients.values;
  Matrix kept(values.rows, box->terms.columns());
  for (std::size_t k = 0; k < kept.rows; ++k)
    for (std::size_t j = 0; j < kept.columns; ++j) kept(k, j) = values(k, j);
  for (std::size_t k = 0; k < kept.rows; ++k) {
    kept(k, box->terms.first_slope() + last) = 1.0;
    kept(k, box->terms.first_coulomb() + last) = 0.0;
  }
  values = kept;
  EXPECT_FALSE(is_without_effect(AnyModel(file.parameters), last));
  for (std::size_t k = 0; k < values.rows; ++k) values(k, box->terms.first_slope() + last) = 0.0;
  EXPECT_TRUE(is_without_effect(AnyModel(file.parameters), last));
  EXPECT_FALSE(is_without_effect(AnyModel(file.parameters), 0));
  file.settings.ranges.lowest[last] = 0.0;
  file.settings.ranges.highest[last] = 1e-3;
  EXPECT_THAT(left_range_warnings(file.settings, AnyModel(file.parameters), dataset),
              testing::Contains(HasSubstr("it has no effect on this model: fit again")));
}

TEST(UnusedInputs, AreThoseThatWereConstantInTheTrainingOfAnyFamily) {
  const Dataset dataset = test::bench_dataset();
  for (const char* family : {"linear", "polynomial", "maxwell_slip"}) {
    ModelFile file = trained(dataset, family).file;
    const std::size_t last = file.settings.features.inputs.size() - 1;
    ASSERT_GT(last, 0U);
    const AnyModel model(file.parameters);
    EXPECT_EQ(reason_to_leave_out(file.settings, model, last), "") << family;
    file.settings.ranges.lowest[last] = file.settings.ranges.highest[last] = 0.0;
    EXPECT_EQ(reason_to_leave_out(file.settings, model, last), "was constant in the training")
        << family;
    EXPECT_THAT(left_range_warnings(file.settings, model, dataset),
                testing::Contains(HasSubstr("it was constant in the training: fit again with")))
        << family;
  }
}

}  // namespace
}  // namespace torsio

#include "report/model_description.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "model/network/ensemble.hpp"
#include "support/example_model_file.hpp"
#include "support/examples/gaussian_process.hpp"
#include "support/examples/linear.hpp"
#include "support/examples/network.hpp"
#include "support/examples/viscoelastic.hpp"
#include "torsio/import/import_network.hpp"

namespace torsio {
namespace {

using testing::HasSubstr;

std::string described(const ModelFile& file) { return model_description(file, slow_cycle(file)); }

TEST(ModelDescription, HasNoKeysOfADocumentInItsText) {
  ModelFile file = test::example_model_file(test::example<MlpEnsemble>());
  file.card.metrics = {{"fit_percent", 97.25}, {"max_abs", 0.5}, {"rmse", 0.1}};
  file.card.options = {{"adaptation.method", "nlms"}, {"adaptation.step_size", "0.1"}};
  const std::string text = described(file);
  EXPECT_THAT(text, HasSubstr("fit % 97.25, max|e| 0.5 Nm, RMSE 0.1 Nm\n"));
  EXPECT_THAT(text, HasSubstr("adapted with method nlms, step size 0.1\n"));
  for (const char* key : {"fit_percent", "max_abs", "adaptation.", "residual_std", "layers."})
    EXPECT_THAT(text, testing::Not(HasSubstr(key)));
}

TEST(ModelDescription, ShowsTheMappingOfTheTraining) {
  ModelFile file = test::example_model_file(test::example<Linear>());
  file.card.mapping = "channels:\n  torque_Nm: {from: tau}\n";
  EXPECT_THAT(described(file), HasSubstr("  channels:\n    torque_Nm: {from: tau}\n"));
}

TEST(ModelDescription, StatesTheUncertaintyOfTheReferenceSensor) {
  ModelFile file = test::example_model_file(test::example<Linear>());
  EXPECT_THAT(described(file), testing::Not(HasSubstr("reference sensor")));
  EXPECT_THAT(model_description_json(file, slow_cycle(file)),
              HasSubstr("\"target_uncertainty\": null"));
  file.settings.target_uncertainty = {.constant = 0.21, .relative = 0.006};
  EXPECT_THAT(described(file),
              HasSubstr("reference sensor: sqrt((0.21 Nm)^2 + (0.6 % of the value)^2) "
                        "(standard uncertainty), as stated with the recordings"));
  EXPECT_THAT(model_description_json(file, slow_cycle(file)), HasSubstr("\"relative\": 0.006"));
}

TEST(ModelDescription, OfANetworkIsALineALayer) {
  const std::string text = described(test::example_model_file(test::example<MlpEnsemble>()));
  EXPECT_THAT(text, HasSubstr("(mlp_ensemble) for torque_Nm at 1000 Hz"));
  EXPECT_THAT(text, HasSubstr("members 2 layers 0: weights 4 x 2, bias 4, tanh\n"));
  EXPECT_THAT(text, HasSubstr("members 2 layers 1: weights 1 x 4, bias 1, linear\n"));
  EXPECT_THAT(text, HasSubstr("residual std = 0.7\n"));
}

TEST(ModelDescription, OfALineNamesItsCoefficientsAndTheirUnits) {
  const std::string text = described(test::example_model_file(test::example<Linear>()));
  EXPECT_THAT(text, testing::ContainsRegex("k1 \\(spring_deflection_rad\\) +600 +Nm/rad"));
  EXPECT_THAT(text, testing::ContainsRegex("b +0.5 +Nm"));
}

TEST(ModelDescription, SaysWhichZerosTheModelWants) {
  ModelFile file = test::example_model_file(test::example<Linear>());
  EXPECT_THAT(described(file), HasSubstr("requires the zero of joint_angle_rad: set_zero("));
  file.settings.zeroed_channels.clear();
  EXPECT_THAT(described(file), testing::Not(HasSubstr("set_zero")));
}

TEST(ModelDescription, DoesNotCallAnOpenRangeTrainedOn) {
  ModelFile file = test::example_model_file(test::example<Linear>());
  file.settings.ranges.lowest[0] = -kOpenRange;
  file.settings.ranges.highest[0] = kOpenRange;
  const std::string text = described(file);
  EXPECT_THAT(text, testing::Not(HasSubstr("e+300")));
  EXPECT_THAT(text, HasSubstr("open: the range of the training data is not known"));
}

TEST(ModelDescription, StatesAKernelAsAnExpressionWithItsNumbers) {
  const std::string text = described(test::example_model_file(test::example<ParametricGp>()));
  EXPECT_THAT(text, HasSubstr("kernel se*(linear+periodic*rq): se (length 1)"));
  EXPECT_THAT(text, testing::Not(HasSubstr("kernel nodes")));
}

TEST(ModelDescription, StatesANetworkOfSpringsAsItsText) {
  const std::string text = described(test::example_model_file(test::example<Viscoelastic>()));
  EXPECT_THAT(text, HasSubstr("network series(kv(k1=900, d1=60), kv(k2=4000, d2=2000), "
                              "parallel(k3=2500, maxwell(k4=300, d4=15)))\n"));
  EXPECT_THAT(text, testing::Not(HasSubstr("nodes")));
}

}  // namespace
}  // namespace torsio

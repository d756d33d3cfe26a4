#include "torsio/report/model_description.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "support/example_model_file.hpp"
#include "support/example_models.hpp"

namespace torsio {
namespace {

using testing::HasSubstr;

TEST(ModelDescription, OfANetworkIsALineALayer) {
  const std::string text =
      model_description(test::example_model_file(test::example<MlpEnsemble>()));
  EXPECT_THAT(text, HasSubstr("(mlp_ensemble) for torque_Nm at 1000 Hz"));
  EXPECT_THAT(text, HasSubstr("members.2.layers.0: weights 4 x 2, bias 4, tanh\n"));
  EXPECT_THAT(text, HasSubstr("members.2.layers.1: weights 1 x 4, bias 1, linear\n"));
  EXPECT_THAT(text, HasSubstr("residual_std = 0.7\n"));
}

TEST(ModelDescription, OfALineTellsItsNumbers) {
  EXPECT_THAT(model_description(test::example_model_file(test::example<Linear>())),
              HasSubstr("coefficients.values = 0.5, 600, 0.25\n"));
}

TEST(ModelDescription, StatesAKernelAsAnExpressionWithItsNumbers) {
  const std::string text =
      model_description(test::example_model_file(test::example<ParametricGp>()));
  EXPECT_THAT(text, HasSubstr("kernel se*(linear+periodic*rq): se (length 1)"));
  EXPECT_THAT(text, testing::Not(HasSubstr("kernel.nodes")));
}

TEST(ModelDescription, StatesANetworkOfSpringsAsItsText) {
  const std::string text =
      model_description(test::example_model_file(test::example<Viscoelastic>()));
  EXPECT_THAT(text, HasSubstr("network series(kv(k1=900, d1=60), kv(k2=4000, d2=2000), "
                              "parallel(k3=2500, maxwell(k4=300, d4=15)))\n"));
  EXPECT_THAT(text, testing::Not(HasSubstr("nodes")));
}

}  // namespace
}  // namespace torsio

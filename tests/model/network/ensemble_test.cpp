#include "model/network/ensemble.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "support/examples/network.hpp"
#include "support/random_network.hpp"
#include "torsio/core/error.hpp"

namespace torsio {
namespace {

using testing::HasSubstr;

TEST(Ensemble, ReturnsTheMeanOfItsMembersAndTheirSpread) {
  auto ensemble = test::example<GruEnsemble>();
  std::vector<Gru> members;
  for (const auto& parameters : ensemble.parameters().members) members.emplace_back(parameters);
  const Matrix features = test::example_features(50, 2);
  for (std::size_t n = 0; n < features.rows; ++n) {
    const Estimate estimate = ensemble.step(features.row(n));
    std::vector<double> values;
    for (Gru& member : members) values.push_back(member.step(features.row(n)).value);
    const double mean = (values[0] + values[1] + values[2]) / 3.0;
    double squares = 0.0;
    for (const double value : values) squares += (value - mean) * (value - mean);
    const double spread = std::sqrt(squares / 2.0);
    const double residual = ensemble.parameters().residual_std;
    ASSERT_NEAR(estimate.value, mean, 1e-12 * std::abs(mean));
    ASSERT_NEAR(estimate.std_dev, std::hypot(residual, spread), 1e-10);
    ASSERT_NEAR(estimate.novelty, spread / residual, 1e-10);
    ASSERT_EQ(estimate.fault, n < 3 ? Fault::warming_up : Fault::none) << n;
  }
}

std::string complaint(const MlpEnsemble::Parameters& parameters) {
  try {
    MlpEnsemble{parameters};
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

TEST(Ensemble, RefusesMembersThatDoNotBelongTogether) {
  const auto good = test::example<MlpEnsemble>().parameters();
  EXPECT_EQ(complaint(good), "");
  auto alone = good;
  alone.members.resize(1);
  EXPECT_THAT(complaint(alone), HasSubstr("mlp_ensemble: expected 2 to 64 members, found 1"));
  auto certain = good;
  certain.residual_std = 0.0;
  EXPECT_THAT(complaint(certain), HasSubstr("a positive residual_std"));
  auto unlike = good;
  unlike.members.push_back(test::random_network<Mlp>({.inputs = 3}, 1));
  EXPECT_THAT(complaint(unlike), HasSubstr("members with the same inputs, found 3 inputs"));
  auto clocks = test::example<LstmEnsemble>().parameters();
  clocks.members[1].sample_period_s *= 2.0;
  EXPECT_THROW(LstmEnsemble{clocks}, Error);
}

}  // namespace
}  // namespace torsio

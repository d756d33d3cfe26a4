#include "numerics/jackknife.hpp"

#include <gtest/gtest.h>

#include <vector>

namespace torsio {
namespace {

TEST(Jackknife, OfAMeanHasTheVarianceOfTheMean) {
  const std::vector<double> samples{1.0, 4.0, -2.0, 3.0, 0.5};
  const auto count = static_cast<double>(samples.size());
  double sum = 0.0;
  for (const double sample : samples) sum += sample;
  double square = 0.0;
  std::vector<double> without_one;
  for (const double sample : samples) {
    square += (sample - sum / count) * (sample - sum / count);
    without_one.push_back((sum - sample) / (count - 1.0));
  }
  EXPECT_NEAR(jackknife_variance(without_one), square / (count - 1.0) / count, 1e-12);
}

}  // namespace
}  // namespace torsio

#include "evaluate/drift/torque_parts.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace torsio::test {
namespace {

TEST(TorqueParts, SeparatesTheElasticCurveFromTheLoop) {
  constexpr std::size_t kCount = 20'000;
  constexpr double kStiffness = 500.0;
  constexpr double kFriction = 2.0;
  constexpr double kThreshold = 0.001;
  std::vector<double> x(kCount);
  std::vector<double> output(kCount);
  std::vector<double> loop(kCount);
  std::vector<std::size_t> rows;
  Matrix features(kCount, 1);
  double stop = 0.0;
  for (std::size_t n = 0; n < kCount; ++n) {
    const double t = 0.001 * static_cast<double>(n);
    x[n] = 0.04 * std::sin(2.0 * t) + 0.01 * std::sin(7.0 * t);
    if (n > 0) stop = std::clamp(stop + x[n] - x[n - 1], -kThreshold, kThreshold);
    loop[n] = kFriction * stop / kThreshold;
    output[n] = kStiffness * (x[n] - 0.005) + loop[n];
    features(n, 0) = x[n];
    if (n % 8 == 0) rows.push_back(n);
  }
  const PartsRun run{.x = x, .features = &features, .output = output, .rows = rows};
  const TorqueParts parts = torque_parts(std::span(&run, 1), -0.05, 0.05);
  ASSERT_EQ(parts.friction.size(), rows.size());
  double error = 0.0;
  for (std::size_t k = 0; k < rows.size(); ++k) {
    error += std::pow(parts.friction[k] - loop[rows[k]], 2);
    EXPECT_NEAR(parts.elastic[k], kStiffness * (x[rows[k]] - 0.005), 0.2 * kFriction);
  }
  EXPECT_LT(std::sqrt(error / static_cast<double>(rows.size())), 0.05 * kFriction);
  EXPECT_NEAR(parts.middle, 0.005, 0.0005);
}

}  // namespace
}  // namespace torsio::test

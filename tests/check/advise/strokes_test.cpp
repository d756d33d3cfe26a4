#include "check/advise/strokes.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include "support/numbers.hpp"
#include "torsio/signal/excitation.hpp"

namespace torsio {
namespace {

using test::kRate_Hz;

TEST(Strokes, OfATriangleHaveItsAmplitudeAndFrequency) {
  Triangle triangle({.amplitude = 0.05, .frequency_Hz = 0.5}, kRate_Hz);
  std::vector<double> values(10000);
  for (double& value : values) value = 0.02 + triangle.step();
  const std::vector<Stroke> strokes = strokes_of(values, 0.003, kRate_Hz);
  ASSERT_EQ(strokes.size(), 11U);  // half a stroke at either end
  EXPECT_EQ(strokes.front().begin, 0U);
  EXPECT_EQ(strokes.back().end, values.size());
  for (std::size_t i = 1; i < strokes.size(); ++i) EXPECT_EQ(strokes[i].begin, strokes[i - 1].end);
  for (std::size_t i = 1; i + 1 < strokes.size(); ++i) {
    EXPECT_NEAR(strokes[i].amplitude(), 0.05, 1e-3);
    EXPECT_NEAR(strokes[i].centre(), 0.02, 1e-3);
    EXPECT_NEAR(strokes[i].frequency_Hz, 0.5, 0.01);
    EXPECT_NEAR(strokes[i].speed(), 0.1, 0.003);
    EXPECT_EQ(strokes[i].hold_s, 0.0);
  }
}

TEST(Strokes, PassOverNoiseAndMissingSamples) {
  std::vector<double> values(4000);
  for (std::size_t n = 0; n < values.size(); ++n)
    values[n] = std::sin(2.0 * std::numbers::pi * 0.5 * static_cast<double>(n) / kRate_Hz) +
                (n % 2 == 0 ? 0.02 : -0.02);
  values[1234] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(strokes_of(values, 0.1, kRate_Hz).size(), 5U);
  EXPECT_GT(strokes_of(values, 0.01, kRate_Hz).size(), 100U);
}

TEST(Strokes, RestsDoNotCountAsSlowMotion) {
  std::vector<double> values;
  for (int n = 0; n < 500; ++n) values.push_back(0.002 * n);
  for (int n = 0; n < 6000; ++n) values.push_back(1.0);
  for (int n = 0; n < 500; ++n) values.push_back(1.0 - 0.002 * n);
  const std::vector<Stroke> strokes = strokes_of(values, 0.1, kRate_Hz);
  ASSERT_EQ(strokes.size(), 2U);
  for (const Stroke& stroke : strokes) EXPECT_NEAR(stroke.frequency_Hz, 1.0, 0.02);
  EXPECT_NEAR(strokes[0].hold_s + strokes[1].hold_s, 6.0, 0.4);
}

TEST(Strokes, OfARecordingWithoutReversalAndWithoutValues) {
  EXPECT_EQ(strokes_of({0.0, 0.5, 1.0}, 0.1, kRate_Hz).size(), 1U);
  EXPECT_EQ(strokes_of({1.0, 1.0, 1.0}, 0.1, kRate_Hz).size(), 1U);
  EXPECT_TRUE(strokes_of({}, 0.1, kRate_Hz).empty());
  EXPECT_TRUE(strokes_of({std::numeric_limits<double>::quiet_NaN()}, 0.1, kRate_Hz).empty());
}

}  // namespace
}  // namespace torsio

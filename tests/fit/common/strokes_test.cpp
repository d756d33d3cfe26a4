#include "fit/common/strokes.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <numbers>
#include <span>
#include <vector>

#include "fit/common/guards.hpp"
#include "fit/common/held_out.hpp"
#include "fit/linear/fit_linear.hpp"
#include "numerics/reversals.hpp"
#include "support/example_data.hpp"

namespace torsio {
namespace {

/// Sines of an amplitude of 0.1, one after the other, each for six seconds, at 1 kHz.
TrainingData sines(std::span<const double> frequencies_Hz) {
  std::vector<double> values;
  for (const double frequency_Hz : frequencies_Hz)
    for (int n = 0; n < 6000; ++n)
      values.push_back(0.1 * std::sin(2.0 * std::numbers::pi * frequency_Hz * 0.001 * n));
  Matrix features(values.size(), 1);
  features.values = values;
  return test::training_data_of({{.expression = "spring_deflection_rad"}}, features,
                                [](std::span<const double> x) { return 100.0 * x[0]; });
}

TEST(Strokes, TheLongestIsThatOfTheSlowestMotion) {
  const TrainingData data = sines(std::array{4.0, 0.5});
  EXPECT_NEAR(stroke_dead_band(data), 0.01, 1e-6);
  EXPECT_NEAR(longest_stroke_s(data), 1.0, 0.15) << "the stroke between the sines is longer";
}

TEST(Strokes, OfOneFrequencyAreOneKind) {
  EXPECT_EQ(stroke_kinds(sines(std::array{1.0})).count, 1U);
  EXPECT_EQ(stroke_kinds(sines(std::array{1.0, 1.5})).count, 1U);
}

TEST(Strokes, OfDifferentDurationsAreGroupedFromTheShortestOn) {
  const TrainingData two = sines(std::array{0.5, 2.0});
  const StrokeKinds kinds = stroke_kinds(two);
  EXPECT_EQ(kinds.count, 2U);
  EXPECT_EQ(kinds.kinds[0][3000], 1U);
  EXPECT_EQ(kinds.kinds[0][9000], 0U);
  EXPECT_NEAR(kinds.novelty, 9.0 / 4.0, 0.3) << "four times as long: (4 - 1)^2 / 4";
  EXPECT_EQ(stroke_kinds(sines(std::array{0.5, 2.0, 8.0})).count, 3U);
}

TEST(Strokes, ErrorBarsAreWiderByWhatOtherRecordingsNeed) {
  EXPECT_GT(other_recordings_factor(1, kFewReversals), other_recordings_factor(2, kFewReversals));
  EXPECT_EQ(other_recordings_factor(3, kFewReversals), 1.0);
  EXPECT_GT(other_recordings_factor(3, 1), other_recordings_factor(3, kFewReversals));
  EXPECT_DOUBLE_EQ(error_share_with_all(3, 3) * error_share_with_all(3, 3),
                   (1.0 + 1.0 / 3.0) / (1.0 + 1.0 / 2.0));
  const TrainingData training = test::noisy_spring();
  const AnyModel model = Linear(fit_linear(training, {}).parameters);
  const FeatureSpec spec{.inputs = {"a", "b"}, .definitions = {}};
  const auto std_dev_of = [&](const HeldOutErrors& evidence,
                              const TrainingData* validation = nullptr) {
    return guarded_settings(spec, training, model, validation, evidence).residuals.std_dev;
  };
  EXPECT_DOUBLE_EQ(std_dev_of({.factor = 1.5}).front(), 1.5 * std_dev_of({}).front());
  EXPECT_EQ(std_dev_of({.least_std_dev = 1e3}).front(), 1e3);
  EXPECT_EQ(std_dev_of({.factor = 1.5}, &training), std_dev_of({}, &training))
      << "validation records are other recordings";
}

}  // namespace
}  // namespace torsio

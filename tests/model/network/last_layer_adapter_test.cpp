#include "model/last_layer_adapter.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "support/each_instruction_set.hpp"
#include "support/error_message.hpp"
#include "support/numbers.hpp"
#include "torsio/core/random.hpp"

namespace torsio {
namespace {

using test::error_message;
using test::kInfinity;
using test::kNaN;
using testing::HasSubstr;

constexpr double kPeriod_s = 1e-3;
constexpr double kScale = 40.0;  // Nm, of the target

std::vector<float> normals(std::size_t count, Random& random) {
  std::vector<float> values(count);
  for (float& value : values) value = static_cast<float>(random.normal());
  return values;
}

DenseLayer layer_of(std::size_t features, std::uint64_t seed) {
  Random random(seed);
  DenseLayer layer{.weights = FloatMatrix(1, features), .bias = {0.3F}};
  layer.weights.values = normals(features, random);
  return layer;
}

/// [w; b]
std::vector<double> numbers(const DenseLayer& layer) {
  std::vector<double> all(layer.weights.values.begin(), layer.weights.values.end());
  all.push_back(static_cast<double>(layer.bias.front()));
  return all;
}

/// W h~ in the target's unit.
double value_of(const DenseLayer& layer, const std::vector<float>& features) {
  auto sum = static_cast<double>(layer.bias.front());
  for (std::size_t j = 0; j < features.size(); ++j)
    sum += static_cast<double>(layer.weights(0, j)) * static_cast<double>(features[j]);
  return kScale * sum;
}

/// Nothing prevents an update.
AdaptationSettings unguarded(AdaptationRule rule = AdaptationRule::nlms) {
  return {.rule = rule,
          .step_size = 0.05,
          .leak = 0.0,
          .initial_covariance = 1.0,
          .largest_error = 1e9,
          .frozen_after_s = 0.0,
          .largest_change = 1e6,
          .comparison_s = 1e6};
}

/// A frozen layer, and an adapter whose references are the outputs of another layer.
class Pupil {
 public:
  Pupil(const AdaptationSettings& settings, std::size_t inputs, std::uint64_t seed = 1)
      : frozen(layer_of(inputs, seed)),
        teacher(frozen),
        adapter(settings, frozen, kScale, kPeriod_s),
        random_(seed + 100) {
    for (float& weight : teacher.weights.values) weight *= 1.1F;
    teacher.bias.front() -= 0.2F;
  }

  /// One step on random features. @returns the error before learning.
  double step() {
    features = normals(frozen.weights.columns, random_);
    return value_of(teacher, features) - adapter.step(features, value_of(frozen, features));
  }
  UpdateOutcome learn(double wrong_by = 0.0) {
    return adapter.learn({.value = value_of(teacher, features) + wrong_by});
  }
  /// The error after `count` updates.
  double trained_error(int count) {
    for (int i = 0; i < count; ++i) {
      (void)step();
      (void)learn();
    }
    return std::abs(step());
  }

  DenseLayer frozen;
  DenseLayer teacher;
  LastLayerAdapter adapter;
  std::vector<float> features;

 private:
  Random random_;
};

TEST(LastLayerAdapter, WithoutUpdatesReturnsTheNetworksOwnValueToTheBit) {
  for (const AdaptationRule rule : {AdaptationRule::nlms, AdaptationRule::rls}) {
    Pupil pupil(unguarded(rule), 13);
    for (int i = 0; i < 20; ++i) {
      (void)pupil.step();
      const double frozen = value_of(pupil.frozen, pupil.features);
      EXPECT_EQ(pupil.adapter.step(pupil.features, frozen), frozen);
    }
    EXPECT_EQ(pupil.adapter.adapted(), pupil.frozen);
    EXPECT_EQ(pupil.adapter.relative_change(), 0.0);
  }
}

TEST(LastLayerAdapter, NlmsTakesTheStepOfItsEquation) {
  AdaptationSettings settings = unguarded();
  settings.step_size = 0.7;
  settings.leak = 0.1;
  settings.regularisation = 0.5;
  test::on_each_instruction_set([&](const char* instructions) {
    SCOPED_TRACE(instructions);
    Pupil pupil(settings, 21);
    std::vector<double> deviation(22, 0.0);
    for (int i = 0; i < 5; ++i) {
      const double error = pupil.step() / kScale;
      std::vector<double> extended(pupil.features.begin(), pupil.features.end());
      extended.push_back(1.0);
      double square = 0.0;
      for (const double x : extended) square += x * x;
      EXPECT_EQ(pupil.learn(), UpdateOutcome::updated);
      for (std::size_t j = 0; j < 22; ++j)
        deviation[j] = 0.9 * deviation[j] + 0.7 * error * extended[j] / (0.5 + square);
    }
    const auto adapted = numbers(pupil.adapter.adapted());
    const auto frozen = numbers(pupil.frozen);
    for (std::size_t j = 0; j < 22; ++j) EXPECT_NEAR(adapted[j], frozen[j] + deviation[j], 1e-6);
  });
}

TEST(LastLayerAdapter, NlmsConvergesToANoiselessReference) {
  for (const double step_size : {0.05, 1.0, 1.9}) {
    AdaptationSettings settings = unguarded();
    settings.step_size = step_size;
    Pupil pupil(settings, 20);
    const double before = std::abs(pupil.step());
    EXPECT_LT(pupil.trained_error(6000), 1e-5 * before) << step_size;
    for (std::size_t j = 0; j < 20; ++j)
      EXPECT_NEAR(pupil.adapter.adapted().weights(0, j), pupil.teacher.weights(0, j), 1e-5);
  }
}

TEST(LastLayerAdapter, AFullNlmsStepMeetsTheSampleAndTwiceThatLeavesTheErrorAsLarge) {
  AdaptationSettings settings = unguarded();
  settings.regularisation = 1e-12;
  for (const auto& [step_size, left] : {std::pair{1.0, 0.0}, std::pair{1.999999, 1.0}}) {
    settings.step_size = step_size;
    Pupil pupil(settings, 9);
    const double error = pupil.step();
    (void)pupil.learn();
    const double after = value_of(pupil.teacher, pupil.features) -
                         pupil.adapter.step(pupil.features, value_of(pupil.frozen, pupil.features));
    EXPECT_NEAR(std::abs(after), left * std::abs(error), 1e-5 * std::abs(error));
  }
}

TEST(LastLayerAdapter, LeakLeadsBackToTheFrozenWeights) {
  AdaptationSettings settings = unguarded();
  Pupil pupil(settings, 8);
  (void)pupil.trained_error(3000);
  const double without = pupil.adapter.relative_change();
  settings.leak = 0.05;
  Pupil leaky(settings, 8);
  (void)leaky.trained_error(3000);
  EXPECT_LT(leaky.adapter.relative_change(), 0.8 * without);
}

/// argmin over W of sum lambda^(N - n) e_n^2 + lambda^N |W - W0|^2 / delta, as a difference to W0.
Eigen::VectorXd ridge(const Eigen::MatrixXd& extended, const Eigen::VectorXd& targets,
                      double forgetting, double delta) {
  const Eigen::Index size = extended.cols();
  Eigen::MatrixXd gram = Eigen::MatrixXd::Identity(size, size) / delta;
  Eigen::VectorXd moment = Eigen::VectorXd::Zero(size);
  for (Eigen::Index n = 0; n < extended.rows(); ++n) {
    const Eigen::VectorXd row = extended.row(n).transpose();
    gram = forgetting * gram + row * row.transpose();
    moment = forgetting * moment + targets(n) * row;
  }
  return gram.ldlt().solve(moment);
}

TEST(LastLayerAdapter, RlsEqualsRidgeLeastSquares) {
  // Sizes around whole vectors; 0.98 forgets half of it in 34 samples.
  for (const double forgetting : {1.0, 0.98})
    for (const std::size_t features : {1U, 7U, 8U, 30U}) {
      AdaptationSettings settings = unguarded(AdaptationRule::rls);
      settings.forgetting = forgetting;
      settings.initial_covariance = 0.25;
      settings.trace_cap = 1e12;
      test::on_each_instruction_set([&](const char* instructions) {
        SCOPED_TRACE(instructions);
        Pupil pupil(settings, features);
        Random noise(5);
        constexpr int kSamples = 60;
        const auto size = static_cast<Eigen::Index>(features + 1);
        Eigen::MatrixXd extended(kSamples, size);
        Eigen::VectorXd targets(kSamples);
        for (int n = 0; n < kSamples; ++n) {
          (void)pupil.step();
          const double wrong_by = noise.normal();
          EXPECT_EQ(pupil.learn(wrong_by), UpdateOutcome::updated);
          for (Eigen::Index j = 0; j + 1 < size; ++j)
            extended(n, j) = static_cast<double>(pupil.features[static_cast<std::size_t>(j)]);
          extended(n, size - 1) = 1.0;
          targets(n) = (value_of(pupil.teacher, pupil.features) + wrong_by -
                        value_of(pupil.frozen, pupil.features)) /
                       kScale;
        }
        const Eigen::VectorXd expected = ridge(extended, targets, forgetting, 0.25);
        const auto adapted = numbers(pupil.adapter.adapted());
        const auto frozen = numbers(pupil.frozen);
        for (std::size_t j = 0; j <= features; ++j)
          EXPECT_NEAR(adapted[j] - frozen[j], expected(static_cast<Eigen::Index>(j)), 5e-7);
        EXPECT_EQ(pupil.adapter.counts().covariance_resets, 0U);
      });
    }
}

TEST(LastLayerAdapter, RlsConvergesFasterThanNlms) {
  AdaptationSettings settings = unguarded(AdaptationRule::rls);
  settings.initial_covariance = 100.0;
  Pupil rls(settings, 40);
  Pupil nlms(unguarded(), 40);
  EXPECT_LT(rls.trained_error(120), 0.01 * nlms.trained_error(120));
}

TEST(LastLayerAdapter, RlsStaysSoundForLongWithoutExcitation) {
  // One direction only: what is not excited would grow by 1 / lambda with every sample.
  AdaptationSettings settings = unguarded(AdaptationRule::rls);
  settings.forgetting = 0.95;
  LastLayerAdapter adapter(settings, layer_of(30, 1), kScale, kPeriod_s);
  const std::vector<float> features(30, 0.5F);
  Random random(3);
  for (int n = 0; n < 20000; ++n) {
    (void)adapter.step(features, 0.0);
    EXPECT_EQ(adapter.learn({.value = 1.0 + 0.1 * random.normal()}), UpdateOutcome::updated);
  }
  EXPECT_NEAR(adapter.step(features, 0.0), 1.0, 0.2);
  const std::vector<float> other = normals(30, random);
  for (int n = 0; n < 100; ++n) {
    (void)adapter.step(other, 0.0);
    (void)adapter.learn({.value = 2.0 + 0.1 * random.normal()});
  }
  EXPECT_NEAR(adapter.step(other, 0.0), 2.0, 0.2);
  EXPECT_EQ(adapter.counts().covariance_resets, 0U);
}

// ---- guards -------------------------------------------------------------------------------------

TEST(LastLayerAdapter, ErrorsWithinTheNoiseChangeNoWeights) {
  AdaptationSettings settings = unguarded();
  settings.sensor_std = 2.0;
  Pupil pupil(settings, 5);
  pupil.teacher = pupil.frozen;
  (void)pupil.step();
  EXPECT_EQ(pupil.learn(5.9), UpdateOutcome::dead_zone);
  EXPECT_EQ(pupil.adapter.relative_change(), 0.0);
  (void)pupil.step();
  EXPECT_EQ(pupil.learn(6.1), UpdateOutcome::updated);
}

TEST(LastLayerAdapter, ErrorsBeyondTheLargestChangeNoWeights) {
  AdaptationSettings settings = unguarded();
  settings.largest_error = kNaN;  // the network's scale
  Pupil pupil(settings, 5);
  EXPECT_EQ(pupil.adapter.settings().largest_error, kScale);
  pupil.teacher = pupil.frozen;
  for (const double wrong_by : {kScale + 0.1, -kScale - 0.1, 1e300, -1e300}) {
    (void)pupil.step();
    EXPECT_EQ(pupil.learn(wrong_by), UpdateOutcome::error_too_large);
  }
  EXPECT_EQ(pupil.adapter.relative_change(), 0.0);
  (void)pupil.step();
  EXPECT_EQ(pupil.learn(kScale - 0.1), UpdateOutcome::updated);
}

TEST(LastLayerAdapter, AReferenceThatIsNotANumberChangesNothing) {
  for (const AdaptationRule rule : {AdaptationRule::nlms, AdaptationRule::rls}) {
    Pupil pupil(unguarded(rule), 6);
    Pupil twin(unguarded(rule), 6);
    for (int i = 0; i < 50; ++i) {
      (void)pupil.step();
      (void)twin.step();
      if (i % 3 == 0) {
        EXPECT_EQ(pupil.adapter.learn({.value = i % 2 == 0 ? kNaN : -kInfinity}),
                  UpdateOutcome::reference_not_finite);
      } else {
        EXPECT_EQ(pupil.learn(), UpdateOutcome::updated);
        (void)twin.learn();
      }
    }
    EXPECT_EQ(pupil.adapter.adapted(), twin.adapter.adapted());
    EXPECT_EQ(pupil.adapter.counts().of(UpdateOutcome::reference_not_finite), 17U);
  }
}

TEST(LastLayerAdapter, FeaturesThatAreNotNumbersAreReportedAndChangeNoWeights) {
  for (const AdaptationRule rule : {AdaptationRule::nlms, AdaptationRule::rls}) {
    Pupil pupil(unguarded(rule), 6);
    (void)pupil.trained_error(10);
    const DenseLayer before = pupil.adapter.adapted();
    for (const float bad :
         {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity()}) {
      std::vector<float> features(6, 0.1F);
      features[3] = bad;
      EXPECT_EQ(pupil.adapter.step(features, 7.0), 7.0);
      EXPECT_EQ(pupil.adapter.learn({.value = 1.0}), UpdateOutcome::no_estimate);
    }
    EXPECT_TRUE(std::isnan(pupil.adapter.step(std::vector<float>(6, 0.1F), kNaN)));
    EXPECT_EQ(pupil.adapter.learn({.value = 1.0}), UpdateOutcome::no_estimate);
    EXPECT_EQ(pupil.adapter.step(std::vector<float>(5, 0.1F), 3.0), 3.0);  // another network's
    EXPECT_EQ(pupil.adapter.adapted(), before);
    (void)pupil.step();
    EXPECT_EQ(pupil.learn(), UpdateOutcome::updated);
  }
}

TEST(LastLayerAdapter, HugeFeaturesLeaveTheStateFinite) {
  for (const AdaptationRule rule : {AdaptationRule::nlms, AdaptationRule::rls}) {
    AdaptationSettings settings = unguarded(rule);
    settings.initial_covariance = 1e12;
    settings.largest_error = 1e300;
    Pupil pupil(settings, 6);
    for (int n = 0; n < 20; ++n) {
      (void)pupil.adapter.step(std::vector<float>(6, n % 2 == 0 ? 3e38F : 1e-38F), 1.0);
      (void)pupil.adapter.learn({.value = 1e299});
      EXPECT_TRUE(std::isfinite(pupil.adapter.relative_change()));
    }
    (void)pupil.step();
    EXPECT_TRUE(std::isfinite(pupil.adapter.step(pupil.features, 0.0)));
  }
}

TEST(LastLayerAdapter, StaleReferencesChangeNoWeights) {
  AdaptationSettings settings = unguarded();
  settings.oldest_reference_s = 0.004;
  Pupil pupil(settings, 5);
  for (const auto& [age_s, outcome] :
       {std::pair{0.004, UpdateOutcome::updated}, std::pair{0.0041, UpdateOutcome::reference_stale},
        std::pair{kInfinity, UpdateOutcome::reference_stale},
        std::pair{kNaN, UpdateOutcome::reference_stale}}) {
    (void)pupil.step();
    EXPECT_EQ(pupil.adapter.learn({.value = 1.0, .age_s = age_s}), outcome) << age_s;
  }
}

TEST(LastLayerAdapter, AFrozenReferenceIsStaleWithNothingBetweenItsSamplesToo) {
  AdaptationSettings settings = unguarded();
  settings.frozen_after_s = 0.1;
  Pupil pupil(settings, 5);
  for (int n = 0; n < 800; ++n) {
    (void)pupil.step();
    const bool is_determined = n % 8 == 0;
    const UpdateOutcome estimate = pupil.adapter.learn({.value = is_determined ? 1.0 : kNaN});
    if (!is_determined) continue;
    EXPECT_EQ(estimate, n < 100 ? UpdateOutcome::updated : UpdateOutcome::reference_stale) << n;
  }
}

TEST(LastLayerAdapter, AFrozenReferenceIsStaleUntilItMoves) {
  AdaptationSettings settings = unguarded();
  settings.frozen_after_s = 0.1;
  Pupil pupil(settings, 5);
  for (int n = 0; n < 300; ++n) {
    (void)pupil.step();
    EXPECT_EQ(pupil.adapter.learn({.value = 1.0}),
              n < 100 ? UpdateOutcome::updated : UpdateOutcome::reference_stale);
  }
  (void)pupil.step();
  EXPECT_EQ(pupil.adapter.learn({.value = 1.1}), UpdateOutcome::updated);
}

TEST(LastLayerAdapter, ASaturatedReferenceChangesNoWeights) {
  AdaptationSettings settings = unguarded();
  settings.saturation = 50.0;
  Pupil pupil(settings, 5);
  for (const auto& [value, outcome] : {std::pair{49.9, UpdateOutcome::updated},
                                       std::pair{50.0, UpdateOutcome::reference_saturated},
                                       std::pair{-51.0, UpdateOutcome::reference_saturated}}) {
    (void)pupil.step();
    EXPECT_EQ(pupil.adapter.learn({.value = value}), outcome) << value;
  }
}

TEST(LastLayerAdapter, LearnsAtMostOnceFromAStep) {
  Pupil pupil(unguarded(), 5);
  EXPECT_EQ(pupil.adapter.learn({.value = 1.0}), UpdateOutcome::no_estimate);
  (void)pupil.step();
  EXPECT_EQ(pupil.learn(), UpdateOutcome::updated);
  const DenseLayer once = pupil.adapter.adapted();
  EXPECT_EQ(pupil.learn(), UpdateOutcome::no_estimate);
  (void)pupil.step();
  EXPECT_EQ(pupil.adapter.pass_over(UpdateOutcome::warming_up), UpdateOutcome::warming_up);
  EXPECT_EQ(pupil.learn(), UpdateOutcome::no_estimate);
  EXPECT_EQ(pupil.adapter.adapted(), once);
}

TEST(LastLayerAdapter, PausedKeepsWhatItLearned) {
  Pupil pupil(unguarded(), 5);
  (void)pupil.trained_error(100);
  const DenseLayer learned = pupil.adapter.adapted();
  pupil.adapter.pause();
  (void)pupil.step();
  EXPECT_EQ(pupil.learn(30.0), UpdateOutcome::paused);
  EXPECT_EQ(pupil.adapter.pass_over(UpdateOutcome::no_estimate), UpdateOutcome::paused);
  EXPECT_EQ(pupil.adapter.adapted(), learned);
  pupil.adapter.resume();
  (void)pupil.step();
  EXPECT_EQ(pupil.learn(30.0), UpdateOutcome::updated);
  EXPECT_NE(pupil.adapter.adapted(), learned);
  EXPECT_EQ(pupil.adapter.counts().of(UpdateOutcome::paused), 2U);
}

TEST(LastLayerAdapter, ResetMakesARunRepeatable) {
  for (const AdaptationRule rule : {AdaptationRule::nlms, AdaptationRule::rls}) {
    Pupil first(unguarded(rule), 11);
    (void)first.trained_error(200);
    Pupil again(unguarded(rule), 11, 7);
    (void)again.trained_error(77);
    LastLayerAdapter adapter = first.adapter;
    adapter.reset();
    EXPECT_EQ(adapter.adapted(), first.frozen);
    EXPECT_EQ(adapter.counts(), AdaptationCounts{});
    Pupil fresh(unguarded(rule), 11);
    fresh.adapter = adapter;
    (void)fresh.trained_error(200);
    EXPECT_EQ(fresh.adapter.adapted(), first.adapter.adapted());
    EXPECT_EQ(fresh.adapter.counts(), first.adapter.counts());
  }
}

TEST(LastLayerAdapter, IsDrawnBackToTheLargestChange) {
  AdaptationSettings settings = unguarded();
  settings.largest_change = 0.05;  // the teacher is twice as far away
  Pupil pupil(settings, 20);
  (void)pupil.trained_error(3000);
  EXPECT_GT(pupil.adapter.counts().of(UpdateOutcome::limited), 100U);
  EXPECT_NEAR(pupil.adapter.relative_change(), 0.05, 0.002);
}

RC_GTEST_PROP(LastLayerAdapter, NeverLeavesTheLargestChangeWhateverComesIn, ()) {
  AdaptationSettings settings;
  settings.rule = *rc::gen::element(AdaptationRule::nlms, AdaptationRule::rls);
  settings.step_size = 1e-3 * static_cast<double>(*rc::gen::inRange(1, 2000));
  settings.forgetting = 1.0 - 1e-4 * static_cast<double>(*rc::gen::inRange(0, 1001));
  settings.initial_covariance = std::pow(10.0, *rc::gen::inRange(-6, 13));
  settings.largest_change = 1e-3 * static_cast<double>(*rc::gen::inRange(1, 3000));
  settings.largest_error = std::pow(10.0, *rc::gen::inRange(-2, 300));
  settings.comparison_s = 0.1;
  const auto features = *rc::gen::inRange<std::size_t>(1, 40);
  Pupil pupil(settings, features, 3);
  const auto steps = *rc::gen::container<std::vector<std::pair<int, int>>>(
      rc::gen::pair(rc::gen::inRange(-40, 38), rc::gen::inRange(-300, 301)));
  Random random(9);
  for (const auto& [feature_power, error_power] : steps) {
    std::vector<float> h = normals(features, random);
    for (float& x : h) x *= static_cast<float>(std::pow(10.0, feature_power));
    const double estimate = pupil.adapter.step(h, 0.0);
    (void)pupil.adapter.learn({.value = estimate + random.normal() * std::pow(10.0, error_power)});
    RC_ASSERT(pupil.adapter.relative_change() <= settings.largest_change);
    double square = 0.0;
    double frozen_square = 0.0;
    const auto adapted = numbers(pupil.adapter.adapted());
    const auto frozen = numbers(pupil.frozen);
    for (std::size_t j = 0; j <= features; ++j) {
      square += std::pow(adapted[j] - frozen[j], 2);
      frozen_square += std::pow(frozen[j], 2);
    }
    // Weights are rounded to float32 when they are given out.
    RC_ASSERT(std::sqrt(square / frozen_square) <= settings.largest_change * (1.0 + 1e-6) + 1e-6);
  }
}

// ---- roll-back ----------------------------------------------------------------------------------

/// A reference that swings about the frozen value: each update with mu = 1 makes the next error
/// twice as large as it would have been.
double swinging(int n) { return n % 2 == 0 ? 5.0 : -5.0; }

TEST(LastLayerAdapter, RollsBackAfterTenSecondsOfBeingWorseThanFrozen) {
  for (const AdaptationRule rule : {AdaptationRule::nlms, AdaptationRule::rls}) {
    AdaptationSettings settings = unguarded(rule);
    settings.step_size = 1.0;
    settings.forgetting = 0.9;
    settings.comparison_s = 10.0;
    const DenseLayer frozen = layer_of(4, 1);
    LastLayerAdapter adapter(settings, frozen, kScale, kPeriod_s);
    const std::vector<float> features{0.3F, -0.2F, 0.5F, 0.1F};
    for (int n = 0; n < 9999; ++n) {
      (void)adapter.step(features, 1.0);
      EXPECT_EQ(adapter.learn({.value = 1.0 + swinging(n)}), UpdateOutcome::updated);
    }
    EXPECT_EQ(adapter.counts().roll_backs, 0U);
    EXPECT_NE(adapter.adapted(), frozen);
    (void)adapter.step(features, 1.0);
    adapter.pass_over(UpdateOutcome::no_estimate);  // ends the ten seconds and changes no weights
    EXPECT_EQ(adapter.counts().roll_backs, 1U);
    EXPECT_EQ(adapter.adapted(), frozen);
    EXPECT_EQ(adapter.step(features, 1.0), 1.0);
  }
}

TEST(LastLayerAdapter, DoesNotRollBackWhatIsBetter) {
  AdaptationSettings settings = unguarded();
  settings.comparison_s = 0.5;
  Pupil pupil(settings, 10);
  (void)pupil.trained_error(3000);
  EXPECT_EQ(pupil.adapter.counts().roll_backs, 0U);
}

TEST(LastLayerAdapter, UnbelievableReferencesAreNoEvidenceAgainstIt) {
  AdaptationSettings settings = unguarded();
  settings.comparison_s = 0.2;
  settings.largest_error = 100.0;
  Pupil pupil(settings, 10);
  (void)pupil.trained_error(1000);
  // 1e6 below: the frozen model, which is wrong by less here, would win by that alone.
  for (int n = 0; n < 400; ++n) {
    (void)pupil.step();
    EXPECT_EQ(pupil.learn(n % 2 == 0 ? -1e6 : 1e6), UpdateOutcome::error_too_large);
  }
  EXPECT_EQ(pupil.adapter.counts().roll_backs, 0U);
}

// ---- what is refused ----------------------------------------------------------------------------

std::string complaint(const AdaptationSettings& settings,
                      const DenseLayer& layer = layer_of(3, 1)) {
  return error_message([&] { LastLayerAdapter(settings, layer, kScale, kPeriod_s); });
}

TEST(LastLayerAdapter, RefusesSettingsOutOfRange) {
  EXPECT_THAT(complaint({.step_size = 2.0}), HasSubstr("step_size: expected 1e-09 to 1.999999"));
  EXPECT_THAT(complaint({.step_size = 0.0}), HasSubstr("step_size"));
  EXPECT_THAT(complaint({.step_size = kNaN}), HasSubstr("step_size"));
  EXPECT_THAT(complaint({.leak = 1.0}), HasSubstr("leak"));
  EXPECT_THAT(complaint({.regularisation = 0.0}), HasSubstr("regularisation"));
  EXPECT_THAT(complaint({.forgetting = 1.0001}), HasSubstr("forgetting"));
  EXPECT_THAT(complaint({.initial_covariance = 0.0}), HasSubstr("initial_covariance"));
  EXPECT_THAT(complaint({.trace_cap = 0.5}), HasSubstr("trace_cap"));
  EXPECT_THAT(complaint({.sensor_std = -1.0}), HasSubstr("sensor_std"));
  EXPECT_THAT(complaint({.dead_zone = kNaN}), HasSubstr("dead_zone"));
  EXPECT_THAT(complaint({.largest_error = 0.0}), HasSubstr("largest_error"));
  EXPECT_THAT(complaint({.oldest_reference_s = -1.0}), HasSubstr("oldest_reference_s"));
  EXPECT_THAT(complaint({.frozen_after_s = kInfinity}), HasSubstr("frozen_after_s"));
  EXPECT_THAT(complaint({.saturation = 0.0}), HasSubstr("saturation"));
  EXPECT_THAT(complaint({.largest_change = 0.0}), HasSubstr("largest_change"));
  EXPECT_THAT(complaint({.comparison_s = 0.0}), HasSubstr("comparison_s"));
  EXPECT_THAT(error_message([] { LastLayerAdapter({}, layer_of(3, 1), kScale, 0.0); }),
              HasSubstr("sample_period_s"));
  EXPECT_THAT(error_message([] { LastLayerAdapter({}, layer_of(3, 1), kNaN, kPeriod_s); }),
              HasSubstr("target_scale"));
}

TEST(LastLayerAdapter, RefusesLayersThatItCannotAdapt) {
  EXPECT_THAT(complaint({}, {.weights = FloatMatrix(1, 3), .bias = {0.0F}}),
              HasSubstr("a weight that is not 0"));
  DenseLayer two = {.weights = FloatMatrix(2, 3, 1.0F), .bias = {0.0F, 0.0F}};
  EXPECT_THAT(complaint({}, two), HasSubstr("one output"));
  EXPECT_THAT(complaint({.rule = AdaptationRule::rls}, layer_of(4001, 1)),
              HasSubstr("at most 4000 features"));
  EXPECT_EQ(complaint({}, layer_of(4001, 1)), "");
}

}  // namespace
}  // namespace torsio

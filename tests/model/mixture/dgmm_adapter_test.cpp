#include "model/dgmm_adapter.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <vector>

#include "support/error_message.hpp"
#include "support/numbers.hpp"
#include "torsio/core/random.hpp"
#include "torsio/model/adaptive_model.hpp"

namespace torsio {
namespace {

using test::error_message;
using test::kNaN;
using testing::HasSubstr;

constexpr double kPeriod_s = 1e-3;

/// A grid of `side` x `side` components over deflection (standardised -2 to 2) and rate along a
/// spring of 600 Nm/rad, and a wide one over all.
Dgmm::Parameters grid(std::size_t side = 9) {
  const std::size_t m = side * side + 1;
  Dgmm::Parameters dgmm;
  GaussianMixture& mixture = dgmm.mixture;
  mixture = {.centre = {0.5, 0.0, 0.0},
             .scale = {40.0, 0.07, 0.3},
             .weights = std::vector<double>(m, 0.999 / static_cast<double>(m - 1)),
             .means = Matrix(m, 3),
             .covariances = Matrix(m, 9)};
  mixture.weights.back() = 0.001;
  const double step = 4.0 / static_cast<double>(side - 1);
  const double slope = 600.0 * 0.07 / 40.0;
  const auto place = [&](std::size_t i, double x, double rate, double variance) {
    mixture.means.row(i)[0] = slope * x + 0.02 * rate;
    mixture.means.row(i)[1] = x;
    mixture.means.row(i)[2] = rate;
    const std::array<double, 9> covariance{variance * (slope * slope + 4e-4) + 4e-4,
                                           variance * slope,
                                           0.02 * variance,  //
                                           variance * slope,
                                           variance,
                                           0.0,  //
                                           0.02 * variance,
                                           0.0,
                                           variance};
    std::ranges::copy(covariance, mixture.covariances.row(i).begin());
  };
  for (std::size_t i = 0; i < m - 1; ++i)
    place(i, -2.0 + step * static_cast<double>(i % side),
          -2.0 + step * static_cast<double>(i / side), 0.3 * step * step);
  place(m - 1, 0.0, 0.0, 2.0);
  dgmm.clamp = {.intercept = 0.5,
                .slope = {600.0, 0.0},
                .width = 8.0,
                .thin_log_density = -4.5,
                .thin_log_density_inverse = -4.5};
  return dgmm;
}

std::array<double, 2> motion(int n) {
  const double t_s = kPeriod_s * n;
  return {0.07 * (1.2 * std::sin(3.0 * t_s) + 0.5 * std::sin(7.3 * t_s)),
          0.3 * (1.1 * std::cos(3.0 * t_s) + 0.4 * std::cos(7.3 * t_s))};
}

double torque_Nm(const std::array<double, 2>& features, double stiffness_Nm_rad) {
  return 0.5 + stiffness_Nm_rad * features[0] + 2.0 * features[1];
}

AdaptationSettings unguarded() {
  return {.largest_error = 1e9, .frozen_after_s = 0.0, .comparison_s = 1e6};
}

/// An adapter with its frozen model.
class Pupil {
 public:
  explicit Pupil(const Dgmm::Parameters& base = grid(),
                 const AdaptationSettings& settings = unguarded(),
                 const DgmmAdapter::Limits& limits = {})
      : frozen(base), adapter(settings, base, kPeriod_s, limits) {}

  double step(const std::array<double, 2>& features) {
    return adapter.step(frozen, features, frozen.step(features)).value;
  }
  UpdateOutcome learn(const std::array<double, 2>& features, double torque_Nm) {
    (void)step(features);
    return adapter.learn({.value = torque_Nm});
  }
  /// @param begin of the motion.
  void train(int samples, double stiffness_Nm_rad, int begin = 0) {
    for (int n = begin; n < begin + samples; ++n)
      (void)learn(motion(n), torque_Nm(motion(n), stiffness_Nm_rad) + 0.05 * random_.normal());
  }

  Dgmm frozen;
  DgmmAdapter adapter;

 private:
  Random random_{4};
};

TEST(DgmmAdapter, WithoutUpdatesReturnsTheMixturesOwnEstimateToTheBit) {
  Pupil pupil;
  for (int n = 0; n < 500; ++n)
    EXPECT_EQ(pupil.step(motion(n)), pupil.frozen.step(motion(n)).value);
  EXPECT_EQ(pupil.adapter.mixture(), grid().mixture);
  EXPECT_EQ(pupil.adapter.relative_change(), 0.0);
}

TEST(DgmmAdapter, TakesTheStepOfItsEquations) {
  Dgmm::Parameters one = grid();
  one.mixture = {.centre = {0.5, 0.0, 0.0},
                 .scale = {40.0, 0.07, 0.3},
                 .weights = {1.0},
                 .means = Matrix(1, 3),
                 .covariances = Matrix(1, 9)};
  one.mixture.covariances.values = {1.0, 0.3, 0.1, 0.3, 0.5, 0.0, 0.1, 0.0, 0.4};
  one.clamp.width = 0.0;
  AdaptationSettings settings = unguarded();
  settings.component_samples = 10.0;
  settings.forgetting = 0.95;
  settings.new_components = 0;
  Pupil pupil(one, settings);
  std::array<double, 3> mean{};
  std::array<double, 9> covariance{};
  std::ranges::copy(one.mixture.covariances.values, covariance.begin());
  const auto first = covariance;
  double n = 10.0;
  for (int i = 0; i < 20; ++i) {
    const auto features = motion(37 * i);
    const double torque = torque_Nm(features, 600.0);
    (void)pupil.learn(features, torque);
    const std::array x{(torque - 0.5) / 40.0, features[0] / 0.07, features[1] / 0.3};
    n = 0.95 * n + 1.0;
    const double rate = 1.0 / n;
    for (std::size_t r = 0; r < 3; ++r)
      for (std::size_t c = 0; c < 3; ++c)
        covariance[3 * r + c] =
            (1.0 - rate) * (covariance[3 * r + c] + rate * (x[r] - mean[r]) * (x[c] - mean[c])) +
            rate * DgmmAdapter::kLeastCovariance * first[3 * r + c];
    for (std::size_t j = 0; j < 3; ++j)
      mean[j] = std::clamp(mean[j] + rate * (x[j] - mean[j]), -0.2, 0.2);
  }
  EXPECT_EQ(pupil.adapter.counts().updates(), 20U);
  const GaussianMixture learned = pupil.adapter.mixture();
  for (std::size_t j = 0; j < 3; ++j) EXPECT_NEAR(learned.means(0, j), mean[j], 1e-12);
  for (std::size_t k = 0; k < 9; ++k) EXPECT_NEAR(learned.covariances(0, k), covariance[k], 1e-12);
}

TEST(DgmmAdapter, FollowsAChangeOfStiffnessOfATenth) {
  for (const double stiffness : {540.0, 660.0}) {
    Pupil pupil;
    pupil.train(60000, stiffness);
    double frozen = 0.0;
    double adapted = 0.0;
    for (int n = 60000; n < 65000; ++n) {
      const double torque = torque_Nm(motion(n), stiffness);
      frozen += std::pow(pupil.frozen.step(motion(n)).value - torque, 2);
      adapted += std::pow(pupil.step(motion(n)) - torque, 2);
    }
    EXPECT_GT(std::sqrt(frozen / 5000), 2.0);
    EXPECT_LT(adapted, 0.25 * 0.25 * frozen) << stiffness;
  }
}

TEST(DgmmAdapter, TheAdaptedMixtureHasTheOutputsOfTheAdaptiveOne) {
  // With new components among them.
  AdaptationSettings settings = unguarded();
  settings.new_components = 5;
  Pupil pupil(grid(), settings);
  pupil.train(3000, 650.0);
  for (int n = 0; n < 200; ++n) {
    const std::array features{0.07 * (2.9 + 0.2 * std::sin(0.1 * n)), 0.3 * 2.8};
    (void)pupil.learn(features, torque_Nm(features, 650.0));
  }
  EXPECT_GT(pupil.adapter.size(), grid().mixture.size());
  Dgmm::Parameters parameters = grid();
  parameters.mixture = pupil.adapter.mixture();
  Dgmm kept(parameters);
  for (int n = 0; n < 3000; ++n) {
    const auto features = motion(n);
    const Estimate again = kept.step(features);
    const Estimate output = pupil.adapter.step(pupil.frozen, features, pupil.frozen.step(features));
    EXPECT_NEAR(output.value, again.value, 1e-8);
    EXPECT_NEAR(output.std_dev, again.std_dev, 1e-8);
    EXPECT_NEAR(output.novelty, again.novelty, 1e-8);
  }
}

TEST(DgmmAdapter, TheComponentsThatLearnTakeTheShareOfAFullUpdate) {
  const Dgmm::Parameters base = grid(15);
  for (int n : {10, 900, 2500}) {
    Pupil few(base);
    Pupil all(base, unguarded(), {.components = base.mixture.size(), .least_share = 1e-9});
    const auto features = motion(n);
    (void)few.learn(features, torque_Nm(features, 660.0));
    (void)all.learn(features, torque_Nm(features, 660.0));
    const GaussianMixture one = few.adapter.mixture();
    const GaussianMixture other = all.adapter.mixture();
    std::size_t moved = 0;
    double left_out = 0.0;
    for (std::size_t i = 0; i < one.size(); ++i) {
      const bool is_moved = one.means(i, 0) != base.mixture.means(i, 0);
      moved += is_moved ? 1 : 0;
      for (std::size_t j = 0; j < 3; ++j) {
        if (is_moved)
          EXPECT_EQ(one.means(i, j), other.means(i, j));
        else
          left_out = std::max(left_out, std::abs(one.means(i, j) - other.means(i, j)));
      }
    }
    EXPECT_GE(moved, 2U);
    EXPECT_LE(moved, 6U);
    EXPECT_LT(left_out, 0.1 / 200.0);  // a share below 0.02..., of a distance of some units
  }
}

TEST(DgmmAdapter, LearnsNearlyWhatAFullUpdateLearns) {
  const Dgmm::Parameters base = grid(15);
  Pupil few(base);
  Pupil all(base, unguarded(), {.components = base.mixture.size(), .least_share = 1e-9});
  few.train(10000, 660.0);
  all.train(10000, 660.0);
  double difference = 0.0;
  double change = 0.0;
  for (int n = 10000; n < 13000; ++n) {
    const double full = all.step(motion(n));
    difference += std::pow(few.step(motion(n)) - full, 2);
    change += std::pow(full - all.frozen.step(motion(n)).value, 2);
  }
  EXPECT_GT(std::sqrt(change / 3000), 0.5);
  EXPECT_LT(difference, 0.08 * 0.08 * change);
}

TEST(DgmmAdapter, NewComponentsAreBoundedAndTheLightestIsReplaced) {
  AdaptationSettings settings = unguarded();
  settings.new_components = 3;
  const auto run = [&] {
    Pupil pupil(grid(), settings);
    for (int n = 0; n < 400; ++n) {
      // Seven places beyond the grid, one after the other.
      const double angle = static_cast<double>(n % 7);
      const std::array features{0.07 * 4.0 * std::cos(angle), 0.3 * 4.0 * std::sin(angle)};
      (void)pupil.learn(features, torque_Nm(features, 600.0));
      EXPECT_LE(pupil.adapter.size(), grid().mixture.size() + 3);
    }
    EXPECT_EQ(pupil.adapter.size(), grid().mixture.size() + 3);
    EXPECT_GT(pupil.adapter.replaced(), 0U);
    return pupil.adapter.mixture();
  };
  const GaussianMixture once = run();
  EXPECT_NO_THROW(check(once));
  EXPECT_EQ(run(), once);
  settings.new_components = 0;
  Pupil none(grid(), settings);
  (void)none.learn({0.28, 0.0}, 170.0);
  EXPECT_EQ(none.adapter.size(), grid().mixture.size());
}

TEST(DgmmAdapter, TheWorkOfAStepIsBoundedWhateverTheNumberOfComponents) {
  std::size_t largest = 0;
  for (const std::size_t side : {9U, 40U}) {
    AdaptationSettings settings = unguarded();
    settings.comparison_s = 0.5;
    settings.new_components = 4;
    Pupil pupil(grid(side), settings);
    Random random(2);
    std::size_t worst = 0;
    for (int n = 0; n < 6000; ++n) {
      const std::array features{0.1 * random.normal(), 0.4 * random.normal()};
      const double base = pupil.frozen.step(features).value;
      const double output = pupil.step(features);
      (void)pupil.adapter.learn({.value = base + (output > base ? -9.0 : 9.0)});
      worst = std::max(worst, pupil.adapter.operations());
      ASSERT_LE(pupil.adapter.operations(), pupil.adapter.max_operations());
    }
    EXPECT_GT(pupil.adapter.counts().roll_backs, 0U);
    EXPECT_GT(pupil.adapter.counts().of(UpdateOutcome::rolling_back), 0U);
    // More only by the comparison of the scan's numbers.
    EXPECT_LT(worst, (largest > 0 ? largest : worst) + 1601);
    largest = worst;
  }
}

TEST(DgmmAdapter, ARollBackReturnsTheFrozenMixtureAtOnceAndRestoresItInTheNextSteps) {
  AdaptationSettings settings = unguarded();
  settings.comparison_s = 1.0;
  settings.component_samples = 5.0;
  Pupil pupil(grid(), settings);
  int n = 0;
  for (; pupil.adapter.counts().roll_backs == 0 && n < 5000; ++n) {
    const double base = pupil.frozen.step(motion(n)).value;
    const double output = pupil.step(motion(n));
    (void)pupil.adapter.learn({.value = base + (output > base ? -9.0 : 9.0)});
  }
  ASSERT_EQ(pupil.adapter.counts().roll_backs, 1U);
  for (int k = 0; k < 30; ++k, ++n) {
    EXPECT_EQ(pupil.step(motion(n)), pupil.frozen.step(motion(n)).value);
    EXPECT_EQ(pupil.adapter.mixture(), grid().mixture);
    (void)pupil.adapter.learn({.value = kNaN});
  }
  EXPECT_EQ(pupil.learn(motion(n), torque_Nm(motion(n), 600.0)), UpdateOutcome::updated);
}

TEST(DgmmAdapter, AJointAtRestMakesNoCovarianceSingular) {
  AdaptationSettings settings = unguarded();
  settings.forgetting = 0.99;
  Pupil pupil(grid(), settings);
  for (int n = 0; n < 100000; ++n) (void)pupil.learn({0.01, 0.02}, 7.0);
  const GaussianMixture learned = pupil.adapter.mixture();
  EXPECT_NO_THROW(check(learned));
  EXPECT_NEAR(pupil.step({0.01, 0.02}), 7.0, 0.5);
  EXPECT_LT(std::abs(pupil.step({-0.1, -0.3}) - pupil.frozen.step(std::array{-0.1, -0.3}).value),
            0.1);  // elsewhere it is as it was
}

TEST(DgmmAdapter, StaysAMixtureWhateverComesIn) {
  AdaptationSettings settings = unguarded();
  settings.largest_error = 1e300;
  settings.forgetting = 0.9;
  settings.component_samples = 1.0;
  Pupil pupil(grid(5), settings);
  Random random(7);
  for (int n = 0; n < 10000; ++n) {
    const double size = std::pow(10.0, 3.0 * random.normal());
    const std::array features{0.07 * size * random.normal(), 0.3 * random.normal()};
    const double torque = n % 11 == 0 ? kNaN : 40.0 * random.normal() * (n % 5 == 0 ? size : 1.0);
    (void)pupil.learn(n % 13 == 0 ? std::array{kNaN, 0.0} : features, torque);
    if (n % 500 != 0) continue;
    EXPECT_NO_THROW(check(pupil.adapter.mixture())) << n;
    EXPECT_TRUE(std::isfinite(pupil.step({0.01, 0.0})));
  }
  EXPECT_GT(pupil.adapter.counts().updates(), 1000U);
  const GaussianMixture learned = pupil.adapter.mixture();
  for (std::size_t i = 0; i < 26; ++i)
    for (std::size_t j = 0; j < 3; ++j)
      EXPECT_LE(std::abs(learned.means(i, j) - grid(5).mixture.means(i, j)),
                0.2 * (1.0 + std::abs(grid(5).mixture.means(i, j))) + 1e-12);
}

TEST(DgmmAdapter, ReferencesThatCannotBeTrustedChangeNothing) {
  Pupil pupil(grid(), {.saturation = 100.0});
  const auto outcome_of = [&](const ReferenceSample& reference) {
    (void)pupil.step(motion(100));
    return pupil.adapter.learn(reference);
  };
  EXPECT_EQ(outcome_of({.value = kNaN}), UpdateOutcome::reference_not_finite);
  EXPECT_EQ(outcome_of({.value = 10.0, .age_s = 0.1}), UpdateOutcome::reference_stale);
  EXPECT_EQ(outcome_of({.value = -100.0}), UpdateOutcome::reference_saturated);
  Pupil unlimited(grid(), {});
  (void)unlimited.step(motion(100));
  EXPECT_EQ(unlimited.adapter.learn({.value = 20000.0}), UpdateOutcome::error_too_large);  // mNm
  EXPECT_EQ(pupil.adapter.mixture(), grid().mixture);
  EXPECT_EQ(unlimited.adapter.mixture(), grid().mixture);
}

TEST(DgmmAdapter, AStuckReferenceIsStale) {
  Pupil pupil(grid(), {});
  for (int n = 0; n < 300; ++n)
    EXPECT_EQ(pupil.learn(motion(0), 11.0) == UpdateOutcome::reference_stale, n >= 200) << n;
}

TEST(DgmmAdapter, IsRepeatableAndResetMakesItSo) {
  Pupil first;
  Pupil second;
  first.train(2000, 660.0);
  second.train(2000, 660.0);
  const GaussianMixture once = first.adapter.mixture();
  EXPECT_EQ(second.adapter.mixture(), once);
  Pupil third;
  third.train(500, 500.0);
  third.adapter.reset();
  EXPECT_EQ(third.adapter.counts(), AdaptationCounts{});
  Pupil fresh;
  for (int n = 0; n < 2000; ++n) {
    (void)third.learn(motion(n), torque_Nm(motion(n), 660.0));
    (void)fresh.learn(motion(n), torque_Nm(motion(n), 660.0));
  }
  EXPECT_EQ(third.adapter.mixture(), fresh.adapter.mixture());
}

TEST(DgmmAdapter, RefusesTheMethodsOfNetworks) {
  for (const AdaptationRule rule : {AdaptationRule::nlms, AdaptationRule::rls})
    EXPECT_THAT(error_message([&] { (void)DgmmAdapter({.rule = rule}, grid(), kPeriod_s); }),
                HasSubstr("expected auto or em for a dgmm"));
  EXPECT_THAT(
      error_message([] { (void)DgmmAdapter({.component_samples = 0.0}, grid(), kPeriod_s); }),
      HasSubstr("component_samples"));
}

}  // namespace
}  // namespace torsio

#include "fit/mixture/online_mixture.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numeric>
#include <random>
#include <vector>

#include "support/each_instruction_set.hpp"
#include "torsio/core/error.hpp"

namespace torsio {
namespace {

Standardisation plain(std::size_t dimension) {
  return {std::vector<double>(dimension, 0.0), std::vector<double>(dimension, 1.0)};
}

Matrix random_samples(std::size_t count, std::size_t dimension, unsigned seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  Matrix samples(count, dimension);
  for (double& value : samples.values) value = normal(random);
  return samples;
}

void learn_all(OnlineMixture& learner, const Matrix& samples) {
  for (std::size_t i = 0; i < samples.rows; ++i) learner.learn(samples.row(i));
}

// Sum over components of counts, means and scatters about zero, computed from the mixture.
struct Totals {
  std::vector<double> first;
  Matrix second;
};

Totals totals_of(const GaussianMixture& mixture, double samples, double spread) {
  const std::size_t d = mixture.dimension();
  const double prior_count = static_cast<double>(d) + 1.0;
  Totals totals{std::vector<double>(d, 0.0), Matrix(d, d)};
  for (std::size_t i = 0; i < mixture.size(); ++i) {
    const double count = mixture.weights[i] * samples;
    for (std::size_t r = 0; r < d; ++r) {
      totals.first[r] += count * mixture.means(i, r);
      for (std::size_t c = 0; c < d; ++c) {
        const double prior = r == c ? prior_count * spread * spread : 0.0;
        totals.second(r, c) += (prior_count + count) * mixture.covariances(i, r * d + c) - prior +
                               count * mixture.means(i, r) * mixture.means(i, c);
      }
    }
  }
  return totals;
}

TEST(OnlineMixture, KeepsTheMomentsOfAllSamplesThroughUpdatesAndMerges) {
  for (const double novelty : {0.2, 0.6, 100.0}) {
    const Matrix samples = random_samples(3000, 3, 5);
    const OnlineMixtureSettings settings{.components = 40, .novelty_distance = novelty};
    OnlineMixture learner(plain(3), settings);
    learn_all(learner, samples);
    EXPECT_EQ(learner.merges() > 0, novelty < 1.0);
    const Totals totals = totals_of(learner.mixture(), 3000.0, settings.initial_spread);
    for (std::size_t r = 0; r < 3; ++r) {
      double first = 0.0;
      for (std::size_t i = 0; i < samples.rows; ++i) first += samples(i, r);
      EXPECT_NEAR(totals.first[r], first, 1e-8);
      for (std::size_t c = 0; c < 3; ++c) {
        double second = 0.0;
        for (std::size_t i = 0; i < samples.rows; ++i) second += samples(i, r) * samples(i, c);
        EXPECT_NEAR(totals.second(r, c), second, 1e-7);
      }
    }
  }
}

TEST(OnlineMixture, OneComponentIsTheInverseWishartEstimateOfAllSamples) {
  const Matrix samples = random_samples(500, 2, 8);
  const OnlineMixtureSettings settings{.components = 1};
  OnlineMixture learner(plain(2), settings);
  learn_all(learner, samples);
  const GaussianMixture mixture = learner.mixture();
  std::vector<double> mean(2, 0.0);
  for (std::size_t i = 0; i < 500; ++i)
    for (std::size_t j = 0; j < 2; ++j) mean[j] += samples(i, j) / 500.0;
  for (std::size_t r = 0; r < 2; ++r) {
    EXPECT_NEAR(mixture.means(0, r), mean[r], 1e-13);
    for (std::size_t c = 0; c < 2; ++c) {
      double scatter = r == c ? 3.0 * 0.15 * 0.15 : 0.0;
      for (std::size_t i = 0; i < 500; ++i)
        scatter += (samples(i, r) - mean[r]) * (samples(i, c) - mean[c]);
      EXPECT_NEAR(mixture.covariances(0, r * 2 + c), scatter / 503.0, 1e-12);
    }
  }
}

TEST(OnlineMixture, ASampleFartherThanTheNoveltyDistanceIsANewComponent) {
  OnlineMixture learner(plain(2), {.novelty_distance = 0.5});
  learner.learn(std::vector{0.0, 0.0});
  learner.learn(std::vector{0.5, 0.0});
  EXPECT_EQ(learner.size(), 1U);
  learner.learn(std::vector{0.0, 0.8});
  EXPECT_EQ(learner.size(), 2U);
}

TEST(OnlineMixture, MergesTheCheapestPairWhenNoneIsFree) {
  OnlineMixture learner(plain(1), {.components = 3, .novelty_distance = 0.25});
  for (const double x : {0.0, 0.3, 10.0, 20.0}) learner.learn(std::vector{x});
  const GaussianMixture mixture = learner.mixture();
  std::vector<double> means = mixture.means.values;
  std::sort(means.begin(), means.end());
  EXPECT_EQ(learner.merges(), 1U);
  ASSERT_EQ(means.size(), 3U);
  EXPECT_NEAR(means[0], 0.15, 1e-15);
  EXPECT_EQ(means[1], 10.0);
  EXPECT_EQ(means[2], 20.0);
}

TEST(OnlineMixture, GivesASampleToTheNearestOfManyComponents) {
  const Matrix seeds = random_samples(777, 4, 21);
  const Matrix probes = random_samples(50, 4, 22);
  for (std::size_t k = 0; k < probes.rows; ++k) {
    const auto square_distance = [&](std::size_t i) {
      double square = 0.0;
      for (std::size_t j = 0; j < 4; ++j) square += std::pow(probes(k, j) - seeds(i, j), 2);
      return square;
    };
    std::size_t expected = 0;
    for (std::size_t i = 1; i < seeds.rows; ++i)
      if (square_distance(i) < square_distance(expected)) expected = i;
    // A novelty distance just above the nearest's, and tiny for the seeds among each other.
    OnlineMixture learner(plain(4), {.components = 777, .novelty_distance = 0.0});
    learn_all(learner, seeds);
    ASSERT_EQ(learner.size(), 777U);
    learner.learn(seeds.row(expected));  // at distance 0: an update, not a novelty
    const GaussianMixture mixture = learner.mixture();
    EXPECT_EQ(mixture.weights[expected], 2.0 / 778.0);
  }
}

// Samples at about the distance at which squares overflow in float32: every free slot must remain
// free, which a sanitiser checks, and the component that searches a neighbour must find another.
TEST(OnlineMixture, AnEnormousSampleIsAComponentOfItsOwn) {
  for (const double far : {1e17, 2e18, 1.2e19, 1.8e19, 1e25, 1e45, 1e150}) {
    OnlineMixture learner(plain(3), {.components = 20});
    learn_all(learner, random_samples(10, 3, 3));
    const std::size_t before = learner.size();
    learner.learn(std::vector{far, 0.0, 0.0});
    ASSERT_EQ(learner.size(), before + 1) << far;
    const GaussianMixture mixture = learner.mixture();
    EXPECT_EQ(mixture.means(before, 0), far);
    double total = 0.0;
    for (std::size_t i = 0; i < before; ++i) {
      EXPECT_LT(std::abs(mixture.means(i, 0)), 10.0);
      total += mixture.weights[i];
    }
    EXPECT_NEAR(total, 10.0 / 11.0, 1e-12) << far;
    learner.learn(std::vector{-far, far, 0.0});
    learn_all(learner, random_samples(100, 3, 4));  // merges, with the far ones among the lightest
    learner.learn(std::vector{far, far, 0.0});      // no slot is free
    EXPECT_EQ(learner.size(), 20U);
    const GaussianMixture full = learner.mixture();
    EXPECT_NEAR(std::accumulate(full.weights.begin(), full.weights.end(), 0.0), 1.0, 1e-12);
  }
}

TEST(OnlineMixture, MergesComponentsThatAreTooFarApartForAFloat) {
  OnlineMixture learner(plain(1), {.components = 2});
  for (const double x : {0.0, 1e30, -1e30}) learner.learn(std::vector{x});
  std::vector<double> means = learner.mixture().means.values;
  std::sort(means.begin(), means.end());
  EXPECT_EQ(means, (std::vector{-1e30, 0.5e30}));
}

TEST(OnlineMixture, LearnsTheSameBitsOnEveryInstructionSet) {
  const Matrix samples = random_samples(4000, 4, 31);
  std::vector<GaussianMixture> learned;
  test::on_each_instruction_set([&](const char*) {
    OnlineMixture learner(plain(4), {.components = 200});
    learn_all(learner, samples);
    learned.push_back(learner.mixture());
  });
  ASSERT_GE(learned.size(), 2U);
  for (const GaussianMixture& mixture : learned) EXPECT_EQ(mixture, learned.front());
}

TEST(OnlineMixture, ForgetsWithItsForgettingFactor) {
  OnlineMixture learner(plain(1), {.components = 2, .novelty_distance = 10.0, .forgetting = 0.9});
  for (int k = 0; k < 500; ++k) learner.learn(std::vector{k < 250 ? 0.0 : 1.0});
  EXPECT_NEAR(learner.mixture().means(0, 0), 1.0, 1e-9);
}

TEST(OnlineMixture, ALearningRateFloorKeepsMeansFollowing) {
  OnlineMixture settled(plain(1), {.novelty_distance = 10.0});
  OnlineMixture following(plain(1), {.novelty_distance = 10.0, .learning_rate_floor = 0.1});
  for (int k = 0; k < 1000; ++k) {
    const std::vector<double> sample = {k < 500 ? 0.0 : 1.0};
    settled.learn(sample);
    following.learn(sample);
  }
  EXPECT_NEAR(settled.mixture().means(0, 0), 0.5, 1e-12);
  EXPECT_NEAR(following.mixture().means(0, 0), 1.0, 1e-9);
}

TEST(OnlineMixture, DropsLightComponentsThatAreOld) {
  OnlineMixture learner(plain(1), {.prune_count = 2.0, .prune_age = 100});
  for (int k = 0; k < 50; ++k) learner.learn(std::vector{0.0});
  learner.learn(std::vector{50.0});  // a spike
  learner.learn(std::vector{3.0});
  for (int k = 0; k < 60; ++k) learner.learn(std::vector{3.0});
  EXPECT_EQ(learner.size(), 3U);
  for (int k = 0; k < 100; ++k) learner.learn(std::vector{0.0});
  EXPECT_EQ(learner.size(), 2U);
  for (const double mean : learner.mixture().means.values) EXPECT_LT(mean, 10.0);
  learner.learn(std::vector{50.0});  // its slot is free again
  EXPECT_EQ(learner.size(), 3U);
}

TEST(OnlineMixture, RefusesSettingsOutOfRange) {
  EXPECT_THROW(OnlineMixture(plain(2), {.components = 0}), Error);
  EXPECT_THROW(OnlineMixture(plain(2), {.novelty_distance = -1.0}), Error);
  EXPECT_THROW(OnlineMixture(plain(2), {.initial_spread = 0.0}), Error);
  EXPECT_THROW(OnlineMixture(plain(2), {.forgetting = 1.5}), Error);
  EXPECT_THROW(OnlineMixture({{0.0}, {0.0}}, {}), Error);
  EXPECT_THROW(static_cast<void>(OnlineMixture(plain(2), {}).mixture()), Error);
}

TEST(RobustStandardisation, IsNotStretchedByASpike) {
  Matrix samples = random_samples(2000, 1, 3);
  const Standardisation clean = robust_standardisation(samples, std::vector{0.0});
  samples(7, 0) = 1e6;
  const Standardisation spiked = robust_standardisation(samples, std::vector{0.0});
  EXPECT_NEAR(clean.scale[0], 1.0, 0.06);
  EXPECT_NEAR(spiked.scale[0], clean.scale[0], 0.01);
  EXPECT_NEAR(spiked.centre[0], clean.centre[0], 0.01);
}

TEST(RobustStandardisation, NeverGoesBelowTheFloor) {
  const Matrix constant(100, 2, 4.0);
  const Standardisation by = robust_standardisation(constant, std::vector{0.05, 0.0});
  EXPECT_EQ(by.centre, (std::vector{4.0, 4.0}));
  EXPECT_EQ(by.scale, (std::vector{0.05, 1.0}));
}

}  // namespace
}  // namespace torsio

#include "torsio/safety/redundancy.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <numbers>
#include <span>
#include <string>
#include <vector>

#include "support/any_number.hpp"
#include "support/error_message.hpp"
#include "support/numbers.hpp"
#include "torsio/core/random.hpp"

namespace torsio {
namespace {

using test::any_random;
using test::kInfinity;
using test::kNaN;
using testing::ElementsAre;

/// The three estimates of a series-elastic joint and what they depend on.
RedundancySettings three_sources() {
  return {
      .sources = {{.name = "current", .depends_on = {"current_sensor", "supply"}},
                  {.name = "gear", .depends_on = {"motor_encoder", "gear_encoder", "supply"}},
                  {.name = "spring", .depends_on = {"gear_encoder", "joint_encoder", "supply"}}},
      .correlation = {}};
}

RedundancySettings anonymous_sources(std::size_t count) {
  RedundancySettings settings;
  for (std::size_t i = 0; i < count; ++i)
    settings.sources.push_back(
        {.name = std::string(1, static_cast<char>('a' + i)), .depends_on = {}});
  return settings;
}

Estimate torque(double value, double std_dev) { return {.value = value, .std_dev = std_dev}; }

/// A correlation matrix of random vectors: two are nearly parallel for `closeness` near 1.
std::vector<double> random_correlation(std::size_t count, double closeness, Random& random) {
  std::vector<std::vector<double>> vectors(count, std::vector<double>(count + 1));
  std::vector<double> common(count + 1);
  for (double& x : common) x = random.normal();
  for (auto& vector : vectors) {
    double square = 0.0;
    for (std::size_t k = 0; k < vector.size(); ++k) {
      vector[k] = closeness * common[k] + (1.0 - closeness) * random.normal();
      square += vector[k] * vector[k];
    }
    for (double& x : vector) x /= std::sqrt(square);
  }
  std::vector<double> rows(count * count, 1.0);
  for (std::size_t i = 0; i < count; ++i)
    for (std::size_t j = 0; j < i; ++j) {
      double product = 0.0;
      for (std::size_t k = 0; k <= count; ++k) product += vectors[i][k] * vectors[j][k];
      rows[i * count + j] = rows[j * count + i] = product;
    }
  return rows;
}

/// Solves a x = 1 by Gaussian elimination with pivots.
std::vector<double> solve_ones(std::vector<std::vector<double>> a) {
  const std::size_t n = a.size();
  std::vector<double> x(n, 1.0);
  for (std::size_t c = 0; c < n; ++c) {
    std::size_t pivot = c;
    for (std::size_t r = c + 1; r < n; ++r)
      if (std::abs(a[r][c]) > std::abs(a[pivot][c])) pivot = r;
    std::swap(a[c], a[pivot]);
    std::swap(x[c], x[pivot]);
    for (std::size_t r = 0; r < n; ++r) {
      if (r == c) continue;
      const double factor = a[r][c] / a[c][c];
      for (std::size_t k = c; k < n; ++k) a[r][k] -= factor * a[c][k];
      x[r] -= factor * x[c];
    }
  }
  for (std::size_t c = 0; c < n; ++c) x[c] /= a[c][c];
  return x;
}

/// The smallest variance of any weights >= 0 with sum 1: the best of the solutions on every subset of
/// the sources whose weights are all positive.
double smallest_variance(const std::vector<double>& std_devs, const std::vector<double>& rows) {
  const std::size_t count = std_devs.size();
  double best = kInfinity;
  for (unsigned set = 1; set < 1U << count; ++set) {
    std::vector<std::size_t> index;
    for (std::size_t i = 0; i < count; ++i)
      if ((set >> i & 1U) != 0) index.push_back(i);
    std::vector<std::vector<double>> s(index.size(), std::vector<double>(index.size()));
    for (std::size_t a = 0; a < index.size(); ++a)
      for (std::size_t b = 0; b < index.size(); ++b)
        s[a][b] = std_devs[index[a]] * std_devs[index[b]] * rows[index[a] * count + index[b]];
    const std::vector<double> x = solve_ones(s);
    double sum = 0.0;
    for (const double weight : x) sum += weight;
    if (std::ranges::all_of(x, [&](double weight) { return weight / sum >= 0.0; }))
      best = std::min(best, 1.0 / sum);
  }
  return best;
}

/// Random estimates of so many sources with correlated errors.
struct Case {
  RedundancySettings settings;
  std::vector<double> std_devs;
  std::vector<Estimate> sources;
};

Case random_case(Random& random) {
  const auto count = static_cast<std::size_t>(1 + random.uniform() * 8.0);
  Case result{.settings = anonymous_sources(count), .std_devs = {}, .sources = {}};
  result.settings.correlation = random_correlation(count, 0.95 * random.uniform(), random);
  for (std::size_t i = 0; i < count; ++i) {
    result.std_devs.push_back(std::pow(10.0, 2.0 * random.normal() * random.uniform()));
    result.sources.push_back(torque(10.0 * random.normal(), result.std_devs[i]));
  }
  return result;
}

/// Sources that differ have a longer error bar.
std::vector<Estimate> agreeing(std::vector<Estimate> sources) {
  for (Estimate& source : sources) source.value = sources.front().value;
  return sources;
}

TEST(Redundancy, WeighsUncorrelatedSourcesByTheSquaresOfTheirErrorBars) {
  Redundancy redundancy(three_sources());
  const FusedTorque fused =
      redundancy.step(std::array{torque(1.8, 1.0), torque(2.0, 0.5), torque(3.0, 2.0)});
  EXPECT_NEAR(fused.value_Nm, (1.0 * 1.8 + 4.0 * 2.0 + 0.25 * 3.0) / 5.25, 1e-12);
  EXPECT_NEAR(fused.std_dev_Nm, 1.0 / std::sqrt(5.25), 1e-12);
  EXPECT_EQ(fused.used, 0b111U);
  EXPECT_EQ(fused.fault, Fault::none);
}

TEST(Redundancy, TakesTheCorrelationOfTheErrorsIntoAccount) {
  RedundancySettings settings = anonymous_sources(2);
  settings.correlation = {1.0, 0.5, 0.5, 1.0};
  Redundancy redundancy(settings);
  const FusedTorque equal = redundancy.step(std::array{torque(1.0, 2.0), torque(2.0, 2.0)});
  EXPECT_NEAR(equal.value_Nm, 1.5, 1e-12);
  EXPECT_NEAR(equal.std_dev_Nm, 2.0 * std::sqrt(0.75), 1e-12);
  const FusedTorque unequal = redundancy.step(std::array{torque(1.0, 1.0), torque(3.0, 1.5)});
  // w2 = (s1^2 - R s1 s2) / (s1^2 + s2^2 - 2 R s1 s2)
  const double weight = (1.0 - 0.75) / (1.0 + 2.25 - 1.5);
  EXPECT_NEAR(unequal.value_Nm, 1.0 + 2.0 * weight, 1e-12);
}

// With errors of opposite sign even a source with a far larger error bar makes the torque more certain.
TEST(Redundancy, UsesAnErrorOfOppositeSignHoweverLarge) {
  RedundancySettings settings = anonymous_sources(2);
  settings.correlation = {1.0, -0.6, -0.6, 1.0};
  Redundancy redundancy(settings);
  for (const double std_dev_Nm : {1e3, 1e8, 1e50})
    EXPECT_NEAR(redundancy.step(std::array{torque(1.0, 1.0), torque(2.0, std_dev_Nm)}).std_dev_Nm,
                0.8, 1e-3)
        << std_dev_Nm;
}

TEST(Redundancy, GivesNoNegativeWeightToASourceThatAddsNothing) {
  RedundancySettings settings = anonymous_sources(2);
  settings.correlation = {1.0, 0.9, 0.9, 1.0};
  Redundancy redundancy(settings);
  const FusedTorque fused = redundancy.step(std::array{torque(1.0, 1.0), torque(3.0, 10.0)});
  EXPECT_EQ(fused.value_Nm, 1.0);
  EXPECT_DOUBLE_EQ(fused.std_dev_Nm, 1.0);
  EXPECT_EQ(fused.used, 0b11U) << "valid, if without a weight";
}

TEST(Redundancy, LeavesOutExactlyTheSourcesThatReportThemselvesInvalid) {
  const std::vector<Estimate> invalid = {
      {.value = 9.0, .std_dev = 0.1, .fault = Fault::input_not_finite},
      {.value = 9.0, .std_dev = 0.1, .fault = Fault::outside_training_range},
      {.value = kNaN, .std_dev = 0.1},
      {.value = -kInfinity, .std_dev = 0.1},
      {.value = 9.0, .std_dev = kNaN},
      {.value = 9.0, .std_dev = kInfinity},
      {.value = 9.0, .std_dev = 0.0},
      {.value = 9.0, .std_dev = -0.1}};
  for (const Estimate& bad : invalid) {
    Redundancy redundancy(three_sources());
    const FusedTorque fused = redundancy.step(std::array{torque(1.9, 1.0), bad, torque(2.1, 1.0)});
    EXPECT_EQ(fused.used, 0b101U);
    EXPECT_NEAR(fused.value_Nm, 2.0, 1e-12);
    EXPECT_NEAR(fused.std_dev_Nm, std::sqrt(0.5), 1e-12);
    EXPECT_EQ(fused.fault, Fault::none);
  }
}

// The error of an invalid source is correlated with that of the best one, which another valid source
// without a weight must not bring into use.
TEST(Redundancy, AnInvalidSourceHasNoPartInTheWeights) {
  RedundancySettings settings = anonymous_sources(3);
  settings.correlation = {1.0, 0.5, 0.5, 0.5, 1.0, 0.9, 0.5, 0.9, 1.0};
  Redundancy redundancy(settings);
  const FusedTorque fused =
      redundancy.step(std::array{Estimate{.value = 9.0, .std_dev = 1.0, .fault = Fault::diverged},
                                 torque(1.0, 1.0), torque(3.0, 10.0)});
  EXPECT_EQ(fused.value_Nm, 1.0);
  EXPECT_DOUBLE_EQ(fused.std_dev_Nm, 1.0);
  EXPECT_EQ(fused.used, 0b110U);
}

TEST(Redundancy, UsesValidSourcesHoweverMuchTheyDisagree) {
  Redundancy redundancy(three_sources());
  const FusedTorque fused =
      redundancy.step(std::array{torque(1.0, 1.0), torque(1.0, 1.0), torque(1e6, 1.0)});
  EXPECT_EQ(fused.used, 0b111U) << "no vote";
  EXPECT_NEAR(fused.value_Nm, (2.0 + 1e6) / 3.0, 1e-6);
  EXPECT_EQ(fused.fault, Fault::none);
}

// One of the two is wrong by more than it reports, and the torque follows the one with the larger weight.
TEST(Redundancy, TheErrorBarContainsWhatTheErrorBarsOfTheSourcesDoNotExplain) {
  Redundancy redundancy(three_sources());
  const double agreeing_Nm =
      redundancy.step(std::array{torque(5.0, 1.2), torque(5.0, 0.3), torque(5.0, 1.2)}).std_dev_Nm;
  for (const double wrong_by_Nm : {0.5, 1.5, 2.0, 3.0, 6.0}) {
    const FusedTorque fused = redundancy.step(
        std::array{torque(5.0, 1.2), torque(5.0 + wrong_by_Nm, 0.3), torque(5.0, 1.2)});
    EXPECT_LT(fused.value_Nm - 5.0, 5.0 * fused.std_dev_Nm) << wrong_by_Nm;
    if (wrong_by_Nm < 1.0) {
      EXPECT_NEAR(fused.std_dev_Nm, agreeing_Nm, 1e-12);
    }
    if (wrong_by_Nm > 2.5) {
      EXPECT_LT(fused.value_Nm - 5.0, 1.5 * fused.std_dev_Nm);
    }
  }
}

TEST(Redundancy, HoldsTheLastTorqueWithoutAValidSource) {
  Redundancy redundancy(three_sources());
  const std::array<Estimate, 3> none{torque(5.0, kNaN), torque(kNaN, 1.0),
                                     Estimate{.fault = Fault::warming_up}};
  FusedTorque fused = redundancy.step(none);
  EXPECT_EQ(fused.value_Nm, 0.0);
  (void)redundancy.step(std::array{torque(2.0, 1.0), torque(2.0, 1.0), torque(2.0, 1.0)});
  fused = redundancy.step(none);
  EXPECT_NEAR(fused.value_Nm, 2.0, 1e-12);
  EXPECT_TRUE(std::isnan(fused.std_dev_Nm));
  EXPECT_EQ(fused.fault, Fault::input_not_finite);
  EXPECT_EQ(fused.used, 0U);
  EXPECT_EQ(fused.not_redundant, 0U);
  redundancy.reset();
  EXPECT_EQ(redundancy.step(none).value_Nm, 0.0);
}

TEST(Redundancy, RefusesAnotherNumberOfEstimates) {
  Redundancy redundancy(three_sources());
  (void)redundancy.step(std::array{torque(2.0, 1.0), torque(2.0, 1.0), torque(2.0, 1.0)});
  const std::array<Estimate, 4> four{torque(9.0, 1.0), torque(9.0, 1.0), torque(9.0, 1.0),
                                     torque(9.0, 1.0)};
  for (const std::size_t count : {0U, 2U, 4U}) {
    const FusedTorque fused = redundancy.step(std::span(four).first(count));
    EXPECT_EQ(fused.fault, Fault::input_count_wrong);
    EXPECT_NEAR(fused.value_Nm, 2.0, 1e-12);
    EXPECT_EQ(fused.used, 0U);
    EXPECT_TRUE(std::isnan(fused.std_dev_Nm));
  }
}

// The squares of 1e-200 and 1e200 are 0 and infinite; a source with a ratio of 1e12 once had a weight
// that widened the error bar.
TEST(Redundancy, TakesErrorBarsOfAnySize) {
  Redundancy redundancy(three_sources());
  for (const double scale : {1e-300, 1e-200, 1.0, 1e200, 1e307}) {
    const FusedTorque fused =
        redundancy.step(std::array{torque(2.0, scale), torque(2.0, scale), torque(2.0, scale)});
    EXPECT_NEAR(fused.value_Nm, 2.0, 1e-12) << scale;
    EXPECT_NEAR(fused.std_dev_Nm / scale, std::sqrt(1.0 / 3.0), 1e-12) << scale;
  }
  for (const double ratio : {1e7, 1e12, 1e90, 1e200}) {
    const FusedTorque fused =
        redundancy.step(std::array{torque(1.0, ratio), torque(-3.0, 1.0), torque(1.0, ratio)});
    EXPECT_NEAR(fused.value_Nm, -3.0, 1e-12) << ratio;
    EXPECT_NEAR(fused.std_dev_Nm, 1.0, 1e-12) << ratio;
    EXPECT_EQ(fused.used, 0b111U);
  }
}

TEST(Redundancy, StaysFiniteForTheLargestValues) {
  Redundancy redundancy(three_sources());
  constexpr double kMax = std::numeric_limits<double>::max();
  const FusedTorque fused =
      redundancy.step(std::array{torque(kMax, 1.0), torque(kMax, 1.0), torque(kMax, 1.0)});
  EXPECT_EQ(fused.value_Nm, kMax);
  EXPECT_EQ(fused.fault, Fault::none);
}

TEST(Redundancy, NamesThePartsThatItsSourcesShare) {
  Redundancy redundancy(three_sources());
  EXPECT_THAT(redundancy.parts(), ElementsAre("current_sensor", "supply", "motor_encoder",
                                              "gear_encoder", "joint_encoder"));
  EXPECT_EQ(redundancy.parts_of(0), 0b00011U);
  EXPECT_EQ(redundancy.parts_of(1), 0b01110U);
  EXPECT_EQ(redundancy.parts_of(2), 0b11010U);
  EXPECT_THAT(redundancy.names(0b01010), ElementsAre("supply", "gear_encoder"));
  EXPECT_THAT(redundancy.names(0), ElementsAre());
  EXPECT_EQ(redundancy.settings().sources[1].name, "gear");
}

TEST(Redundancy, ReportsThePartsThatNoComparisonCovers) {
  Redundancy redundancy(three_sources());
  const Estimate good = torque(1.0, 1.0);
  const Estimate bad = torque(kNaN, 1.0);
  const auto not_redundant = [&](const std::array<Estimate, 3>& sources) {
    return redundancy.names(redundancy.step(sources).not_redundant);
  };
  EXPECT_THAT(not_redundant({good, good, good}), ElementsAre("supply"));
  EXPECT_THAT(not_redundant({bad, good, good}), ElementsAre("supply", "gear_encoder"));
  EXPECT_THAT(not_redundant({good, bad, bad}), ElementsAre("current_sensor", "supply"));
}

// docs/simulation/faults.md 2: an offset of the encoder between gear and spring moves both estimates; the two
// pairs that disagree have that encoder in common.
TEST(Redundancy, NamesTheEncoderThatExplainsWhichSourcesDisagree) {
  const Redundancy redundancy(three_sources());
  using Pair = std::array<std::uint8_t, 2>;
  EXPECT_THAT(redundancy.names(redundancy.suspects(std::array{Pair{0, 1}, Pair{0, 2}})),
              ElementsAre("current_sensor", "supply", "gear_encoder"));
  EXPECT_THAT(redundancy.names(redundancy.suspects(std::array{Pair{0, 1}, Pair{1, 2}})),
              ElementsAre("supply", "motor_encoder", "gear_encoder"));
  EXPECT_EQ(redundancy.suspects({}), 0U);
}

TEST(Redundancy, TakesUpTo32Parts) {
  RedundancySettings settings = anonymous_sources(2);
  for (int n = 0; n < 32; ++n) settings.sources[0].depends_on.push_back(std::to_string(n));
  settings.sources[1].depends_on = {"31", "31"};
  Redundancy redundancy(settings);
  EXPECT_EQ(redundancy.parts_of(0), ~PartSet{0});
  EXPECT_EQ(redundancy.parts_of(1), PartSet{1} << 31U);
  EXPECT_THAT(redundancy.names(redundancy.parts_of(1)), ElementsAre("31"));
  settings.sources[1].depends_on = {"32"};
  EXPECT_EQ(test::error_message([&] { Redundancy{settings}; }),
            "redundancy: expected sources that depend on at most 32 parts, found more");
}

TEST(Redundancy, RefusesSettingsThatAreNotValid) {
  const auto refusal = [](const RedundancySettings& settings) {
    return test::error_message([&] { Redundancy{settings}; });
  };
  EXPECT_EQ(refusal(three_sources()), "");
  EXPECT_EQ(refusal(anonymous_sources(1)), "");
  EXPECT_EQ(refusal(anonymous_sources(8)), "");
  EXPECT_EQ(refusal({}), "redundancy: expected 1 to 8 sources, found 0");
  EXPECT_EQ(refusal(anonymous_sources(9)), "redundancy: expected 1 to 8 sources, found 9");
  RedundancySettings settings = anonymous_sources(3);
  settings.sources[2].name = "a";
  EXPECT_EQ(refusal(settings), "redundancy: expected sources with names of their own, found 'a'");
  settings.sources[2].name = "";
  EXPECT_EQ(refusal(settings), "redundancy: expected sources with names of their own, found ''");
  settings = anonymous_sources(1);
  settings.sources[0].depends_on = {"supply", ""};
  EXPECT_EQ(refusal(settings),
            "redundancy: expected parts with names, found a part of 'a' without "
            "one");
}

TEST(Redundancy, AFactorCountsAsALongerErrorBar) {
  RedundancySettings settings = anonymous_sources(3);
  settings.correlation = {1.0, 0.3, 0.1, 0.3, 1.0, -0.2, 0.1, -0.2, 1.0};
  Redundancy plain(settings);
  settings.error_bar_factors = {2.0, 1.0, 3.0};
  Redundancy weighed(settings);
  const std::vector<Estimate> sources{torque(1.0, 0.5), torque(2.0, 1.0), torque(4.0, 0.25)};
  const std::vector<Estimate> longer{torque(1.0, 1.0), torque(2.0, 1.0), torque(4.0, 0.75)};
  const FusedTorque expected = plain.step(longer);
  const FusedTorque fused = weighed.step(sources);
  EXPECT_EQ(fused.value_Nm, expected.value_Nm);
  EXPECT_EQ(fused.std_dev_Nm, expected.std_dev_Nm);
  EXPECT_NE(fused.value_Nm, plain.step(sources).value_Nm);
  // A product that is not a number of this machine.
  settings.error_bar_factors = {1e6, 1e6, 1e6};
  const double huge = std::numeric_limits<double>::max();
  const FusedTorque far = Redundancy(settings).step(
      std::vector{torque(1.0, huge), torque(2.0, huge), torque(4.0, huge)});
  EXPECT_GE(far.value_Nm, 1.0);
  EXPECT_LE(far.value_Nm, 4.0);
}

TEST(Redundancy, RefusesFactorsThatAreNotOneForEachSource) {
  const auto refusal = [](std::vector<double> factors) {
    RedundancySettings settings = anonymous_sources(2);
    settings.error_bar_factors = std::move(factors);
    return test::error_message([&] { Redundancy{settings}; });
  };
  EXPECT_EQ(refusal({1.0, 1e6}), "");
  const std::string expected =
      "redundancy: error_bar_factors: expected 2 numbers from 1 to 1e+06, found ";
  EXPECT_EQ(refusal({2.0}), expected + "2");
  EXPECT_EQ(refusal({1.0, 0.5}), expected + "1, 0.5");
  EXPECT_EQ(refusal({1.0, 2e6}), expected + "1, 2000000");
  EXPECT_EQ(refusal({kNaN, 1.0}), expected + "nan, 1");
}

TEST(Redundancy, RefusesWhatIsNoCorrelation) {
  const auto refusal = [](const std::vector<double>& correlation, std::size_t count = 2) {
    RedundancySettings settings = anonymous_sources(count);
    settings.correlation = correlation;
    return test::error_message([&] { Redundancy{settings}; });
  };
  EXPECT_EQ(refusal({1.0, 0.5, 0.5, 1.0}), "");
  EXPECT_EQ(refusal({1.0, -0.5, -0.5, 1.0}), "");
  EXPECT_EQ(refusal({1.0, 0.5}), "redundancy: expected a correlation of 2 x 2 numbers, found 2");
  EXPECT_EQ(refusal({1.0, 0.5, 0.4, 1.0}),
            "redundancy: expected a symmetric correlation with ones on its diagonal, found 0.5 in "
            "row 1, column 2");
  EXPECT_EQ(refusal({1.0, 0.5, 0.5, 0.9}),
            "redundancy: expected a symmetric correlation with ones on its diagonal, found 0.9 in "
            "row 2, column 2");
  EXPECT_NE(refusal({1.0, kNaN, kNaN, 1.0}), "");
  EXPECT_EQ(refusal({1.0, 1.5, 1.5, 1.0}),
            "redundancy: expected a symmetric correlation with ones on its diagonal, found 1.5 in "
            "row 1, column 2");
  const std::string singular =
      "redundancy: the correlation of the sources is not positive definite\n  two sources with "
      "a correlation of 1 are one source";
  EXPECT_EQ(refusal({1.0, 1.0, 1.0, 1.0}), singular);
  EXPECT_EQ(refusal({1.0, -1.0, -1.0, 1.0}), singular);
  EXPECT_EQ(refusal({1.0, 0.9, 0.0, 0.9, 1.0, 0.9, 0.0, 0.9, 1.0}, 3), singular);
  // The pivot before the last is the one that is too small.
  EXPECT_EQ(refusal({1.0, 1.0, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0, 1.0}, 3), singular);
}

// Against every active set that there is.
RC_GTEST_PROP(Redundancy, HasTheSmallestVarianceOfAllWeightsThatAreNotNegative, ()) {
  Random random = any_random();
  for (int n = 0; n < 20; ++n) {
    const Case drawn = random_case(random);
    const FusedTorque fused = Redundancy(drawn.settings).step(agreeing(drawn.sources));
    const double best = std::sqrt(smallest_variance(drawn.std_devs, drawn.settings.correlation));
    RC_ASSERT(std::abs(fused.std_dev_Nm / best - 1.0) < 1e-6);
  }
}

RC_GTEST_PROP(Redundancy, LiesBetweenItsSources, ()) {
  Random random = any_random();
  for (int n = 0; n < 50; ++n) {
    const Case drawn = random_case(random);
    const double fused = Redundancy(drawn.settings).step(drawn.sources).value_Nm;
    const auto [lowest, highest] = std::ranges::minmax(drawn.sources, {}, &Estimate::value);
    RC_ASSERT(fused >= lowest.value);
    RC_ASSERT(fused <= highest.value);
  }
}

RC_GTEST_PROP(Redundancy, IsNeverMoreCertainWithASourceLess, ()) {
  Random random = any_random();
  for (int n = 0; n < 20; ++n) {
    const Case drawn = random_case(random);
    Redundancy redundancy(drawn.settings);
    const FusedTorque all = redundancy.step(agreeing(drawn.sources));
    for (std::size_t lost = 0; lost < drawn.sources.size(); ++lost) {
      std::vector<Estimate> fewer = agreeing(drawn.sources);
      fewer[lost].fault = Fault::input_not_finite;
      const FusedTorque fused = redundancy.step(fewer);
      RC_ASSERT(fused.used == (all.used & ~(SourceSet{1} << lost)));
      RC_ASSERT(fused.used == 0 || fused.std_dev_Nm >= all.std_dev_Nm * (1.0 - 1e-9));
      RC_ASSERT((fused.used == 0) == (fused.fault != Fault::none));
    }
  }
}

RC_GTEST_PROP(Redundancy, DependsOnNothingThatAnInvalidSourceReports, ()) {
  Random random = any_random();
  for (int n = 0; n < 20; ++n) {
    const Case drawn = random_case(random);
    std::vector<Estimate> left = drawn.sources;
    std::vector<Estimate> right = drawn.sources;
    for (std::size_t i = 0; i < left.size(); ++i) {
      if (random.uniform() < 0.5) continue;
      left[i].fault = Fault::diverged;
      right[i] = {.value = random.uniform() < 0.5 ? 1e300 : kNaN, .std_dev = kNaN};
    }
    const FusedTorque one = Redundancy(drawn.settings).step(left);
    const FusedTorque other = Redundancy(drawn.settings).step(right);
    RC_ASSERT(one.value_Nm == other.value_Nm);
    RC_ASSERT(one.used == other.used);
    RC_ASSERT(one.std_dev_Nm == other.std_dev_Nm ||
              (std::isnan(one.std_dev_Nm) && std::isnan(other.std_dev_Nm)));
  }
}

// Whatever the bits of its inputs are.
RC_GTEST_PROP(Redundancy, IsFiniteForAnyBits, ()) {
  Random random = any_random();
  const auto any = [&] {
    return std::bit_cast<double>(static_cast<std::uint64_t>(random.uniform() * 0x1p53) << 11U |
                                 static_cast<std::uint64_t>(random.uniform() * 2048.0));
  };
  for (int n = 0; n < 200; ++n) {
    Redundancy redundancy(three_sources());
    const std::array sources{torque(any(), any()), torque(any(), std::abs(any())),
                             torque(any(), 1.0)};
    const FusedTorque fused = redundancy.step(sources);
    RC_ASSERT(std::isfinite(fused.value_Nm));
    RC_ASSERT(fused.fault != Fault::none || fused.std_dev_Nm > 0.0);
    RC_ASSERT(fused.fault != Fault::none || std::isfinite(fused.std_dev_Nm));
  }
}

}  // namespace
}  // namespace torsio

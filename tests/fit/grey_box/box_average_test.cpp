#include "fit/grey_box/box_average.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <span>
#include <vector>

#include "fit/grey_box/empty_terms.hpp"
#include "fit/grey_box/fit_grey_box.hpp"
#include "numerics/thread_share.hpp"
#include "support/example_data.hpp"
#include "torsio/core/random.hpp"

namespace torsio {
namespace {

using Row = std::span<const double>;
constexpr double kReversalShare = 0.2;

/// A stiffening spring with one slip element and much noise, so that many boxes are nearly as good.
TrainingData noisy_data() {
  Matrix features(6000, 1);
  for (std::size_t n = 0; n < features.rows; ++n) {
    const double t = 0.004 * static_cast<double>(n);
    features(n, 0) = 0.06 * std::sin(t) + 0.03 * std::sin(2.7 * t) + 0.015 * std::sin(7.1 * t);
  }
  Random random(5);
  double slip = 0.0;
  double last = 0.0;
  return test::training_data_of(
      {{.expression = "spring_deflection_rad"}}, std::move(features), [&](Row x) {
        slip = std::clamp(slip + x[0] - last, -0.01, 0.01);
        last = x[0];
        return 400.0 * x[0] + 2e4 * x[0] * x[0] * x[0] + 150.0 * slip + 2.0 * random.normal();
      });
}

std::vector<double> estimates_of(const GreyBox::Parameters& parameters, const TrainingData& data) {
  GreyBox box(parameters);
  std::vector<double> estimates;
  const Sequence& sequence = data.sequences[0];
  for (std::size_t n = 0; n < sequence.target.size(); ++n)
    estimates.push_back(box.step(sequence.features.row(n)).value);
  return estimates;
}

void expect_near(const std::vector<double>& found, const std::vector<double>& expected) {
  ASSERT_EQ(found.size(), expected.size());
  for (std::size_t n = 0; n < found.size(); ++n) ASSERT_NEAR(found[n], expected[n], 1e-9) << n;
}

/// Three structures whose knots and thresholds are among those of `all`.
constexpr GreyBoxChoice kAll{.curve = 3, .slips = 0b01010101, .forces = 2};
std::vector<GreyBoxChoice> parts_of_all() {
  return {{.curve = 1, .slips = 0b00010001, .forces = 0},
          {.curve = 3, .slips = 0b00010001, .forces = 2, .smoothing = 1},
          {.curve = 2, .slips = 0b01000100, .forces = 1}};
}

TEST(BoxAverage, TermsOfSeveralBoxesRepresentEachOfThem) {
  const TrainingData data = noisy_data();
  const GreyBoxSearch search(data, "", kReversalShare);
  const GreyBoxCandidate all(search.sums(), kAll);
  for (const GreyBoxChoice& choice : parts_of_all()) {
    const GreyBoxCandidate part(search.sums(), choice);
    expect_near(estimates_of(all.with(part.finest_coefficients()), data),
                estimates_of(part.fitted(), data));
  }
}

TEST(BoxAverage, EstimatesTheMeanOfWhatTheBoxesEstimate) {
  const TrainingData data = noisy_data();
  const GreyBoxSearch search(data, "", kReversalShare);
  std::vector<double> coefficients(search.sums().all.columns(), 0.0);
  std::vector<double> mean(data.sequences[0].target.size(), 0.0);
  for (const GreyBoxChoice& choice : parts_of_all()) {
    const GreyBoxCandidate part(search.sums(), choice);
    const std::vector<double> own = part.finest_coefficients();
    for (std::size_t j = 0; j < own.size(); ++j) coefficients[j] += own[j] / 3.0;
    const std::vector<double> estimates = estimates_of(part.fitted(), data);
    for (std::size_t n = 0; n < mean.size(); ++n) mean[n] += estimates[n] / 3.0;
  }
  expect_near(estimates_of(GreyBoxCandidate(search.sums(), kAll).with(coefficients), data), mean);
}

TEST(BoxAverage, PredictsHeldOutDataNearlyAsWellAsTheChosenBoxOrBetter) {
  const TrainingData data = noisy_data();
  const GreyBoxSearch search(data, "", kReversalShare);
  const GreyBoxSearch::Candidate chosen = search.choose(false, {});
  const auto average = box_average(search, chosen, data, kReversalShare);
  ASSERT_TRUE(average);
  EXPECT_GT(average->boxes, 2U);
  EXPECT_LT(average->held_out_rmse, 1.02 * chosen.held_out_error);
  EXPECT_NEAR(average->held_out_rmse, 2.0, 0.1) << "the noise";
}

TEST(BoxAverage, IsTheSameForAnyNumberOfThreads) {
  const TrainingData data = noisy_data();
  const GreyBoxSearch search(data, "", kReversalShare);
  const GreyBoxSearch::Candidate chosen = search.choose(false, {});
  const auto first = box_average(search, chosen, data, kReversalShare);
  const std::atomic<std::size_t> one = 1;
  const ThreadShare on_one_thread(&one);
  const auto again = box_average(search, chosen, data, kReversalShare);
  ASSERT_TRUE(first && again);
  EXPECT_EQ(first->parameters.coefficients.values.values,
            again->parameters.coefficients.values.values);
}

TEST(BoxAverage, IsLeftOutOnRequest) {
  const TrainingData data = noisy_data();
  const GreyBoxSearch search(data, "", kReversalShare);
  const GreyBoxSearch::Candidate chosen = search.choose_thresholds(search.choose(false, {}), {});
  const auto coefficients = [&](bool averages) {
    return fit_grey_box(data, {.average = averages, .residual = ResidualKind::none})
        .parameters.coefficients.values.values;
  };
  const auto expected = [](const GreyBox::Parameters& box) {
    return without_empty_terms(box).coefficients.values.values;
  };
  EXPECT_EQ(coefficients(false), expected(search.fitted(chosen.choice)));
  EXPECT_EQ(coefficients(true),
            expected(box_average(search, chosen, data, kReversalShare)->parameters));
}

TEST(BoxAverage, OfPassiveBoxesIsPassive) {
  const TrainingData data = noisy_data();
  const GreyBoxSearch search(data, "", kReversalShare);
  const auto average = box_average(search, search.choose(true, {}), data, kReversalShare);
  ASSERT_TRUE(average);
  const GreyBoxTerms::Structure& terms = average->parameters.terms;
  for (std::size_t j = terms.first_slip(); j < terms.first_slope(); ++j)
    EXPECT_GE(average->parameters.coefficients.values(0, j), 0.0) << j;
}

TEST(WithoutEmptyTerms, EstimatesTheSameWithFewerTerms) {
  const TrainingData data = noisy_data();
  const GreyBoxSearch search(data, "", kReversalShare);
  GreyBox::Parameters box =
      search.fitted({.curve = 2, .slips = 0b01010100, .forces = 1, .branches = 1});
  const std::size_t knots = box.terms.friction_knots.size();
  const std::size_t slip = box.terms.first_slip();
  const std::size_t branch = box.terms.first_relaxation();
  for (std::size_t j = 0; j < 3; ++j) {  // the second slip element and the second branch are empty
    box.coefficients.values(0, branch + j) = j == 1 ? 0.0 : 50.0;
    for (std::size_t k = 0; k < knots; ++k)
      box.coefficients.values(0, slip + j * knots + k) = j == 1 ? 0.0 : 0.5;
  }
  const GreyBox::Parameters fewer = without_empty_terms(box);
  EXPECT_EQ(fewer.terms.thresholds,
            (std::vector{box.terms.thresholds[0], box.terms.thresholds[2]}));
  EXPECT_EQ(fewer.terms.time_constants_s,
            (std::vector{box.terms.time_constants_s[0], box.terms.time_constants_s[2]}));
  EXPECT_EQ(estimates_of(fewer, data), estimates_of(box, data));
}

}  // namespace
}  // namespace torsio

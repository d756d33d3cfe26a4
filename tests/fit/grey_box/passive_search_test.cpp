#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>

#include "fit/grey_box/empty_terms.hpp"
#include "fit/grey_box/fit_grey_box.hpp"
#include "fit/grey_box/grey_box_search.hpp"
#include "support/example_data.hpp"
#include "torsio/core/random.hpp"

namespace torsio {
namespace {

constexpr double kFirstRateShare = 0.2;

/// A chirp over a stiffening spring with two slip elements.
TrainingData chirp(double amplitude_rad, std::uint64_t seed) {
  constexpr std::array kThresholds_rad{0.002, 0.02};
  constexpr std::array kStiffness_Nm_rad{500.0, 200.0};
  Matrix features(2500, 1);
  for (std::size_t n = 0; n < features.rows; ++n) {
    const double t_s = 0.008 * static_cast<double>(n);
    features(n, 0) = amplitude_rad * (1.0 - 0.02 * t_s) * std::sin(6.28 * t_s * (0.1 + 0.05 * t_s));
  }
  Random random(seed);
  std::array<double, 2> slips{};
  double last = 0.0;
  return test::training_data_of({{.expression = "spring_deflection_rad"}}, std::move(features),
                                [&](std::span<const double> x) {
                                  double torque = 400.0 * x[0] + 2e4 * x[0] * x[0] * x[0];
                                  for (std::size_t i = 0; i < slips.size(); ++i) {
                                    slips[i] = std::clamp(slips[i] + x[0] - last,
                                                          -kThresholds_rad[i], kThresholds_rad[i]);
                                    torque += kStiffness_Nm_rad[i] * slips[i];
                                  }
                                  last = x[0];
                                  return torque + 0.05 * random.normal();
                                });
}

TrainingData two_chirps() {
  TrainingData both = chirp(0.1, 5);
  both.sequences.push_back(chirp(0.04, 6).sequences.front());
  return both;
}

TEST(GreyBoxFit, SearchesPassiveTermsOnTheirOwnWhereRecordingsAreHeldOut) {
  const TrainingData data = two_chirps();
  const GreyBoxSearch search(data, "", kFirstRateShare);
  const GreyBoxSearch::Candidate either = search.choose(false, {});
  const GreyBoxSearch::Candidate passive = search.choose(true, {});
  ASSERT_TRUE(either.choice.is_signed);
  ASSERT_LT(passive.score, 0.95 * either.score) << "or the example does not show it";
  const FittedGreyBox fitted =
      fit_grey_box(data, {.average = false, .residual = ResidualKind::none});
  const GreyBoxSearch::Candidate best = search.choose_thresholds(passive, {});
  EXPECT_EQ(fitted.parameters.coefficients.values.values,
            without_empty_terms(search.fitted(best.choice)).coefficients.values.values);
}

TEST(GreyBoxFit, SearchesPassiveTermsOfASingleRecordingOnRequestOnly) {
  const TrainingData data = chirp(0.1, 5);
  const GreyBoxSearch search(data, "", kFirstRateShare);
  const GreyBoxSearch::Candidate either = search.choose_thresholds(search.choose(false, {}), {});
  const FittedGreyBox fitted =
      fit_grey_box(data, {.average = false, .residual = ResidualKind::none});
  EXPECT_EQ(fitted.parameters.coefficients.values.values,
            without_empty_terms(search.fitted(either.choice)).coefficients.values.values);
}

}  // namespace
}  // namespace torsio

#include "signal/causal_polynomial.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstddef>

#include "torsio/core/error.hpp"

namespace torsio {
namespace {

TEST(CausalPolynomial, IsExactForPolynomialsOfItsOrderOnceEnoughSamplesHaveCome) {
  for (std::size_t order = 1; order <= CausalPolynomial::kHighestOrder; ++order) {
    CausalPolynomial polynomial(order, {0.0, 0.3, 1.0});
    const auto curve = [order](double t) {
      return 2.0 - t + 0.1 * std::pow(t, static_cast<double>(order));
    };
    for (std::size_t n = 0; n < 12; ++n) {
      const auto t = static_cast<double>(n);
      const auto values = polynomial.step(curve(t));
      if (n < order) continue;
      const double tolerance = 1e-11 * std::abs(curve(t)) + 1e-12;
      EXPECT_NEAR(values[0], curve(t - 1.0), tolerance) << order << ", " << n;
      EXPECT_NEAR(values[1], curve(t - 0.7), tolerance) << order << ", " << n;
      EXPECT_NEAR(values[2], curve(t), tolerance) << order << ", " << n;
    }
  }
}

TEST(CausalPolynomial, OfOrderZeroHoldsTheSampleBefore) {
  CausalPolynomial held(0, {0.5, 1.0});
  EXPECT_EQ(held.step(3.0)[1], 3.0);
  EXPECT_EQ(held.step(7.0)[1], 3.0);
  EXPECT_EQ(held.step(9.0)[0], 7.0);
}

TEST(CausalPolynomial, UsesWhatHasComeAtTheStartAndAfterAReset) {
  CausalPolynomial cubic(3, {0.5});
  EXPECT_FALSE(cubic.is_started());
  EXPECT_EQ(cubic.step(2.0)[0], 2.0);
  EXPECT_EQ(cubic.step(4.0)[0], 3.0);
  cubic.reset();
  EXPECT_EQ(cubic.step(8.0)[0], 8.0);
  EXPECT_EQ(cubic.step(9.0)[0], 8.5);
}

TEST(CausalPolynomial, OfOrderThreeErrsBelowItsBoundOnASine) {
  CausalPolynomial cubic(3, {0.25, 0.5, 0.75});
  constexpr double kTurn = 0.6;  // rad a sample
  double worst = 0.0;
  for (int n = 0; n < 200; ++n) {
    const auto values = cubic.step(std::sin(kTurn * n));
    for (std::size_t i = 0; i < values.size() && n > 3; ++i)
      worst = std::max(
          worst,
          std::abs(values[i] - std::sin(kTurn * (n - 0.75 + 0.25 * static_cast<double>(i)))));
  }
  EXPECT_LT(worst, std::pow(kTurn, 4) / 24.0);
  EXPECT_GT(worst, 0.3 * std::pow(kTurn, 4) / 24.0);
}

TEST(CausalPolynomial, RefusesWhatItCannotDo) {
  EXPECT_THROW(CausalPolynomial(6, {0.5}), Error);
  EXPECT_THROW(CausalPolynomial(3, {1.5}), Error);
  EXPECT_THROW(CausalPolynomial(3, {NAN}), Error);
}

}  // namespace
}  // namespace torsio

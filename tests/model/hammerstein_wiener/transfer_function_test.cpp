#include "model/hammerstein_wiener/transfer_function.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "model/hammerstein_wiener/hammerstein_wiener.hpp"
#include "support/error_message.hpp"

namespace torsio {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using Complex = std::complex<double>;

constexpr double kPeriod_s = 0.005;

Complex at(const DiscreteTransfer& transfer, Complex z) {
  const auto side = [&](const std::vector<double>& of) {
    Complex sum = 0.0;
    for (std::size_t k = 0; k < of.size(); ++k) sum += of[k] * std::pow(z, -static_cast<double>(k));
    return sum;
  };
  return side(transfer.numerator) / side(transfer.denominator);
}

Complex at(const ContinuousTransfer& transfer, Complex s) {
  const auto side = [&](const std::vector<double>& of) {
    Complex sum = 0.0;
    for (const double c : of) sum = sum * s + c;
    return sum;
  };
  return side(transfer.numerator) / side(transfer.denominator);
}

std::vector<double> real_parts(std::vector<Complex> of) {
  std::vector<double> parts;
  for (const Complex each : of) parts.push_back(each.real());
  std::ranges::sort(parts);
  return parts;
}

TEST(TransferFunction, HasTheRootsThatThePaperPrints) {
  const Sections sections = sections_of({{1.0, -0.9989, 0.0}, {1.0, -0.5793, -0.417}});
  const std::vector<double> found = real_parts(poles(sections));
  ASSERT_EQ(found.size(), 2U);
  EXPECT_NEAR(found[0], -0.41809, 5e-6);  // (7): .9973, -.4181
  EXPECT_NEAR(found[1], 0.99739, 5e-6);
  EXPECT_NEAR(real_parts(zeros(sections)).front(), 0.9989, 1e-12);
}

// Specification 2: Tustin at 5 ms -> (1.7198, 688.29, 151.42) / (1, 975.31, 509.3), printed as (8).
TEST(TransferFunction, TustinGivesThePapersContinuousForm) {
  const ContinuousTransfer found = continuous_of(Paper003::discrete);
  ASSERT_EQ(found.numerator.size(), 3U);
  EXPECT_NEAR(found.numerator[0], 1.7198, 5e-5);
  EXPECT_NEAR(found.numerator[1], 688.29, 5e-3);
  EXPECT_NEAR(found.numerator[2], 151.42, 5e-3);
  EXPECT_EQ(found.denominator[0], 1.0);
  EXPECT_NEAR(found.denominator[1], 975.31, 5e-3);
  EXPECT_NEAR(found.denominator[2], 509.3, 5e-2);
}

TEST(TransferFunction, TustinAndBackIsTheSame) {
  const DiscreteTransfer transfer{{0.5, -0.2, 0.1}, {1.0, -1.2, 0.6, -0.1}};
  const DiscreteTransfer back = tustin(tustin(transfer, kPeriod_s), kPeriod_s);
  for (std::size_t k = 0; k < 4; ++k) {
    EXPECT_NEAR(back.denominator[k], transfer.denominator[k], 1e-9) << k;
    EXPECT_NEAR(back.numerator[k], k < 3 ? transfer.numerator[k] : 0.0, 1e-9) << k;
  }
}

TEST(TransferFunction, TustinKeepsTheGainAtTheWarpedFrequency) {
  const DiscreteTransfer transfer{{1.0, -0.9989}, {1.0, -0.5793, -0.417}};
  const double angle = 0.3;
  const double omega = 2.0 / kPeriod_s * std::tan(0.5 * angle);
  EXPECT_NEAR(std::abs(at(tustin(transfer, kPeriod_s), {0.0, omega})),
              std::abs(at(transfer, std::polar(1.0, angle))), 1e-9);
}

TEST(TransferFunction, WarnsOfPolesThatNoContinuousSystemHas) {
  const std::string warning =
      continuous_warning(sections_of({{1.0, -0.9989}, {1.0, -0.5793, -0.417}}), kPeriod_s);
  EXPECT_THAT(warning, HasSubstr("-974.8 rad/s"));
  EXPECT_THAT(warning, HasSubstr("628.3 rad/s"));
  EXPECT_EQ(continuous_warning(sections_of({{1.0}, {1.0, -1.8, 0.9}}), kPeriod_s), "");
}

TEST(TransferFunction, HasThePolesAndZerosOfTheRefinedForm) {
  const ContinuousTransfer refined = continuous_of(Paper003::refined);
  const auto found = real_parts(polynomial_roots(refined.denominator));
  EXPECT_NEAR(found[0], -1.416, 1e-3);   // specification 2
  EXPECT_NEAR(found[1], -0.1282, 2e-4);  // -0.12807 of the printed coefficients
  const auto of_numerator = real_parts(polynomial_roots(refined.numerator));
  EXPECT_NEAR(of_numerator[0], -1.0209, 1e-4);
  EXPECT_NEAR(of_numerator[1], -0.0479, 1e-4);
}

// A ramp through a first-order lag: x' = -p x + u has a closed form between samples.
TEST(TransferFunction, FirstOrderHoldIsExactForARamp) {
  const double rate = 3.0;
  const DiscreteTransfer held = first_order_hold({{1.0}, {1.0, rate}}, 0.1);
  double x = 0.0;
  double last = 0.0;
  for (std::size_t n = 1; n <= 40; ++n) {
    const double t = 0.1 * static_cast<double>(n);
    x = -held.denominator[1] * x + held.numerator[0] * t + held.numerator[1] * last;
    last = t;
    EXPECT_NEAR(x, t / rate - (1.0 - std::exp(-rate * t)) / (rate * rate), 1e-13) << n;
  }
}

TEST(TransferFunction, FirstOrderHoldOfSlowPolesIsNearlyTustin) {
  const ContinuousTransfer refined = continuous_of(Paper003::refined);
  const DiscreteTransfer held = first_order_hold(refined, kPeriod_s);
  for (const double frequency_Hz : {0.01, 0.4, 4.0}) {
    const double omega = 2.0 * std::numbers::pi * frequency_Hz;
    const Complex exact = at(refined, {0.0, omega});
    EXPECT_LT(std::abs(at(held, std::polar(1.0, omega * kPeriod_s)) - exact), 1e-3) << frequency_Hz;
  }
}

TEST(Sections, AreTheTransferFunctionThatTheyCameFrom) {
  for (const DiscreteTransfer& transfer :
       {DiscreteTransfer{{2.0}, {1.0}}, DiscreteTransfer{{2.0, -0.3}, {1.0, -0.9}},
        DiscreteTransfer{{0.0, 0.0, 0.0, 3.0, 1.0}, {1.0, -0.9, 0.2}},
        DiscreteTransfer{{1.0, 0.4, 0.2, -0.3, 0.1, 0.05}, {1.0, -2.4, 2.2, -0.9, 0.2, -0.02}}}) {
    const DiscreteTransfer back = transfer_of(sections_of(transfer));
    for (const double angle : {0.01, 0.5, 2.0}) {
      const Complex z = std::polar(1.0, angle);
      EXPECT_LT(std::abs(at(back, z) - at(transfer, z)), 1e-9 * std::abs(at(transfer, z)));
    }
  }
}

TEST(Sections, DistinguishSlowPolesThatOnePolynomialBlurs) {
  Sections sections(3, kSectionColumns);
  const std::vector<double> slow{0.9999, 0.9998, 0.9997, 0.9996, 0.9995, 0.9994};
  for (std::size_t i = 0; i < 3; ++i) {
    sections(i, 0) = 1.0;
    sections(i, 3) = -(slow[2 * i] + slow[2 * i + 1]);
    sections(i, 4) = slow[2 * i] * slow[2 * i + 1];
  }
  const auto error_of = [&](const Sections& of) {
    const auto found = real_parts(poles(of));
    double most = 0.0;
    for (std::size_t i = 0; i < slow.size(); ++i)
      most = std::max(most, std::abs(found[i] - slow[slow.size() - 1 - i]));
    return most;
  };
  EXPECT_LT(error_of(sections), 1e-9);
  EXPECT_GT(error_of(sections_of(transfer_of(sections))), 1e-4);
}

TEST(Sections, ReflectUnstablePolesAndKeepTheGainAtRest) {
  Sections sections = sections_of({{1.0, 0.2}, {1.0, -2.5, 1.0}});  // 2 and 0.5
  const double before = dc_gain(sections);
  EXPECT_EQ(reflect_unstable_poles(sections), 1U);
  EXPECT_THAT(real_parts(poles(sections)),
              ElementsAre(testing::DoubleNear(0.5, 1e-9), testing::DoubleNear(0.5, 1e-9)));
  EXPECT_NEAR(dc_gain(sections), before, 1e-12 * std::abs(before));
  EXPECT_EQ(reflect_unstable_poles(sections), 0U);
}

TEST(Sections, RefuseWhatIsNoTransferFunction) {
  EXPECT_THAT(test::error_message([] {
                (void)sections_of({{1.0}, {2.0}});
              }),
              HasSubstr("a denominator that begins with 1"));
  EXPECT_THAT(test::error_message([] {
                (void)sections_of({{0.0}, {1.0}});
              }),
              HasSubstr("a numerator"));
}

TEST(TransferFunction, IsReadable) {
  EXPECT_EQ(text_of({{1.72, -688.3, 152.2}, {1.0, 975.3, 520.1}}),
            "(1.72 s^2 - 688.3 s + 152.2) / (s^2 + 975.3 s + 520.1)");
}

}  // namespace
}  // namespace torsio

#include "sim/contacts/external_torque_fit.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstddef>
#include <limits>

#include "support/error_message.hpp"
#include "torsio/core/random.hpp"

namespace torsio {
namespace {

using testing::HasSubstr;

/// Normal errors of these coefficients; the terms vary as those of an arm.
ExternalTorqueSamples drawn(const ExternalTorqueTerms& coefficients, std::size_t count,
                            std::uint64_t seed) {
  Random random(seed);
  ExternalTorqueSamples samples;
  for (std::size_t n = 0; n < count; ++n) {
    const double inertia = random.uniform(0.5, 15.0);
    const double torque_Nm = random.uniform(-120.0, 120.0);
    const double inertial_Nm = 10.0 * random.normal();
    const ExternalTorqueTerms terms = {1.0, inertia * inertia, torque_Nm * torque_Nm,
                                       inertial_Nm * inertial_Nm};
    const double variance = ExternalTorqueError{coefficients}.variance(terms);
    samples.terms.push_back(terms);
    samples.external_Nm.push_back(std::sqrt(variance) * random.normal());
  }
  return samples;
}

TEST(ExternalTorqueFit, FindsTheCoefficientsOfItsErrors) {
  const ExternalTorqueTerms truth = {0.2, 4e-3, 4e-4, 1e-2};
  const ExternalTorqueError error = fit_external_torque_error(drawn(truth, 40'000, 1));
  EXPECT_NEAR(error.coefficients[1] / truth[1], 1.0, 0.15);
  EXPECT_NEAR(error.coefficients[2] / truth[2], 1.0, 0.05);
  EXPECT_NEAR(error.coefficients[3] / truth[3], 1.0, 0.1);
  // Held-out errors: neither too large nor too small.
  const ExternalTorqueSamples others = drawn(truth, 40'000, 2);
  double mean = 0.0;
  for (std::size_t n = 0; n < others.terms.size(); ++n)
    mean += others.external_Nm[n] * others.external_Nm[n] / error.variance(others.terms[n]) /
            static_cast<double>(others.terms.size());
  EXPECT_NEAR(mean, 1.0, 0.03);
}

TEST(ExternalTorqueFit, GivesNoPartToATermThatHasNone) {
  const ExternalTorqueError error =
      fit_external_torque_error(drawn({0.5, 0.0, 4e-4, 0.0}, 40'000, 3));
  for (const double coefficient : error.coefficients) EXPECT_GE(coefficient, 0.0);
  EXPECT_LT(error.coefficients[1] * 75.0, 0.05);  // its mean square
  EXPECT_LT(error.coefficients[3] * 100.0, 0.05);
  EXPECT_NEAR(error.coefficients[0], 0.5, 0.1);
}

TEST(ExternalTorqueFit, RefusesWhatItCannotFit) {
  ExternalTorqueSamples samples = drawn({0.5, 0.0, 0.0, 0.0}, 99, 4);
  EXPECT_THAT(test::error_message([&] { (void)fit_external_torque_error(samples); }),
              HasSubstr("at least 100"));
  samples = drawn({0.5, 0.0, 0.0, 0.0}, 200, 4);
  samples.external_Nm[5] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THAT(test::error_message([&] { (void)fit_external_torque_error(samples); }),
              HasSubstr("not finite"));
  // Exactly 0 everywhere: still an error bar that divides nothing by 0.
  samples.external_Nm.assign(200, 0.0);
  const ExternalTorqueError error = fit_external_torque_error(samples);
  EXPECT_GT(error.variance({1.0, 0.0, 0.0, 0.0}), 0.0);
}

}  // namespace
}  // namespace torsio

#include "model/grey_box/input_products.hpp"

#include <gmock/gmock.h>

#include <cmath>
#include <cstddef>
#include <limits>
#include <string>
#include <vector>

#include "support/error_message.hpp"

namespace torsio {
namespace {

using testing::HasSubstr;

InputProducts::Parameters some(std::size_t degree) {
  InputProducts::Parameters parameters{.degree = degree,
                                       .centres = {1.0, 0.0, -2.0, 0.5},
                                       .scales = {2.0, 0.0, 0.5, 4.0},
                                       .coefficients = {}};
  for (std::size_t i = 0; i < InputProducts::count(3, degree); ++i)
    parameters.coefficients.push_back(std::cos(static_cast<double>(i)));
  return parameters;
}

TEST(InputProducts, AreTheSumOfTheirTermsTimesTheCoefficients) {
  for (const std::size_t degree : {2, 3}) {
    const InputProducts::Parameters parameters = some(degree);
    InputProducts products(parameters);
    const std::vector<double> x{1.7, 9.0, -1.4, 3.0};
    const std::vector<double> z{0.35, 1.2, 0.625};
    std::vector<double> terms(parameters.coefficients.size());
    InputProducts::terms(z, degree, terms);
    double expected = 0.0;
    for (std::size_t i = 0; i < terms.size(); ++i)
      expected += parameters.coefficients[i] * terms[i];
    EXPECT_NEAR(products.step(x).value, expected, 1e-13);
  }
}

TEST(InputProducts, ContainEachProductOnce) {
  EXPECT_EQ(InputProducts::count(3, 2), 10U);
  EXPECT_EQ(InputProducts::count(7, 3), 120U);
  const std::vector<double> z{2.0, 3.0};
  std::vector<double> terms(InputProducts::count(2, 3));
  InputProducts::terms(z, 3, terms);
  EXPECT_THAT(terms, testing::UnorderedElementsAre(1, 2, 3, 4, 6, 9, 8, 12, 18, 27));
}

TEST(InputProducts, RefuseWhatMakesNoSense) {
  const auto refused = [](auto change) {
    InputProducts::Parameters parameters = some(3);
    change(parameters);
    return test::error_message([&] { (void)InputProducts(parameters); });
  };
  EXPECT_THAT(refused([](auto& p) { p.degree = 4; }), HasSubstr("degree"));
  EXPECT_THAT(refused([](auto& p) { p.centres.pop_back(); }), HasSubstr("centres"));
  EXPECT_THAT(refused([](auto& p) { p.scales.assign(4, 0.0); }), HasSubstr("scales"));
  EXPECT_THAT(refused([](auto& p) { p.scales[0] = -1.0; }), HasSubstr("scales"));
  EXPECT_THAT(refused([](auto& p) { p.coefficients.pop_back(); }), HasSubstr("coefficients"));
  EXPECT_THAT(
      refused([](auto& p) { p.coefficients[2] = std::numeric_limits<double>::quiet_NaN(); }),
      HasSubstr("coefficients"));
}

}  // namespace
}  // namespace torsio

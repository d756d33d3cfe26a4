#include "fit/narx/frols.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numeric>
#include <vector>

#include "numerics/least_squares.hpp"
#include "support/each_instruction_set.hpp"
#include "support/error_message.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/random.hpp"

namespace torsio {
namespace {

using testing::HasSubstr;
using testing::UnorderedElementsAre;

Matrix normal(std::size_t rows, std::size_t columns, std::uint64_t seed) {
  Random random(seed);
  Matrix matrix(rows, columns);
  for (double& value : matrix.values) value = random.normal();
  return matrix;
}

double product(std::span<const double> row, const Monomial& monomial,
               const std::vector<double>& scales) {
  double value = 1.0;
  for (const std::size_t i : monomial) value *= row[i] / scales[i];
  return value;
}

/// 2 - 3 x_1 + 0.5 x_0 x_2 + x_1^2 x_3 and noise.
std::vector<double> known(const Matrix& x, double noise) {
  Random random(99);
  std::vector<double> y;
  for (std::size_t n = 0; n < x.rows; ++n)
    y.push_back(2.0 - 3.0 * x(n, 1) + 0.5 * x(n, 0) * x(n, 2) + x(n, 1) * x(n, 1) * x(n, 3) +
                noise * random.normal());
  return y;
}

TEST(Frols, FindsTheTermsOfAPolynomialAmidNoise) {
  const Matrix x = normal(3000, 5, 1);
  const Frols found = frols(x, known(x, 0.3), {.degree = 3, .terms = 4});
  EXPECT_EQ(found.candidates, 56U);
  ASSERT_EQ(found.sizes.size(), 4U);
  EXPECT_THAT(found.sizes[3].terms,
              UnorderedElementsAre(Monomial{}, Monomial{1}, Monomial{0, 2}, Monomial{1, 1, 3}));
}

TEST(Frols, FindsTheSameTermsOfATargetWhoseSquaresAreZero) {
  const Matrix x = normal(3000, 5, 1);
  const std::vector<double> y = known(x, 0.3);
  constexpr int kExponent = -700;  // about 1e-211
  std::vector<double> tiny = y;
  for (double& value : tiny) value = std::ldexp(value, kExponent);
  const FrolsOptions options{.degree = 3, .terms = 6};
  const Frols expected = frols(x, y, options);
  const Frols found = frols(x, tiny, options);
  ASSERT_EQ(found.sizes.size(), expected.sizes.size());
  for (std::size_t size = 0; size < found.sizes.size(); ++size) {
    EXPECT_EQ(found.sizes[size].terms, expected.sizes[size].terms);
    EXPECT_EQ(found.sizes[size].error_reductions, expected.sizes[size].error_reductions);
    for (std::size_t t = 0; t <= size; ++t)
      EXPECT_EQ(found.sizes[size].coefficients[t],
                std::ldexp(expected.sizes[size].coefficients[t], kExponent));
  }
}

TEST(Frols, EndsWithoutNoiseAtTheLastTermThatIsThere) {
  const Matrix x = normal(500, 4, 2);
  const Frols found = frols(x, known(x, 0.0), {.degree = 3, .terms = 20});
  ASSERT_FALSE(found.sizes.empty());
  const ChosenTerms& last = found.sizes.back();
  EXPECT_THAT(last.terms,
              UnorderedElementsAre(Monomial{}, Monomial{1}, Monomial{0, 2}, Monomial{1, 1, 3}));
  for (std::size_t n = 0; n < x.rows; ++n) {
    double estimate = 0.0;
    for (std::size_t t = 0; t < last.terms.size(); ++t)
      estimate += last.coefficients[t] * product(x.row(n), last.terms[t], found.scales);
    ASSERT_NEAR(estimate, known(x, 0.0)[n], 1e-10) << n;
  }
}

TEST(Frols, CoefficientsAndReductionsAreThoseOfLeastSquaresByQr) {
  const Matrix x = normal(2000, 4, 3);
  const std::vector<double> y = known(x, 1.0);
  const double square = std::inner_product(y.begin(), y.end(), y.begin(), 0.0);
  const Frols found = frols(x, y, {.degree = 4, .terms = 12});
  ASSERT_EQ(found.sizes.size(), 12U);
  for (const ChosenTerms& size : found.sizes) {
    Matrix design(x.rows, size.terms.size());
    for (std::size_t n = 0; n < x.rows; ++n)
      for (std::size_t t = 0; t < size.terms.size(); ++t)
        design(n, t) = product(x.row(n), size.terms[t], found.scales);
    const LeastSquares plain = least_squares(design, y);
    double left = 0.0;
    for (std::size_t n = 0; n < x.rows; ++n) {
      const auto row = design.row(n);
      const double error =
          y[n] - std::inner_product(row.begin(), row.end(), plain.coefficients.begin(), 0.0);
      left += error * error;
    }
    for (std::size_t t = 0; t < size.terms.size(); ++t)
      EXPECT_NEAR(size.coefficients[t], plain.coefficients[t],
                  1e-9 * (1.0 + std::abs(plain.coefficients[t])));
    EXPECT_NEAR(std::reduce(size.error_reductions.begin(), size.error_reductions.end()),
                1.0 - left / square, 1e-12);
  }
}

TEST(Frols, TheFirstTermIsTheOneThatExplainsMostAlone) {
  const Matrix x = normal(300, 3, 4);
  const std::vector<double> y = known(normal(300, 4, 5), 0.0);
  const Frols found = frols(x, y, {.degree = 2, .terms = 1});
  const double square = std::inner_product(y.begin(), y.end(), y.begin(), 0.0);
  const std::vector<Monomial> all{{},     {0},    {1},    {2},    {0, 0},
                                  {0, 1}, {0, 2}, {1, 1}, {1, 2}, {2, 2}};
  double most = 0.0;
  Monomial best;
  for (const Monomial& monomial : all) {
    double with_y = 0.0;
    double own = 0.0;
    for (std::size_t n = 0; n < x.rows; ++n) {
      const double phi = product(x.row(n), monomial, found.scales);
      with_y += phi * y[n];
      own += phi * phi;
    }
    if (with_y * with_y / own <= most) continue;
    most = with_y * with_y / own;
    best = monomial;
  }
  ASSERT_EQ(found.sizes.size(), 1U);
  EXPECT_EQ(found.sizes[0].terms.front(), best);
  EXPECT_NEAR(found.sizes[0].error_reductions.front(), most / square, 1e-12);
}

/// x_2 looks more like y = x_0 + x_1 than either, and is of no use beside both.
Matrix with_a_distractor(std::size_t rows) {
  Matrix x = normal(rows, 3, 6);
  for (std::size_t n = 0; n < rows; ++n) x(n, 2) = x(n, 0) + x(n, 1) + 0.3 * x(n, 2);
  return x;
}

TEST(Frols, AnExchangeThrowsOutWhatTheGreedyOrderTookTooEarly) {
  const Matrix x = with_a_distractor(2000);
  std::vector<double> y;
  for (std::size_t n = 0; n < x.rows; ++n) y.push_back(x(n, 0) + x(n, 1));
  const Frols greedy = frols(x, y, {.degree = 2, .terms = 2, .exchange = false});
  EXPECT_EQ(greedy.sizes[0].terms.front(), Monomial{2});
  EXPECT_EQ(greedy.sizes[1].terms.front(), Monomial{2});
  const Frols exchanged = frols(x, y, {.degree = 2, .terms = 2});
  EXPECT_THAT(exchanged.sizes[1].terms, UnorderedElementsAre(Monomial{0}, Monomial{1}));
  EXPECT_NEAR(exchanged.sizes[1].error_reductions[0] + exchanged.sizes[1].error_reductions[1], 1.0,
              1e-12);
}

TEST(Frols, AnExchangeNeverExplainsLess) {
  const auto sum = [](const ChosenTerms& of) {
    return std::reduce(of.error_reductions.begin(), of.error_reductions.end());
  };
  for (std::uint64_t seed = 10; seed < 20; ++seed) {
    const Matrix x = normal(200, 4, seed);
    const std::vector<double> y = known(x, 3.0);
    const Frols greedy = frols(x, y, {.degree = 3, .terms = 6, .exchange = false});
    const Frols exchanged = frols(x, y, {.degree = 3, .terms = 6});
    for (std::size_t k = 0; k < 6; ++k)
      EXPECT_GE(sum(exchanged.sizes[k]), sum(greedy.sizes[k]) - 1e-12) << "seed " << seed;
  }
}

TEST(Frols, PassesOverCandidatesThatAreAlike) {
  Matrix x = normal(400, 5, 7);
  for (std::size_t n = 0; n < x.rows; ++n) {
    x(n, 2) = x(n, 1);                  // a copy
    x(n, 3) = 4.0;                      // like the constant
    x(n, 4) = 2.0 * x(n, 0) - x(n, 1);  // combination of both
  }
  std::vector<double> y;
  Random random(3);
  for (std::size_t n = 0; n < x.rows; ++n)
    y.push_back(1.0 + x(n, 0) + 2.0 * x(n, 1) + random.normal());
  const Frols found = frols(x, y, {.degree = 2, .terms = 20});
  // Two free inputs have six different monomials.
  ASSERT_EQ(found.sizes.size(), 6U);
  for (const double coefficient : found.sizes.back().coefficients)
    EXPECT_LT(std::abs(coefficient), 1e3);
}

TEST(Frols, NearlyDependentColumnsKeepTheirCoefficients) {
  Matrix x = normal(3000, 2, 8);
  for (std::size_t n = 0; n < x.rows; ++n) x(n, 1) = x(n, 0) + 1e-4 * x(n, 1);
  std::vector<double> y;
  for (std::size_t n = 0; n < x.rows; ++n) y.push_back(3.0 * x(n, 0) - 2.0 * x(n, 1));
  const Frols found = frols(x, y, {.degree = 1, .terms = 3});
  ASSERT_EQ(found.sizes.size(), 2U);
  const ChosenTerms& both = found.sizes.back();
  for (std::size_t t = 0; t < 2; ++t) {
    const std::size_t i = both.terms[t].front();
    EXPECT_NEAR(both.coefficients[t] / found.scales[i], i == 0 ? 3.0 : -2.0, 1e-6);
  }
}

TEST(Frols, ChoosesTheSameOnEveryInstructionSet) {
  const Matrix x = normal(777, 6, 9);
  const std::vector<double> y = known(x, 1.0);
  std::vector<Frols> all;
  test::on_each_instruction_set(
      [&](const char* /*name*/) { all.push_back(frols(x, y, {.degree = 3, .terms = 10})); });
  for (const Frols& each : all) {
    EXPECT_EQ(each.sizes.back().terms, all.front().sizes.back().terms);
    for (std::size_t t = 0; t < 10; ++t)
      EXPECT_NEAR(each.sizes.back().coefficients[t], all.front().sizes.back().coefficients[t],
                  1e-9);
  }
}

TEST(MonomialCount, IsABinomialAndStopsAtTheLargestNumber) {
  EXPECT_EQ(monomial_count(8, 3), 165U);
  EXPECT_EQ(monomial_count(3, 1), 4U);
  EXPECT_EQ(monomial_count(100'000, 20), std::numeric_limits<std::size_t>::max());
}

TEST(Frols, RefusesWhatItCannotDo) {
  const Matrix x = normal(50, 4, 1);
  const std::vector<double> y = known(x, 1.0);
  EXPECT_THROW((void)frols(x, y, {.degree = 0, .terms = 1}), UsageError);
  EXPECT_THROW((void)frols(x, y, {.degree = 21, .terms = 1}), UsageError);
  EXPECT_THROW((void)frols(x, y, {.degree = 1, .terms = 0}), UsageError);
  EXPECT_THROW((void)frols(x, y, {.degree = 3, .terms = 51}), Error);
  EXPECT_THROW((void)frols(x, std::vector<double>(50, 0.0), {.degree = 1, .terms = 1}), Error);
  const std::string many =
      test::error_message([] { (void)frols(Matrix(100, 200), {}, {.degree = 4, .terms = 1}); });
  EXPECT_THAT(many, HasSubstr("70058751"));
  EXPECT_THAT(many, HasSubstr("degree=2 (20301 terms)"));
  EXPECT_THROW((void)frols(x, y, {}, [](double, std::string_view) { return false; }), Cancelled);
}

}  // namespace
}  // namespace torsio

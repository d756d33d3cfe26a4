#include "model/gaussian_process/kernel.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <numbers>
#include <string>
#include <vector>

#include "support/each_instruction_set.hpp"
#include "support/error_message.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/random.hpp"

namespace torsio {
namespace {

using test::error_message;
using testing::HasSubstr;

constexpr std::size_t kInputs = 3;

Matrix random_points(std::size_t count, std::uint64_t seed) {
  Random random(seed);
  Matrix points(count, kInputs);
  for (double& value : points.values) value = random.normal();
  return points;
}

/// The kernel of that text with numbers that are all different.
Kernel some_kernel(const std::string& text) {
  Kernel kernel(parse_kernel(text, kInputs), kInputs);
  std::vector<double> numbers = kernel.log_parameters();
  for (std::size_t p = 0; p < numbers.size(); ++p)
    numbers[p] = 0.35 * std::sin(1.7 * static_cast<double>(p) + 0.4) + 0.1;
  kernel.set_log_parameters(numbers);
  return kernel;
}

double leaf(const KernelNode& node, Features x, Features z) {
  double distance = 0.0;
  double product = 0.0;
  double squares = 0.0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    const double scale = node.length_scales[node.length_scales.size() == 1 ? 0 : i];
    const double d = (x[i] - z[i]) / scale;
    distance += d * d;
    product += (x[i] - node.shape) * (z[i] - node.shape) / (scale * scale);
    const double sine = std::sin(std::numbers::pi * (x[i] - z[i]) / node.shape) / scale;
    squares += sine * sine;
  }
  const double s3 = std::sqrt(3.0 * distance);
  const double s5 = std::sqrt(5.0 * distance);
  const double by_kind[]{
      std::exp(-0.5 * distance),  product,
      std::exp(-2.0 * squares),   std::pow(1.0 + distance / (2.0 * node.shape), -node.shape),
      (1.0 + s3) * std::exp(-s3), (1.0 + s5 + s5 * s5 / 3.0) * std::exp(-s5)};
  return node.amplitude * node.amplitude * by_kind[node.kind];
}

/// The definition, with nothing shared.
double reference(const KernelExpression& kernel, Features x, Features z) {
  std::vector<double> stack;
  for (const KernelNode& node : kernel.nodes) {
    if (node.kind < static_cast<std::size_t>(KernelKind::sum)) {
      stack.push_back(leaf(node, x, z));
      continue;
    }
    const double right = stack.back();
    stack.pop_back();
    stack.back() = node.kind == static_cast<std::size_t>(KernelKind::sum) ? stack.back() + right
                                                                          : stack.back() * right;
  }
  return stack.back();
}

const std::vector<std::string> kTexts{"se",
                                      "linear",
                                      "periodic",
                                      "rq",
                                      "matern32",
                                      "matern52",
                                      "se_ard",
                                      "linear_ard",
                                      "periodic_ard",
                                      "rq_ard",
                                      "matern32_ard",
                                      "matern52_ard",
                                      "se+se_ard",
                                      "matern32*rq_ard",
                                      "se*(linear+periodic*rq)",
                                      "(se_ard+linear)*(periodic+rq*(matern52+linear_ard))+se"};

TEST(Kernel, IsItsDefinitionOnEveryInstructionSet) {
  const Matrix points = random_points(21, 1);
  const Matrix at = random_points(4, 2);
  const PackedPoints packed(points);
  detail::AlignedVector<double> values(packed.padded_size());
  test::on_each_instruction_set([&](const char* name) {
    SCOPED_TRACE(name);
    for (const std::string& text : kTexts) {
      const Kernel kernel = some_kernel(text);
      for (std::size_t n = 0; n < at.rows; ++n) {
        kernel.row(at.row(n).data(), packed, packed.size(), values.data());
        for (std::size_t j = 0; j < points.rows; ++j) {
          const double expected = reference(kernel.expression(), at.row(n), points.row(j));
          EXPECT_NEAR(values[j], expected, 1e-13 * (1.0 + std::abs(expected))) << text;
        }
        const double self = reference(kernel.expression(), at.row(n), at.row(n));
        EXPECT_NEAR(kernel.self(at.row(n).data()), self, 1e-13 * (1.0 + self)) << text;
      }
    }
  });
}

/// sum of weights times k, at other numbers.
double weighted_sum(Kernel kernel, const std::vector<double>& numbers, Features x,
                    const Matrix& points, const std::vector<double>& weights) {
  kernel.set_log_parameters(numbers);
  double sum = 0.0;
  for (std::size_t j = 0; j < points.rows; ++j)
    sum += weights[j] * reference(kernel.expression(), x, points.row(j));
  return sum;
}

TEST(Kernel, ItsGradientIsThatOfFiniteDifferences) {
  const Matrix points = random_points(13, 3);
  const Matrix at = random_points(1, 4);
  const PackedPoints packed(points);
  detail::AlignedVector<double> padded(packed.padded_size(), 0.0);
  std::vector<double> weights(points.rows);
  Random random(5);
  for (std::size_t j = 0; j < weights.size(); ++j) padded[j] = weights[j] = random.normal();
  test::on_each_instruction_set([&](const char* name) {
    SCOPED_TRACE(name);
    for (const std::string& text : kTexts) {
      const Kernel kernel = some_kernel(text);
      KernelGradient gradient(kernel.parameter_count());
      kernel.add_gradient(at.row(0).data(), packed, points.rows, padded.data(), gradient);
      const std::vector<double> numbers = kernel.log_parameters();
      ASSERT_EQ(numbers.size(), kernel.parameter_count());
      for (std::size_t p = 0; p < numbers.size(); ++p) {
        constexpr double kStep = 1e-5;
        auto more = numbers;
        auto less = numbers;
        more[p] += kStep;
        less[p] -= kStep;
        const double expected = (weighted_sum(kernel, more, at.row(0), points, weights) -
                                 weighted_sum(kernel, less, at.row(0), points, weights)) /
                                (2.0 * kStep);
        EXPECT_NEAR(gradient[p], expected, 1e-6 * std::max(1e-2, std::abs(expected)))
            << text << ", number " << p;
      }
    }
  });
}

TEST(Kernel, FarPointsHaveNoCovarianceRatherThanNone) {
  for (const char* text : {"se", "rq", "matern32", "matern52", "se*(linear+periodic*rq)"}) {
    const Kernel kernel(parse_kernel(text, 1), 1);
    PackedPoints points(Matrix(1, 1));
    detail::AlignedVector<double> value(points.padded_size());
    for (const double x : {1e3, 1e9, 1e100}) {
      kernel.row(&x, points, 1, value.data());
      EXPECT_TRUE(value[0] >= 0.0 && value[0] < 1e-2) << text << " at " << x << ": " << value[0];
    }
  }
}

TEST(Kernel, OneAmplitudeForEveryProductWithoutASum) {
  const auto count = [](const std::string& text) {
    return Kernel(parse_kernel(text, kInputs), kInputs).parameter_count();
  };
  EXPECT_EQ(count("se"), 2U);
  EXPECT_EQ(count("se_ard"), 1U + kInputs);
  EXPECT_EQ(count("linear"), 2U) << "its length scale is its amplitude";
  EXPECT_EQ(count("periodic"), 3U);
  EXPECT_EQ(count("se*rq"), 4U);
  EXPECT_EQ(count("se*(linear+periodic*rq)"), 8U) << "theta 2 to 9 of paper 002";
}

TEST(KernelText, ComesBackAsItWasRead) {
  for (const std::string& text : kTexts) EXPECT_EQ(text_of(parse_kernel(text, kInputs)), text);
  EXPECT_EQ(text_of(parse_kernel("  ( se ) * (( rq +linear ))", 1)), "se*(rq+linear)");
  EXPECT_EQ(text_of(parse_kernel("se*rq+linear*se", 2)), "se*rq+linear*se");
}

TEST(KernelText, PointsAtThePlaceOfAMistake) {
  const auto complaint = [](const std::string& text) {
    return error_message([&] { (void)parse_kernel(text, 2); });
  };
  EXPECT_THAT(complaint(""), HasSubstr("column 1"));
  EXPECT_THAT(complaint("se*(linear+sine)"),
              testing::AllOf(HasSubstr("column 12"), HasSubstr("matern52"), HasSubstr("'sine'")));
  EXPECT_THAT(complaint("se*(linear"), testing::AllOf(HasSubstr("column 11"), HasSubstr("')'")));
  EXPECT_THAT(complaint("se linear"), HasSubstr("column 4"));
  EXPECT_THAT(complaint("se)"), HasSubstr("column 3"));
  EXPECT_THAT(complaint("se++se"), HasSubstr("column 4"));
  EXPECT_THAT(complaint(std::string(200, '(')), HasSubstr("brackets"));
  std::string many = "se";
  for (int i = 0; i < 40; ++i) many += "+se";
  EXPECT_THAT(complaint(many), HasSubstr("at most 64"));
}

TEST(Kernel, RefusesLengthScalesOfASum) {
  KernelExpression kernel = parse_kernel("se+se", 2);
  kernel.nodes.back().length_scales.assign(100000, 1.0);
  EXPECT_NE(error_message([&] { const Kernel built(kernel, 2); }).find("none of a sum or product"),
            std::string::npos);
}

TEST(Kernel, RefusesNumbersThatMakeNone) {
  const auto complaint = [](const std::function<void(KernelExpression&)>& spoil) {
    KernelExpression kernel = parse_kernel("se_ard+rq", 2);
    spoil(kernel);
    return error_message([&] { const Kernel built(kernel, 2); });
  };
  EXPECT_EQ(complaint([](KernelExpression&) {}), "");
  EXPECT_THAT(complaint([](auto& k) { k.nodes.clear(); }), HasSubstr("1 to 64"));
  EXPECT_THAT(complaint([](auto& k) { k.nodes[0].kind = 8; }), HasSubstr("kernel.nodes.0: kind"));
  EXPECT_THAT(complaint([](auto& k) { k.nodes.pop_back(); }), HasSubstr("one expression"));
  EXPECT_THAT(complaint([](auto& k) { k.nodes.erase(k.nodes.begin()); }), HasSubstr("fewer"));
  EXPECT_THAT(complaint([](auto& k) { k.nodes[0].length_scales.push_back(1.0); }),
              HasSubstr("one per input"));
  EXPECT_THAT(complaint([](auto& k) { k.nodes[0].length_scales[1] = 0.0; }),
              HasSubstr("length_scales"));
  EXPECT_THAT(complaint([](auto& k) { k.nodes[1].amplitude = -1.0; }), HasSubstr("amplitude"));
  EXPECT_THAT(complaint([](auto& k) { k.nodes[1].shape = 0.0; }), HasSubstr("shape"));
}

}  // namespace
}  // namespace torsio

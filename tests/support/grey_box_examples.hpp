#pragma once

#include <cmath>
#include <cstddef>
#include <utility>

#include "support/example_models.hpp"
#include "support/examples/grey_box.hpp"
#include "support/random_network.hpp"

namespace torsio::test {

/// A grey box with a network as its residual. A type of its own, so that laws run on it.
struct GreyBoxWithMlp : GreyBox {
  using GreyBox::GreyBox;
};
/// The same with a mixture.
struct GreyBoxWithDgmm : GreyBox {
  using GreyBox::GreyBox;
};
/// The same with products of the inputs.
struct GreyBoxWithProducts : GreyBox {
  using GreyBox::GreyBox;
};
/// The same with a Gaussian process that has no std_dev.
struct GreyBoxWithGp : GreyBox {
  using GreyBox::GreyBox;
};

/// A grey box with a bank over its second input.
struct GreyBoxWithBanks : GreyBox {
  using GreyBox::GreyBox;
};

/// The example of a grey box, with a residual of its two inputs and two slips.
inline GreyBox::Parameters grey_box_with(decltype(GreyBoxResidual::model) residual) {
  GreyBox::Parameters parameters = example<GreyBox>().parameters();
  parameters.residual = {.model = std::move(residual),
                         .bound = 1.5,
                         .lowest = {-0.1, -0.4, -1.0, -1.0},
                         .highest = {0.1, 0.4, 1.0, 1.0}};
  return parameters;
}

template <>
inline GreyBoxWithBanks example<GreyBoxWithBanks>() {
  GreyBox::Parameters parameters = example<GreyBox>().parameters();
  parameters.terms.banks = {{.input = 1,
                             .is_integrated = true,
                             .thresholds = {0.001, 0.01},
                             .force_knots = {-0.1, 0.1},
                             .curve_knots = {-0.4, 0.0, 0.4},
                             .product_knots = {-0.1, 0.1},
                             .product_input = 0,
                             .time_constants_s = {0.001}}};
  Matrix& values = parameters.coefficients.values;
  for (const double value : {-0.5, -0.9, -1.5, -0.7, 0.4, 1.0, -1.0, 2.0})
    values.values.push_back(value);
  values.columns = parameters.terms.columns();
  return GreyBoxWithBanks(parameters);
}

template <>
inline GreyBoxWithMlp example<GreyBoxWithMlp>() {
  return GreyBoxWithMlp(grey_box_with(random_network<Mlp>({.inputs = 4, .hidden = {5}}, 11)));
}

/// All but one slip are used.
template <>
inline GreyBoxWithProducts example<GreyBoxWithProducts>() {
  InputProducts::Parameters products{.degree = 3,
                                     .centres = {0.01, -0.1, 0.2, 0.0},
                                     .scales = {0.05, 0.3, 0.0, 0.6},
                                     .coefficients = {}};
  for (std::size_t i = 0; i < InputProducts::count(3, products.degree); ++i)
    products.coefficients.push_back(0.4 * std::sin(1.7 * static_cast<double>(i + 1)));
  return GreyBoxWithProducts(grey_box_with(std::move(products)));
}

template <>
inline GreyBoxWithGp example<GreyBoxWithGp>() {
  ParametricGp::Parameters process = example<ParametricGp>().parameters();
  constexpr std::size_t kInputs = 4;
  process.kernel = parse_kernel("se_ard", kInputs);
  process.kernel.nodes.front().length_scales = {0.9, 1.2, 0.7, 1.5};
  process.scaling.inputs = {.centre = {0.0, 0.1, -0.2, 0.0}, .scale = {0.06, 0.3, 0.5, 0.6}};
  const std::size_t points = process.inducing_points.rows;
  process.inducing_points = Matrix(points, kInputs);
  for (std::size_t i = 0; i < process.inducing_points.values.size(); ++i)
    process.inducing_points.values[i] = std::sin(2.3 * static_cast<double>(i));
  process.explained = {};
  return GreyBoxWithGp(grey_box_with(std::move(process)));
}

template <>
inline GreyBoxWithDgmm example<GreyBoxWithDgmm>() {
  constexpr std::size_t kDimension = 5;
  constexpr std::size_t kComponents = 3;
  GaussianMixture mixture{.centre = {0.2, 0.0, 0.0, 0.0, 0.0},
                          .scale = {1.0, 0.07, 0.3, 0.5, 0.5},
                          .weights = {0.5, 0.3, 0.2},
                          .means = Matrix(kComponents, kDimension),
                          .covariances = Matrix(kComponents, kDimension * kDimension)};
  for (std::size_t i = 0; i < kComponents; ++i) {
    for (std::size_t j = 0; j < kDimension; ++j) {
      mixture.means(i, j) = 0.7 * (static_cast<double>(i) - 1.0);
      mixture.covariances(i, j * kDimension + j) = 0.3;
    }
  }
  return GreyBoxWithDgmm(grey_box_with(Dgmm::Parameters{
      .mixture = std::move(mixture), .clamp = {.slope = {0.0, 0.0, 0.0, 0.0}, .width = 0.5}}));
}

}  // namespace torsio::test

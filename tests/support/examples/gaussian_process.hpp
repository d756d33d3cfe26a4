#pragma once

#include <cmath>
#include <cstddef>

#include "model/gaussian_process/gaussian_process.hpp"
#include "model/gaussian_process/parametric_gp.hpp"
#include "support/examples/example.hpp"
#include "torsio/core/matrix.hpp"

namespace torsio::test {

/// Nine points on a spiral; further inputs stay at 0.
inline Matrix example_points(std::size_t inputs) {
  Matrix points(9, inputs);
  for (std::size_t i = 0; i < points.rows; ++i) {
    const double t = 0.7 * static_cast<double>(i);
    points(i, 0) = 0.25 * t * std::cos(t);
    points(i, 1) = 0.25 * t * std::sin(t);
  }
  return points;
}

inline NetworkScaling example_scaling(std::size_t inputs) {
  NetworkScaling scaling{.inputs = {.centre = {0.01, 0.0}, .scale = {0.07, 0.3}},
                         .target_centre = 0.5,
                         .target_scale = 40.0};
  scaling.inputs.centre.resize(inputs, 0.0);
  scaling.inputs.scale.resize(inputs, 40.0);
  return scaling;
}

inline GaussianProcess::Parameters example_gaussian_process(std::size_t inputs) {
  return {.scaling = example_scaling(inputs),
          .kernel = parse_kernel("se_ard+linear", inputs),
          .noise_variance = 0.01,
          .points = example_points(inputs),
          .weights = {0.4, -0.2, 0.3, 0.1, -0.5, 0.2, 0.6, -0.1, 0.05},
          .with_std_dev = true};
}
template <>
inline GaussianProcess example<GaussianProcess>() {
  return GaussianProcess(example_gaussian_process(2));
}

inline ParametricGp::Parameters example_parametric_gp(std::size_t inputs) {
  ParametricGp::Parameters parameters{.scaling = example_scaling(inputs),
                                      .kernel = parse_kernel("se*(linear+periodic*rq)", inputs),
                                      .noise_variance = 0.01,
                                      .inducing_points = example_points(inputs),
                                      .weights = {0.4, -0.2, 0.3, 0.1, -0.5, 0.2, 0.6, -0.1, 0.05},
                                      .explained = Matrix(9, 9)};
  for (std::size_t i = 0; i < 9; ++i) parameters.explained(i, i) = 0.1;
  return parameters;
}
template <>
inline ParametricGp example<ParametricGp>() {
  return ParametricGp(example_parametric_gp(2));
}

}  // namespace torsio::test

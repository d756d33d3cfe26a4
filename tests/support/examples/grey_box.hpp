#pragma once

#include "model/grey_box/grey_box.hpp"
#include "support/examples/example.hpp"
#include "torsio/core/matrix.hpp"

namespace torsio::test {

/// A stiffening curve, two slip elements under load, a branch, and friction of the rate.
template <>
inline GreyBox example<GreyBox>() {
  GreyBox::Parameters parameters;
  parameters.terms = {.curve_knots = {-0.12, 0.0, 0.12},
                      .thresholds = {0.002, 0.02},
                      .friction_knots = {-0.12, 0.12},
                      .time_constants_s = {0.05},
                      .rate_scales = {0.0, 0.05},
                      .sample_period_s = 0.001};
  parameters.coefficients.values = Matrix(1, parameters.terms.columns());
  parameters.coefficients.values.values = {-70.0, 0.5,  80.0, 1.0,  1.5, 2.0,
                                           1.0,   30.0, 0.0,  0.25, 0.0, 1.2};
  return GreyBox(parameters);
}

}  // namespace torsio::test

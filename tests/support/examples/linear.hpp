#pragma once

#include "model/linear/linear.hpp"
#include "model/linear/linear_coulomb.hpp"
#include "model/linear/polynomial.hpp"
#include "support/examples/example.hpp"
#include "torsio/core/matrix.hpp"

namespace torsio::test {

template <>
inline Linear example<Linear>() {
  Linear::Parameters parameters;
  parameters.coefficients.values = Matrix(1, 3);
  parameters.coefficients.values.values = {0.5, 600.0, 0.25};
  return Linear(parameters);
}

/// Its coefficients are scheduled over the second input.
template <>
inline LinearCoulomb example<LinearCoulomb>() {
  LinearCoulomb::Parameters parameters;
  parameters.rate_feature = 1;
  parameters.rate_scale = 0.05;
  parameters.coefficients = {.scheduled = true, .feature = 1, .knots = {-0.2, 0.0, 0.3}};
  parameters.coefficients.values = Matrix(3, 4);
  parameters.coefficients.values.values = {0.5, 600.0, 0.0, 1.5,  //
                                           0.4, 620.0, 0.0, 1.2,  //
                                           0.3, 700.0, 0.0, 1.4};
  return LinearCoulomb(parameters);
}

/// One curve for each direction.
template <>
inline Polynomial example<Polynomial>() {
  Polynomial::Parameters parameters;
  parameters.degree = 3;
  parameters.by_direction = true;
  parameters.dead_band = 0.002;
  parameters.half_range = 0.1;
  parameters.coefficients.values = Matrix(1, 10);
  parameters.coefficients.values.values = {1.2,  50.0, -1.0, 12.0,  //
                                           -1.1, 52.0, 0.5,  10.0,  //
                                           0.0,  0.4};
  return Polynomial(parameters);
}

}  // namespace torsio::test

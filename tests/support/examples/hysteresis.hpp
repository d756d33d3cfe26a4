#pragma once

#include <vector>

#include "model/hysteresis/bouc_wen_model.hpp"
#include "model/hysteresis/exponential_loading.hpp"
#include "model/hysteresis/improved_prandtl_ishlinskii.hpp"
#include "model/hysteresis/nonlinear_backlash.hpp"
#include "model/hysteresis/operator_sum.hpp"
#include "support/examples/example.hpp"
#include "torsio/core/matrix.hpp"

namespace torsio::test {

// All about 600 Nm/rad and +-6 Nm wide.

template <>
inline MaxwellSlipModel example<MaxwellSlipModel>() {
  MaxwellSlipModel::Parameters parameters;
  parameters.thresholds = {0.001, 0.004, 0.01, 0.04, 0.09};
  parameters.coefficients.values = Matrix(1, 8);
  parameters.coefficients.values.values = {0.5, 550.0, 0.25, 900.0, 400.0, 150.0, 0.0, 30.0};
  return MaxwellSlipModel(parameters);
}

/// The same in play operators: k_0 includes the stops' stiffness, the weights change sign.
template <>
inline PrandtlIshlinskii example<PrandtlIshlinskii>() {
  PrandtlIshlinskii::Parameters parameters;
  parameters.thresholds = {0.001, 0.004, 0.01, 0.04, 0.09};
  parameters.coefficients.values = Matrix(1, 8);
  parameters.coefficients.values.values = {0.5, 2030.0, 0.25, -900.0, -400.0, -150.0, 0.0, -30.0};
  return PrandtlIshlinskii(parameters);
}

template <>
inline ImprovedPrandtlIshlinskii example<ImprovedPrandtlIshlinskii>() {
  return ImprovedPrandtlIshlinskii({.bias = 0.5,
                                    .slopes = {1500.0, 0.25},
                                    .weights = {-600.0, -300.0, -30.0},
                                    .thresholds = {0.002, 0.01, 0.05},
                                    .knots = {-40.0, -10.0, 15.0},
                                    .bends = {0.3, -0.2, 0.4},
                                    .rate_gain = 0.5,
                                    .rate_feature = 1});
}

template <>
inline BoucWenModel example<BoucWenModel>() {
  return BoucWenModel({.stiffness = 1200.0,
                       .elastic_share = 0.5,
                       .beta = 3000.0,
                       .gamma = 1000.0,
                       .exponent = 1.6,
                       .bias = 0.5,
                       .slopes = {0.0, 0.25},
                       .half_range = 0.11});
}

inline Envelope example_envelope() {
  return {.middle = {0.5, 55.0, 1.0, 6.0}, .half_width = {4.0, 0.5, 1.0}, .half_range = 0.11};
}

template <>
inline NonlinearBacklash example<NonlinearBacklash>() {
  return NonlinearBacklash(
      {.stiffness = 3000.0, .boundaries = example_envelope(), .slopes = {0.0, 0.25}});
}

template <>
inline ImprovedNonlinearBacklash example<ImprovedNonlinearBacklash>() {
  return ImprovedNonlinearBacklash({.stiffness = 3000.0,
                                    .boundaries = example_envelope(),
                                    .slopes = {0.0, 0.25},
                                    .rate = {.gain = 0.1, .exponent = 0.6, .feature = 1}});
}

template <>
inline ExponentialLoading example<ExponentialLoading>() {
  return ExponentialLoading({.curves = example_envelope(),
                             .rising_decay = 60.0,
                             .falling_decay = 90.0,
                             .slopes = {0.0, 0.25}});
}

}  // namespace torsio::test

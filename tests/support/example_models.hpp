#pragma once

#include <cmath>
#include <cstddef>
#include <type_traits>
#include <utility>
#include <vector>

#include "model/gaussian_process/gaussian_process.hpp"
#include "model/gaussian_process/parametric_gp.hpp"
#include "model/grey_box/grey_box.hpp"
#include "model/hammerstein_wiener/hammerstein_wiener.hpp"
#include "model/linear/linear.hpp"
#include "model/linear/linear_coulomb.hpp"
#include "model/linear/polynomial.hpp"
#include "model/mixture/dgmm.hpp"
#include "model/narx/multivariate_polynomial.hpp"
#include "model/narx/narx.hpp"
#include "model/network/ensemble.hpp"
#include "model/network/gru.hpp"
#include "model/network/lstm.hpp"
#include "model/network/mlp.hpp"
#include "model/second_order/dynamic_bouc_wen.hpp"
#include "model/second_order/rigid_drive.hpp"
#include "model/viscoelastic/viscoelastic.hpp"
#include "support/hysteresis_examples.hpp"
#include "support/random_network.hpp"
#include "torsio/core/matrix.hpp"
#include "torsio/model/any_model.hpp"

namespace torsio::test {

/// A small model of each family, of two inputs (a deflection of +-0.1 rad and its rate, as
/// `example_features` makes them). A new family specialises this once, for the laws and for every
/// test that needs "some model".
template <class Family>
Family example() {
  static_assert(std::is_void_v<Family>,
                "tests/support/example_models.hpp has no example() of this family of AllFamilies");
  throw;
}

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

template <>
inline MaxwellSlipModel example<MaxwellSlipModel>() {
  return example_maxwell_slip();
}

template <>
inline PrandtlIshlinskii example<PrandtlIshlinskii>() {
  return example_prandtl_ishlinskii();
}

template <>
inline ImprovedPrandtlIshlinskii example<ImprovedPrandtlIshlinskii>() {
  return example_improved_prandtl_ishlinskii();
}

template <>
inline BoucWenModel example<BoucWenModel>() {
  return example_bouc_wen();
}

template <>
inline NonlinearBacklash example<NonlinearBacklash>() {
  return example_nonlinear_backlash();
}

template <>
inline ImprovedNonlinearBacklash example<ImprovedNonlinearBacklash>() {
  return example_improved_nonlinear_backlash();
}

template <>
inline ExponentialLoading example<ExponentialLoading>() {
  return example_exponential_loading();
}

/// Relaxes within 50 ms and 3 s.
template <>
inline Viscoelastic example<Viscoelastic>() {
  return Viscoelastic({.network = parse_network("series(kv(k1=900, d1=60), kv(k2=4000, d2=2000), "
                                                "parallel(k3=2500, maxwell(k4=300, d4=15)))"),
                       .offset = 0.5,
                       .sample_period_s = 1e-3,
                       .inputs = 2});
}

/// A row of five Gaussians along 600 Nm/rad, and one behind them all.
template <>
inline Dgmm example<Dgmm>() {
  constexpr std::size_t kComponents = 6;
  Dgmm::Parameters parameters;
  GaussianMixture& mixture = parameters.mixture;
  mixture = {.centre = {0.5, 0.0, 0.0},
             .scale = {40.0, 0.07, 0.3},
             .weights = {0.25, 0.2, 0.15, 0.2, 0.199, 0.001},
             .means = Matrix(kComponents, 3),
             .covariances = Matrix(kComponents, 9)};
  for (std::size_t i = 0; i < kComponents; ++i) {
    const bool is_background = i + 1 == kComponents;
    const double at = is_background ? 0.0 : 0.7 * (static_cast<double>(i) - 2.0);
    const double spread = is_background ? 1.0 : 0.2;
    mixture.means.values[i * 3] = at;
    mixture.means.values[i * 3 + 1] = at;
    mixture.covariances.values[i * 9] = 1.01 * spread;
    mixture.covariances.values[i * 9 + 1] = spread;
    mixture.covariances.values[i * 9 + 3] = spread;
    mixture.covariances.values[i * 9 + 4] = 1.01 * spread;
    mixture.covariances.values[i * 9 + 8] = 1.0;
  }
  parameters.clamp = {.intercept = 0.5,
                      .slope = {570.0, 0.25},
                      .width = 3.0,
                      .thin_log_density = -5.0,
                      .thin_log_density_inverse = -5.0};
  return Dgmm(parameters);
}

/// Two sections; of the two inputs it uses the first.
template <>
inline HammersteinWiener example<HammersteinWiener>() {
  HammersteinWiener::Parameters parameters = hammerstein_wiener_of(Paper003::discrete, 2);
  parameters.sample_period_s = 1e-3;
  parameters.rest_input = 0.01;
  parameters.input = {.knots = {-0.1, 0.0, 0.1}, .values = {-1.2, 0.0, 1.0}};
  parameters.sections = sections_of({{1.0, -0.7, 0.2, 0.1}, {1.0, -1.5, 0.8, -0.2}});
  parameters.output = {.knots = {}, .values = {0.2, 20.0, 0.4, 0.1}};
  parameters.lowest = -8.0;
  parameters.highest = 8.0;
  return HammersteinWiener(parameters);
}

template <>
inline Mlp example<Mlp>() {
  return Mlp(random_network<Mlp>({.hidden = {7, 5}, .activation = Activation::tanh}, 4));
}

template <>
inline Lstm example<Lstm>() {
  return Lstm(random_network<Lstm>({.units = {5, 3}, .hidden = {4}, .warm_up_samples = 3}, 5));
}

template <>
inline Gru example<Gru>() {
  return Gru(random_network<Gru>({.units = {5, 3}, .hidden = {4}, .warm_up_samples = 3}, 6));
}

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

/// Members of different weights.
template <class Member>
Ensemble<Member> example_ensemble() {
  typename Ensemble<Member>::Parameters parameters;
  parameters.residual_std = 0.7;
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    NetworkShape shape{.hidden = {4}};
    if constexpr (requires(typename Member::Parameters of) { of.warm_up_samples; })
      shape.units = {3}, shape.warm_up_samples = 3;
    parameters.members.push_back(random_network<Member>(shape, seed));
  }
  return Ensemble<Member>(parameters);
}
template <>
inline MlpEnsemble example<MlpEnsemble>() {
  return example_ensemble<Mlp>();
}
template <>
inline LstmEnsemble example<LstmEnsemble>() {
  return example_ensemble<Lstm>();
}
template <>
inline GruEnsemble example<GruEnsemble>() {
  return example_ensemble<Gru>();
}

/// A model of two inputs that feeds back f's parameters, given those of f.
template <class M>
Narx<M> example_narx(typename M::Parameters f, std::size_t input_lags, std::size_t output_lags) {
  return Narx<M>({.model = std::move(f),
                  .inputs = 2,
                  .input_lags = input_lags,
                  .output_lags = output_lags,
                  .sample_period_s = 1e-3,
                  .lowest = -5000.0,
                  .highest = 5000.0,
                  .start = 1.0});
}
/// y = 0.5 + 200 u + 0.25 v + 100 u' + 0.1 v' + 0.6 y' - 0.1 y''
template <>
inline Narx<Linear> example<Narx<Linear>>() {
  Linear::Parameters f;
  f.coefficients.values = Matrix(1, 7);
  f.coefficients.values.values = {0.5, 200.0, 0.25, 100.0, 0.1, 0.6, -0.1};
  return example_narx<Linear>(f, 1, 2);
}
/// y = 0.5 + 200 u + 100 u' + 0.6 y' - 0.0002 y'' v^2
template <>
inline Narx<MultivariatePolynomial> example<Narx<MultivariatePolynomial>>() {
  MultivariatePolynomial::Parameters f{.scales = {1.0, 5.0, 1.0, 1.0, 100.0, 2.0},
                                       .powers = Matrix(5, 6),
                                       .coefficients = {0.5, 200.0, 100.0, 60.0, -0.01}};
  f.powers(1, 0) = 1.0;
  f.powers(2, 2) = 1.0;
  f.powers(3, 4) = 1.0;
  f.powers(4, 5) = 1.0;
  f.powers(4, 1) = 2.0;
  return example_narx<MultivariatePolynomial>(f, 1, 2);
}
template <>
inline Narx<Mlp> example<Narx<Mlp>>() {
  return example_narx<Mlp>(
      random_network<Mlp>({.inputs = 5, .hidden = {6}, .activation = Activation::tanh}, 8), 1, 1);
}
template <>
inline Narx<GaussianProcess> example<Narx<GaussianProcess>>() {
  return example_narx<GaussianProcess>(example_gaussian_process(3), 0, 1);
}
template <>
inline Narx<ParametricGp> example<Narx<ParametricGp>>() {
  return example_narx<ParametricGp>(example_parametric_gp(3), 0, 1);
}
/// The mixture of two inputs and the target, its third dimension a past output.
template <>
inline Narx<Dgmm> example<Narx<Dgmm>>() {
  auto f = example<Dgmm>().parameters();
  constexpr std::size_t kOld = 3;
  constexpr std::size_t kNew = 4;
  const std::size_t components = f.mixture.means.rows;
  Matrix means(components, kNew);
  Matrix covariances(components, kNew * kNew);
  for (std::size_t i = 0; i < components; ++i) {
    for (std::size_t a = 0; a < kOld; ++a) {
      means(i, a) = f.mixture.means(i, a);
      for (std::size_t b = 0; b < kOld; ++b)
        covariances(i, a * kNew + b) = f.mixture.covariances(i, a * kOld + b);
    }
    covariances(i, kNew * kNew - 1) = 1.0;
  }
  f.mixture.means = means;
  f.mixture.covariances = covariances;
  f.mixture.centre.push_back(0.0);
  f.mixture.scale.push_back(100.0);
  f.clamp.slope.push_back(0.0);
  return example_narx<Dgmm>(f, 0, 1);
}

/// Light enough to follow its inputs.
template <>
inline DynamicBoucWen example<DynamicBoucWen>() {
  return DynamicBoucWen({.mass = 1e-6,
                         .damping = 1e-3,
                         .stiffness = 1.0,
                         .hysteretic_stiffness = 0.5,
                         .loss = 2.0,
                         .skew = -1.0,
                         .exponent = 1.5,
                         .gains = {1.0, 0.2},
                         .time = {.sample_period_s = 1e-3},
                         .lowest = -5000.0,
                         .highest = 5000.0});
}

/// With every term.
template <>
inline RigidDrive example<RigidDrive>() {
  return RigidDrive({.inertia = 0.01,
                     .viscous = 0.02,
                     .coulomb = 0.05,
                     .offset = 0.01,
                     .static_ratio = 1.5,
                     .stribeck_speed = 0.1,
                     .bristle = 1e-3,
                     .viscous_asymmetry = 0.01,
                     .viscous_quadratic = 0.01,
                     .spring = 0.02,
                     .coulomb_slope = 0.1,
                     .gains = {1.0, 0.2},
                     .time = {.sample_period_s = 1e-3},
                     .lowest = -5000.0,
                     .highest = 5000.0});
}

template <>
inline AnyModel example<AnyModel>() {
  return example<Polynomial>();
}

/// Features for `inputs` inputs: slow oscillations with reversals, the first +-0.1, the second
/// +-0.4, all of them finite and the same at every call.
inline Matrix example_features(std::size_t samples, std::size_t inputs) {
  Matrix features(samples, inputs);
  for (std::size_t n = 0; n < samples; ++n) {
    const double phase = 0.04 * static_cast<double>(n);
    for (std::size_t j = 0; j < inputs; ++j) {
      const auto order = static_cast<double>(j);
      features(n, j) = (0.1 + 0.3 * order) * std::sin(phase * (1.0 + 0.37 * order) + 1.3 * order);
    }
  }
  return features;
}

}  // namespace torsio::test

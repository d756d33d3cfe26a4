#pragma once

#include <cstddef>
#include <utility>

#include "model/narx/multivariate_polynomial.hpp"
#include "model/narx/narx.hpp"
#include "support/examples/example.hpp"
#include "support/examples/gaussian_process.hpp"
#include "support/examples/linear.hpp"
#include "support/examples/mixture.hpp"
#include "support/examples/network.hpp"
#include "torsio/core/matrix.hpp"

namespace torsio::test {

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
inline Narx<Lstm> example<Narx<Lstm>>() {
  return example_narx<Lstm>(
      random_network<Lstm>({.inputs = 5, .units = {4}, .hidden = {}, .warm_up_samples = 3}, 9), 1,
      1);
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

}  // namespace torsio::test

#pragma once

#include <cstdint>

#include "model/network/ensemble.hpp"
#include "model/network/gru.hpp"
#include "model/network/lstm.hpp"
#include "model/network/mlp.hpp"
#include "support/examples/example.hpp"
#include "support/random_network.hpp"

namespace torsio::test {

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

}  // namespace torsio::test

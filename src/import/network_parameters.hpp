#pragma once

#include <cstddef>

#include "torsio/import/import_network.hpp"
#include "torsio/model/any_model.hpp"

namespace torsio {

/// The network as parameters of `mlp`, `lstm` or `gru`. Scales and offsets before the first layer
/// and after the last become its standardisation where they are positive; others, and linear layers
/// in front of a recurrent one, are multiplied into the next layer.
/// @throws Error for a network that torsio cannot represent: more than one output, an activation in
/// front of a recurrent layer, LSTM and GRU in one, weights beyond float32.
[[nodiscard]] AnyModel::Parameters network_parameters(const ForeignNetwork& network,
                                                      double sample_period_s,
                                                      std::size_t warm_up_samples);

}  // namespace torsio

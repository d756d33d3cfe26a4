#pragma once

#include <cstddef>

#include "torsio/core/random.hpp"
#include "torsio/model/network/network_layers.hpp"

namespace torsio {

/// Weights to start from. Before relu and elu normal with variance 2 / inputs (He et al. 2015),
/// else uniform within sqrt(6 / (inputs + outputs)) (Glorot and Bengio 2010); each gate's recurrent
/// weights orthogonal (Saxe et al. 2014); biases 0, in the forget gate 1 (Jozefowicz et al. 2015).
[[nodiscard]] DenseLayer initial_dense(std::size_t inputs, std::size_t units, Activation activation,
                                       Random& random);
[[nodiscard]] LstmLayer initial_lstm(std::size_t inputs, std::size_t units, Random& random);
[[nodiscard]] GruLayer initial_gru(std::size_t inputs, std::size_t units, Random& random);

}  // namespace torsio

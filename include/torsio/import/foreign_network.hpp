#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "torsio/core/matrix.hpp"
#include "torsio/model/network/network_layers.hpp"

namespace torsio {

/// A larger file of another program is refused: its network in memory is many times larger than
/// the file.
inline constexpr std::size_t kMaxForeignBytes = std::size_t{64} << 20;

/// The stages of another program's network in their order, in double so that stages may be
/// multiplied into each other without loss.
/// y_j = gain_j x_j + offset_j
struct AffineStage {
  std::vector<double> gain;
  std::vector<double> offset;
};
/// y = W x + b
struct DenseStage {
  Matrix weights;  ///< outputs x inputs
  std::vector<double> bias;
};
/// y = f(x)
struct ActivationStage {
  Activation function = Activation::linear;
};
/// A recurrent layer with the gates in torsio's order (`LstmLayer`, `GruLayer`).
struct RecurrentStage {
  enum class Kind { lstm, gru };
  Kind kind = Kind::lstm;
  Matrix input_weights;
  Matrix recurrent_weights;
  std::vector<double> input_bias;
  std::vector<double> recurrent_bias;
};
using ForeignStage = std::variant<AffineStage, DenseStage, ActivationStage, RecurrentStage>;

/// A network as another program wrote it.
struct ForeignNetwork {
  std::string place;       ///< the file's name, for messages
  std::size_t inputs = 0;  ///< inputs of the first stage
  std::vector<ForeignStage> stages = {};
  /// Window length of a graph with memory that starts from the zero state; none: any length.
  std::optional<std::size_t> window = {};
  std::vector<std::string> notes = {};
  bool fold_biases = false;  ///< an LSTM's two biases into one
};

}  // namespace torsio

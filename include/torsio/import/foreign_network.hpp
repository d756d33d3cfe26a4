#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <string_view>
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

/// Reads the weights of a PyTorch network by tensor name, from untrusted JSON:
///
///     {"tensors": {"lstm.weight_ih_l0": {"shape": [32, 2], "data": [...]}, ...}}
///
/// `<p>weight_ih_l<k>`, `weight_hh_l<k>`, `bias_ih_l<k>`, `bias_hh_l<k>` are the recurrent layers
/// (4 H rows: LSTM, 3 H: GRU), `<p>weight` and `<p>bias` the dense ones after them, in the order of
/// their names ("2." before "10."); `in_scale` multiplies the inputs, `out_scale` the output. Data
/// are row by row.
/// @param activation activation of all dense layers but the last, which the names do not contain.
/// @throws Error naming the tensor: not this format, an unknown name, a shape that does not
/// fit, a number that is not finite; also if there are hidden dense layers and no `activation`.
[[nodiscard]] ForeignNetwork parse_weights_json(std::span<const std::byte> bytes,
                                                std::string_view place,
                                                std::optional<Activation> activation = {});

}  // namespace torsio

#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/aligned_vector.hpp"
#include "numerics/float_gemm.hpp"
#include "torsio/model/network/network_layers.hpp"

namespace torsio {

/// One layer of a network that is being trained.
struct TrainingLayer {
  enum class Kind : std::uint8_t { dense, lstm, gru };
  Kind kind = Kind::dense;
  std::size_t inputs = 0;
  std::size_t units = 0;
  Activation activation = Activation::linear;  ///< in a dense layer

  /// Units with padding: a multiple of 16. The padding has weight 0, and its gradient is 0.
  [[nodiscard]] std::size_t width() const noexcept { return float_gemm::in_panels(units); }
  [[nodiscard]] bool has_state() const noexcept { return kind != Kind::dense; }
};

/// A table in the flat list of all parameters; `columns` is its row stride too.
struct ParameterBlock {
  std::size_t offset = 0;
  std::size_t rows = 0;
  std::size_t columns = 0;
  bool begins_with_bias = true;  ///< row 0, which weight decay leaves alone
};

/// The layers of a network, and the positions of their parameters in one flat list. With rows [1,
/// x, h-] as the inputs of a layer, its weights are stored transposed:
///
///     dense  P [(1 + inputs) x width]                a = [1, x] P
///     lstm   P [(1 + inputs + units) x 4 width]      a = [1, x, h-] P, gates i f g o
///     gru    P [(1 + inputs) x 3 width]              gates n r z of [1, x]
///            R [units x 3 width], b [1 x width]      gates r z m of h-, and the bias of m
class TrainingNetwork {
 public:
  explicit TrainingNetwork(std::vector<TrainingLayer> layers);

  [[nodiscard]] const std::vector<TrainingLayer>& layers() const noexcept { return layers_; }
  [[nodiscard]] std::size_t inputs() const noexcept { return layers_.front().inputs; }
  [[nodiscard]] std::size_t parameter_count() const noexcept { return parameter_count_; }
  [[nodiscard]] const std::vector<ParameterBlock>& blocks() const noexcept { return blocks_; }
  /// The first block of a layer.
  [[nodiscard]] const ParameterBlock& block(std::size_t layer, std::size_t which = 0) const {
    return blocks_[first_blocks_[layer] + which];
  }
  /// Memory of one pass over that many steps and rows.
  [[nodiscard]] std::size_t pass_bytes(std::size_t steps, std::size_t rows) const noexcept;

 private:
  std::vector<TrainingLayer> layers_;
  std::vector<ParameterBlock> blocks_;
  std::vector<std::size_t> first_blocks_;
  std::size_t parameter_count_ = 0;
};

/// Layers as model files have them <-> the flat list.
void put_layer(const DenseLayer& layer, const TrainingNetwork& network, std::size_t index,
               float* parameters);
void put_layer(const LstmLayer& layer, const TrainingNetwork& network, std::size_t index,
               float* parameters);
/// Both biases of the gates r and z are one parameter here.
void put_layer(const GruLayer& layer, const TrainingNetwork& network, std::size_t index,
               float* parameters);
[[nodiscard]] DenseLayer dense_layer(const TrainingNetwork& network, std::size_t index,
                                     const float* parameters);
[[nodiscard]] LstmLayer lstm_layer(const TrainingNetwork& network, std::size_t index,
                                   const float* parameters);
[[nodiscard]] GruLayer gru_layer(const TrainingNetwork& network, std::size_t index,
                                 const float* parameters);

}  // namespace torsio

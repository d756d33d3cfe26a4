#pragma once

#include <cstddef>
#include <vector>

#include "core/aligned_vector.hpp"
#include "fit/network/training_network.hpp"
#include "numerics/float_gemm.hpp"

namespace torsio {

/// Parallel windows, step by step: [steps x rows], with the network's inputs and targets.
struct SequenceBatch {
  std::size_t steps = 0;
  std::size_t rows = 0;
  detail::AlignedVector<float> inputs;   ///< [steps x rows x inputs]
  detail::AlignedVector<float> targets;  ///< [steps x rows]
  detail::AlignedVector<float> weights;  ///< [steps x rows]: 1 counts in the loss, 0 does not
};

/// The weights in the order in which products read them: made anew after each update.
class PackedNetwork {
 public:
  void pack(const TrainingNetwork& network, const float* parameters);

  struct Layer {
    float_gemm::PackedMatrix forward;        ///< acts on [1, x], for an LSTM also on h-
    float_gemm::PackedMatrix forward_state;  ///< acts on h-, GRU only
    float_gemm::PackedMatrix to_state;       ///< slopes of the gates -> slope of h-
    float_gemm::PackedMatrix to_inputs;      ///< slopes of the gates -> slope of x
    const float* state_bias = nullptr;       ///< GRU only; points into the parameters
  };
  [[nodiscard]] const Layer& layer(std::size_t index) const { return layers_[index]; }

 private:
  std::vector<Layer> layers_;
};

/// One batch through a network and back, in memory of its own that serves again for the next one.
/// The network starts at the zero state; gradients go back through all steps.
class NetworkPass {
 public:
  /// The batch's `inputs` through all layers.
  void forward(const TrainingNetwork& network, const PackedNetwork& packed,
               const SequenceBatch& batch);
  /// After `forward`: the network's output at a step of a row.
  [[nodiscard]] float output(std::size_t step, std::size_t row) const;
  /// After `forward`: sum of weight (output - target)^2.
  [[nodiscard]] double square_error(const SequenceBatch& batch) const;
  /// After `forward`: gradient += scale * d/dparameters of half that sum. Uses what `forward` left
  /// up.
  void backward(const TrainingNetwork& network, const PackedNetwork& packed,
                const SequenceBatch& batch, float scale, float* gradient);

 private:
  struct LayerMemory {
    std::size_t stride = 0;               ///< stride of `rows`
    detail::AlignedVector<float> rows;    ///< [(steps + 1) x rows]: 1, x, h- with padding
    detail::AlignedVector<float> values;  ///< dense: outputs; else gates, later their slopes
    detail::AlignedVector<float> cells;   ///< LSTM: [(steps + 1) x rows x width]
    detail::AlignedVector<float> slopes;  ///< slopes at the outputs [steps x rows x width]
  };
  struct Outputs {
    const float* values;
    std::size_t stride;
  };

  void prepare(const TrainingNetwork& network, std::size_t steps, std::size_t rows);
  [[nodiscard]] Outputs outputs(const TrainingLayer& layer, const LayerMemory& memory) const;
  void forward_lstm(const TrainingLayer& layer, const PackedNetwork::Layer& packed,
                    LayerMemory& memory) const;
  void forward_gru(const TrainingLayer& layer, const PackedNetwork::Layer& packed,
                   LayerMemory& memory) const;
  void backward_lstm(const TrainingLayer& layer, const PackedNetwork::Layer& packed,
                     LayerMemory& memory);
  void backward_gru(const TrainingLayer& layer, const PackedNetwork::Layer& packed,
                    LayerMemory& memory) const;
  void add_gradient(const TrainingNetwork& network, std::size_t index, float* gradient);

  std::size_t steps_ = 0;
  std::size_t rows_ = 0;
  std::vector<LayerMemory> layers_;
  detail::AlignedVector<float> cell_slopes_;
  float_gemm::Scratch scratch_;
};

}  // namespace torsio

#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "torsio/core/matrix.hpp"
#include "torsio/core/progress.hpp"
#include "torsio/core/provenance.hpp"
#include "torsio/data/dataset.hpp"
#include "torsio/files/model_file.hpp"
#include "torsio/model/network/network_layers.hpp"
#include "torsio/signal/feature_pipeline.hpp"

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

/// Whether bytes are JSON, which begins with a brace; ONNX, a protobuf, begins with the number of a field.
[[nodiscard]] bool is_weights_json(std::span<const std::byte> bytes) noexcept;

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

/// Properties of a network that its file does not specify.
struct ImportOptions {
  FeatureSpec features;              ///< one expression per input of the network, in its order
  std::string target = "torque_Nm";  ///< channel that the network estimates
  double sample_rate_Hz = 0.0;       ///< sample rate of the training
  std::vector<double> input_scale;   ///< the network is given scale * input; empty: 1 each
  double output_scale = 1.0;         ///< target = scale * output of the network
  std::optional<std::size_t> warm_up_samples;  ///< until a value is valid; none: the graph's window
  bool fold_biases = false;  ///< an LSTM's two biases into one: faster, not PyTorch's rounding
};

/// A file of another program and where it came from.
struct ForeignFile {
  std::vector<std::byte> bytes;
  Source source;
};

/// @throws Error if the file cannot be read or is larger than `kMaxForeignBytes`; Cancelled.
[[nodiscard]] ForeignFile read_foreign_file(const std::string& path, const Progress& progress = {});

struct ImportedModel {
  ModelFile file;
  std::vector<std::string> notes;  ///< remarks for the user
};

/// A network of another program in torsio's estimator. Range guard, linear fallback and standard
/// deviation are computed from `guards` (all of its recordings, whatever their role). Without it
/// the guard is open, the fallback is 0 and there is no error bar, which a note states.
/// @throws Error if the network fits no family, or UsageError if the inputs are not as many as the
/// network has, or a scale is not a finite number other than 0.
[[nodiscard]] ImportedModel import_network(const ForeignNetwork& network, const Source& source,
                                           const ImportOptions& options,
                                           const Dataset* guards = nullptr);

}  // namespace torsio

#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "torsio/core/progress.hpp"
#include "torsio/core/provenance.hpp"
#include "torsio/data/dataset.hpp"
#include "torsio/files/model_file.hpp"
#include "torsio/import/foreign_network.hpp"
#include "torsio/signal/feature_pipeline.hpp"

namespace torsio {

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

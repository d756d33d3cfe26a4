#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "torsio/model/network_layers.hpp"

namespace torsio {

/// Checks at construction; each throws an Error at `place`, followed by the field: "lstm: layers.1",
/// "lstm: layers.1.recurrent_weights".

/// @return the number of inputs.
std::size_t checked_input_count(const NetworkScaling& scaling, const std::string& place);
void check_layer_count(std::size_t count, const std::string& place);
void check_layer(const DenseLayer& layer, std::size_t inputs, const std::string& place);
void check_layer(const LstmLayer& layer, std::size_t inputs, const std::string& place);
void check_layer(const GruLayer& layer, std::size_t inputs, const std::string& place);
/// One output, linear. @param place of the layer.
void check_last_layer(const DenseLayer& layer, const std::string& place);
void check_positive(double value, const std::string& place);

/// In double, then rounded. @param standardised one value for each of `features`.
inline void standardise(const NetworkScaling& scaling, std::span<const double> features,
                        float* standardised) noexcept {
  const auto& [centre, scale] = scaling.inputs;
  for (std::size_t j = 0; j < features.size(); ++j)
    standardised[j] = static_cast<float>((features[j] - centre[j]) / scale[j]);
}

inline double destandardise(const NetworkScaling& scaling, float output) noexcept {
  return scaling.target_centre + scaling.target_scale * static_cast<double>(output);
}

}  // namespace torsio

#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "torsio/core/matrix.hpp"
#include "torsio/model/network/network_layers.hpp"

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
void check_shape(const Matrix& matrix, std::size_t rows, std::size_t columns,
                 const std::string& place);
void check_length(const std::vector<double>& values, std::size_t length, const std::string& place);

/// In double, then rounded. @param standardised one value for each of `features`.
template <class Number>
void standardise(const NetworkScaling& scaling, std::span<const double> features,
                 Number* standardised) noexcept {
  const auto& [centre, scale] = scaling.inputs;
  for (std::size_t j = 0; j < features.size(); ++j)
    standardised[j] = static_cast<Number>((features[j] - centre[j]) / scale[j]);
}

template <class Number>
double destandardise(const NetworkScaling& scaling, Number output) noexcept {
  return scaling.target_centre + scaling.target_scale * static_cast<double>(output);
}

}  // namespace torsio

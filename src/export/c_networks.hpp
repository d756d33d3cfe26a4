#pragma once

#include <string>
#include <vector>

#include "export/c_text.hpp"
#include "torsio/model/network/network_layers.hpp"

namespace torsio {

/// Writes `float NAME_<name>(const float *in)`, dense layers of which the last has one output.
void write_dense(CText& c, const std::string& name, const std::vector<DenseLayer>& layers);

/// Statements that standardise `count` inputs from the expression `from`, an array of reals, to the array `to` of floats.
[[nodiscard]] std::string standardised(CText& c, const std::string& name,
                                       const NetworkScaling& scaling, const std::string& from,
                                       const std::string& to);
/// The target from the output of a network, a C expression.
[[nodiscard]] std::string destandardised(const CText& c, const NetworkScaling& scaling,
                                         const std::string& output);

/// Writes a recurrent layer as `void NAME_<name>(state, const float *in)`; its output is then `s-><name>_hidden`.
void write_recurrent(CText& c, const std::string& name, const LstmLayer& layer);
void write_recurrent(CText& c, const std::string& name, const GruLayer& layer);

}  // namespace torsio

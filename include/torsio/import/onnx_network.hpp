#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <string_view>

#include "torsio/import/import_network.hpp"

namespace torsio {

/// Reads a network from an untrusted ONNX graph (library `torsio::onnx`): Gemm, MatMul, LSTM and
/// GRU with Relu, Tanh, Softsign and Elu, scales and offsets, and the operators that PyTorch's and
/// Keras' exporters add to reorder axes. docs/models/import.md lists the operators and their
/// limits.
/// @param output name in the graph; empty: its first. Nodes of other outputs are ignored.
/// @throws Error that names the node or the tensor: no ONNX, another operator set than 7 to 21,
/// nodes that are not supported (all of them), external data, other types than float and double,
/// numbers that are not finite, shapes that do not fit; UsageError if there is no such output.
[[nodiscard]] ForeignNetwork parse_onnx(std::span<const std::byte> bytes, std::string_view place,
                                        const std::string& output = {});

}  // namespace torsio

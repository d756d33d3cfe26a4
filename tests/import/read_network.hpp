#pragma once

#include <string>

#include "torsio/core/error.hpp"
#include "torsio/import/import_network.hpp"
#ifdef TORSIO_HAS_ONNX
#include "torsio/import/onnx_network.hpp"
#endif

namespace torsio::test {

constexpr bool can_read_onnx() {
#ifdef TORSIO_HAS_ONNX
  return true;
#else
  return false;
#endif
}

/// @param activation of the dense layers of JSON weights.
inline ForeignNetwork read_network(const ForeignFile& file, const std::string& activation) {
#ifdef TORSIO_HAS_ONNX
  if (file.source.file.ends_with(".onnx")) return parse_onnx(file.bytes, file.source.file);
#endif
  return parse_weights_json(file.bytes, file.source.file, activation_of(activation));
}

}  // namespace torsio::test

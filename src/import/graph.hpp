#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "torsio/import/import_network.hpp"

namespace torsio::graph {

/// Numbers with a shape, row by row; whole ones are doubles too.
struct Tensor {
  std::vector<std::int64_t> shape;  ///< empty for a single number
  std::vector<double> values;       ///< as many as the product of `shape`
};

struct Attribute {
  std::vector<std::int64_t> integers = {};
  std::vector<double> numbers = {};
  std::vector<std::string> texts = {};
  std::optional<Tensor> tensor = {};
};

struct Node {
  std::string name;
  std::string op;  ///< "Gemm"; "domain::op" for operators that are not ONNX's own
  std::vector<std::string> inputs = {};  ///< an empty name: left out
  std::vector<std::string> outputs = {};
  std::map<std::string, Attribute> attributes = {};
};

/// A graph as ONNX describes one, nodes in an order in which they can be evaluated.
struct Graph {
  struct Input {
    std::string name;
    std::vector<std::optional<std::int64_t>> shape;  ///< none: any size
  };

  std::string place;  ///< the file's name, for messages
  std::int64_t opset = 0;
  std::vector<Node> nodes = {};
  std::map<std::string, Tensor> constants = {};
  std::vector<Input> inputs = {};  ///< without those that are constants
  std::vector<std::string> outputs = {};
};

/// The network that the graph computes from its first input to `output` (empty: the first one). Every
/// operation is followed axis by axis, so that what moves samples, channels or windows about in a
/// way that a network stepped sample by sample cannot is refused, not misread.
/// @throws Error that names the node, or lists all nodes with unknown operators.
[[nodiscard]] ForeignNetwork network_of(const Graph& graph, const std::string& output);

}  // namespace torsio::graph

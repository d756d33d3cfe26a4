#include <onnx/onnx_pb.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <span>
#include <sstream>
#include <string>
#include <string_view>
#include <vector>

#include "import/network_parameters.hpp"
#include "torsio/core/error.hpp"
#include "torsio/import/onnx_network.hpp"

// Any bytes are refused as an ONNX graph with an Error, or give a network that steps. The first
// byte selects how the others become a graph: as they are, as changes to the bytes of a good one,
// or as changes to its nodes, which random bytes seldom are.

namespace {

using Input = std::span<const std::uint8_t>;

const std::string& good_bytes(std::size_t which) {
  static const std::vector<std::string> files = [] {
    std::vector<std::string> names;
    for (const auto& entry : std::filesystem::directory_iterator(TORSIO_GOLDEN_IMPORT))
      if (entry.path().extension() == ".onnx") names.push_back(entry.path().string());
    std::ranges::sort(names);
    std::vector<std::string> all;
    for (const std::string& name : names) {
      std::ostringstream text;
      text << std::ifstream(name, std::ios::binary).rdbuf();
      all.push_back(text.str());
    }
    if (all.empty()) std::abort();
    return all;
  }();
  return files[which % files.size()];
}

/// Three bytes a change: where (modulo the length), and the new value.
std::string with_other_bytes(std::string bytes, Input changes) {
  for (; changes.size() >= 3; changes = changes.subspan(3))
    bytes[(changes[0] * std::size_t{256} + changes[1]) % bytes.size()] =
        static_cast<char>(changes[2]);
  return bytes;
}

constexpr std::array<const char*, 28> kOperators{
    "Abs",      "Add",      "Cast",    "Concat",  "Constant", "ConstantOfShape", "Div",
    "Dropout",  "Elu",      "Expand",  "Flatten", "GRU",      "Gather",          "Gemm",
    "Identity", "LSTM",     "MatMul",  "Mul",     "Relu",     "Reshape",         "Shape",
    "Slice",    "Softsign", "Squeeze", "Sub",     "Tanh",     "Transpose",       "Unsqueeze"};

void change_node(onnx::GraphProto& graph, std::uint8_t which, std::uint8_t how, std::uint8_t to) {
  if (graph.node_size() == 0) return;
  onnx::NodeProto& node = *graph.mutable_node(which % graph.node_size());
  const onnx::NodeProto& other = graph.node(to % graph.node_size());
  switch (how % 7) {
    case 0: node.set_op_type(kOperators[to % kOperators.size()]); break;
    case 1:
      if (node.input_size() > 0 && other.output_size() > 0)
        node.set_input(how / 7 % node.input_size(), other.output(0));
      break;
    case 2:
      if (node.input_size() > 0 && graph.initializer_size() > 0)
        node.set_input(how / 7 % node.input_size(),
                       graph.initializer(to % graph.initializer_size()).name());
      break;
    case 3:
      for (onnx::AttributeProto& attribute : *node.mutable_attribute()) {
        if (attribute.has_i()) attribute.set_i(static_cast<std::int8_t>(to));
        for (auto& value : *attribute.mutable_ints()) value = (value + to) % 4 - (to > 200 ? 1 : 0);
      }
      break;
    case 4:
      if (graph.initializer_size() > 0) {
        onnx::TensorProto& tensor = *graph.mutable_initializer(which % graph.initializer_size());
        if (tensor.dims_size() > 1)
          tensor.mutable_dims()->SwapElements(0, to % tensor.dims_size());
        else
          tensor.add_dims(1);
      }
      break;
    case 5: node.add_input(other.output_size() > 0 ? other.output(0) : ""); break;
    case 6:
      graph.mutable_node()->SwapElements(which % graph.node_size(), to % graph.node_size());
      break;
  }
}

std::string with_other_nodes(const std::string& bytes, Input changes) {
  onnx::ModelProto model;
  if (!model.ParseFromString(bytes)) std::abort();
  for (; changes.size() >= 3; changes = changes.subspan(3))
    change_node(*model.mutable_graph(), changes[0], changes[1], changes[2]);
  return model.SerializeAsString();
}

std::string file_of(Input data) {
  if (data.empty()) return {};
  const std::uint8_t how = data.front();
  const Input rest = data.subspan(1);
  if (how % 4 == 0) return {rest.begin(), rest.end()};
  const std::string& good = good_bytes(how / 4);
  return how % 4 == 1 ? with_other_bytes(good, rest) : with_other_nodes(good, rest);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string bytes = file_of({data, size});
  try {
    const torsio::ForeignNetwork network =
        torsio::parse_onnx(std::as_bytes(std::span(bytes)), "fuzz");
    torsio::AnyModel model(torsio::network_parameters(network, 0.01, 0));
    const std::vector<double> features(model.input_count(), 0.1);
    (void)model.step(features);
  } catch (const torsio::Error& error) {
    if (std::string_view(error.what()).empty()) std::abort();
  }
  return 0;
}

#include "torsio/import/onnx_network.hpp"

#include <fmt/format.h>
#include <onnx/onnx_pb.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <utility>

#include "core/checks.hpp"
#include "import/graph_value.hpp"

namespace torsio {
namespace {

// The operators that are read mean the same in all of these.
constexpr std::int64_t kFirstOpset = 7;
constexpr std::int64_t kLastOpset = 21;

static_assert(std::endian::native == std::endian::little, "raw data of ONNX are little-endian");

void check_count(std::size_t expected, std::size_t found, const char* of,
                 const std::string& place) {
  if (found != expected)
    refuse(place, fmt::format("{} {}, as in its shape", expected, of), fmt::format("{}", found));
}

template <class Number, class Field>
std::vector<double> numbers_of(const onnx::TensorProto& tensor, const Field& field,
                               std::size_t count, const std::string& place) {
  if (!tensor.has_raw_data()) {
    check_count(count, static_cast<std::size_t>(field.size()), "numbers", place);
    return {field.begin(), field.end()};
  }
  const std::string& raw = tensor.raw_data();
  check_count(count * sizeof(Number), raw.size(), "bytes", place);
  std::vector<Number> numbers(count);
  if (!raw.empty()) std::memcpy(numbers.data(), raw.data(), raw.size());
  return {numbers.begin(), numbers.end()};
}

std::vector<double> values_of(const onnx::TensorProto& tensor, std::size_t count,
                              const std::string& place) {
  switch (tensor.data_type()) {
    case onnx::TensorProto::FLOAT:
      return numbers_of<float>(tensor, tensor.float_data(), count, place);
    case onnx::TensorProto::DOUBLE:
      return numbers_of<double>(tensor, tensor.double_data(), count, place);
    case onnx::TensorProto::INT64:
      return numbers_of<std::int64_t>(tensor, tensor.int64_data(), count, place);
    case onnx::TensorProto::INT32:
      return numbers_of<std::int32_t>(tensor, tensor.int32_data(), count, place);
    case onnx::TensorProto::BOOL:
      return numbers_of<std::int8_t>(tensor, tensor.int32_data(), count, place);
    default:
      refuse(place, "float, double, int32, int64 or bool",
             fmt::format("type {}", tensor.data_type()), "Export the network in float32.");
  }
}

/// Reads the constants of a graph. All of them together are few: elements of one byte in a file
/// become numbers of eight.
class Constants {
 public:
  graph::Tensor tensor_of(const onnx::TensorProto& tensor, const std::string& place) {
    if (tensor.data_location() == onnx::TensorProto::EXTERNAL || tensor.external_data_size() > 0)
      refuse(place, "data within the file", "a reference to another file",
             "Save the model with its weights inside (save_as_external_data=False).");
    if (tensor.has_segment()) refuse(place, "a whole tensor", "a segment of one");
    const std::vector<std::int64_t> shape(tensor.dims().begin(), tensor.dims().end());
    constexpr std::size_t kMaxRank = 8;
    const auto count = graph::element_count(shape);
    if (shape.size() > kMaxRank || !count)
      refuse(place, "a shape that fits into a file", "a larger one");
    numbers_ += *count;
    constexpr std::size_t kMax = kMaxForeignBytes / sizeof(float);
    if (numbers_ > kMax)
      refuse(place, fmt::format("at most {} numbers in all constants", kMax), "more");
    graph::Tensor result{shape, values_of(tensor, *count, place)};
    const auto bad =
        std::ranges::find_if_not(result.values, [](double x) { return std::isfinite(x); });
    if (bad != result.values.end())
      refuse(place, "finite numbers", fmt::format("{} at {}", *bad, bad - result.values.begin()));
    return result;
  }

 private:
  std::size_t numbers_ = 0;
};

graph::Attribute attribute_of(const onnx::AttributeProto& proto, const std::string& place,
                              Constants& constants) {
  graph::Attribute attribute;
  switch (proto.type()) {
    case onnx::AttributeProto::FLOAT: attribute.numbers = {static_cast<double>(proto.f())}; break;
    case onnx::AttributeProto::FLOATS:
      attribute.numbers.assign(proto.floats().begin(), proto.floats().end());
      break;
    case onnx::AttributeProto::INT: attribute.integers = {proto.i()}; break;
    case onnx::AttributeProto::INTS:
      attribute.integers.assign(proto.ints().begin(), proto.ints().end());
      break;
    case onnx::AttributeProto::STRING: attribute.texts = {proto.s()}; break;
    case onnx::AttributeProto::STRINGS:
      attribute.texts.assign(proto.strings().begin(), proto.strings().end());
      break;
    case onnx::AttributeProto::TENSOR:
      attribute.tensor = constants.tensor_of(proto.t(), place);
      break;
    default: break;  // graphs and types belong to operators that are refused by name
  }
  if (std::ranges::any_of(attribute.numbers, [](double x) { return !std::isfinite(x); }))
    refuse(place, "finite numbers", "others");
  return attribute;
}

graph::Node node_of(const onnx::NodeProto& proto, const std::string& place, Constants& constants) {
  const bool is_own = proto.domain().empty() || proto.domain() == "ai.onnx";
  graph::Node node{
      .name = proto.name(),
      .op = is_own ? proto.op_type() : fmt::format("{}::{}", proto.domain(), proto.op_type()),
      .inputs = {proto.input().begin(), proto.input().end()},
      .outputs = {proto.output().begin(), proto.output().end()}};
  for (const onnx::AttributeProto& attribute : proto.attribute())
    node.attributes[attribute.name()] = attribute_of(
        attribute,
        fmt::format("{}: node '{}' ({}): {}", place, node.name, node.op, attribute.name()),
        constants);
  return node;
}

graph::Graph::Input input_of(const onnx::ValueInfoProto& proto) {
  graph::Graph::Input input{proto.name(), {}};
  for (const auto& size : proto.type().tensor_type().shape().dim())
    input.shape.push_back(size.has_dim_value() && size.dim_value() > 0
                              ? std::optional(size.dim_value())
                              : std::nullopt);  // -1 and 0 mean "any" in some exporters
  return input;
}

std::int64_t opset_of(const onnx::ModelProto& model, const std::string& place) {
  std::int64_t version = 0;
  for (const onnx::OperatorSetIdProto& opset : model.opset_import())
    if (opset.domain().empty() || opset.domain() == "ai.onnx") version = opset.version();
  if (version < kFirstOpset || version > kLastOpset)
    refuse(place + ": opset", fmt::format("{} to {}", kFirstOpset, kLastOpset),
           fmt::format("{}", version), "Export with opset_version=13, for example.");
  return version;
}

graph::Graph graph_of(const onnx::ModelProto& model, std::string_view place) {
  graph::Graph graph{.place = std::string(place), .opset = opset_of(model, std::string(place))};
  Constants constants;
  for (const onnx::TensorProto& tensor : model.graph().initializer())
    graph.constants[tensor.name()] =
        constants.tensor_of(tensor, fmt::format("{}: tensor '{}'", place, tensor.name()));
  for (const onnx::NodeProto& node : model.graph().node())
    graph.nodes.push_back(node_of(node, graph.place, constants));
  for (const onnx::ValueInfoProto& input : model.graph().input())
    if (!graph.constants.contains(input.name())) graph.inputs.push_back(input_of(input));
  for (const onnx::ValueInfoProto& output : model.graph().output())
    graph.outputs.push_back(output.name());
  return graph;
}

}  // namespace

ForeignNetwork parse_onnx(std::span<const std::byte> bytes, std::string_view place,
                          const std::string& output) {
  onnx::ModelProto model;
  if (bytes.size() > kMaxForeignBytes ||
      !model.ParseFromArray(bytes.data(), static_cast<int>(bytes.size())) || !model.has_graph())
    refuse(std::string(place), "an ONNX model", "something else, or a part of one",
           "Is the file complete? torsio import reads ONNX and PyTorch weights as JSON.");
  return graph::network_of(graph_of(model, place), output);
}

}  // namespace torsio

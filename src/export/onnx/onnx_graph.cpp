#include "export/onnx/onnx_graph.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "torsio/core/version.hpp"

namespace torsio {
namespace {

constexpr std::int64_t kOperatorSet = 13;
constexpr std::int64_t kIrVersion = 8;

}  // namespace

OnnxGraph::OnnxGraph() : graph_(*model_.mutable_graph()) {
  model_.set_ir_version(kIrVersion);
  model_.set_producer_name("torsio");
  model_.set_producer_version(kVersion);
  model_.add_opset_import()->set_version(kOperatorSet);
  graph_.set_name("torsio");
}

onnx::NodeProto& OnnxGraph::add_node(const std::string& operation, const Names& inputs,
                                     const Names& outputs) {
  onnx::NodeProto& node = *graph_.add_node();
  node.set_op_type(operation);
  node.set_name(fmt::format("{}_{}", operation, graph_.node_size()));
  for (const std::string& name : inputs) node.add_input(name);
  for (const std::string& name : outputs) node.add_output(name);
  return node;
}

std::string OnnxGraph::add(const std::string& operation, const Names& inputs,
                           const std::string& output) {
  std::string name = output.empty() ? fmt::format("v{}", ++names_) : output;
  add_node(operation, inputs, {name});
  return name;
}

void OnnxGraph::set(onnx::NodeProto& node, const std::string& name, std::int64_t value) {
  onnx::AttributeProto& attribute = *node.add_attribute();
  attribute.set_name(name);
  attribute.set_type(onnx::AttributeProto::INT);
  attribute.set_i(value);
}

void OnnxGraph::set(onnx::NodeProto& node, const std::string& name,
                    const std::vector<std::int64_t>& values) {
  onnx::AttributeProto& attribute = *node.add_attribute();
  attribute.set_name(name);
  attribute.set_type(onnx::AttributeProto::INTS);
  for (const std::int64_t value : values) attribute.add_ints(value);
}

std::string OnnxGraph::initializer(onnx::TensorProto tensor,
                                   const std::vector<std::int64_t>& shape) {
  for (const std::int64_t size : shape) tensor.add_dims(size);
  // Equal constants are one.
  const std::string content = tensor.SerializeAsString();
  for (const onnx::TensorProto& known : graph_.initializer()) {
    onnx::TensorProto unnamed = known;
    unnamed.clear_name();
    if (unnamed.SerializeAsString() == content) return known.name();
  }
  tensor.set_name(fmt::format("c{}", ++names_));
  *graph_.add_initializer() = tensor;
  return tensor.name();
}

std::string OnnxGraph::whole(const std::vector<std::int64_t>& values) {
  onnx::TensorProto tensor;
  tensor.set_data_type(onnx::TensorProto::INT64);
  for (const std::int64_t value : values) tensor.add_int64_data(value);
  return initializer(std::move(tensor), {static_cast<std::int64_t>(values.size())});
}

std::string OnnxGraph::truths(std::span<const double> values,
                              const std::vector<std::int64_t>& shape) {
  onnx::TensorProto tensor;
  tensor.set_data_type(onnx::TensorProto::BOOL);
  for (const double value : values) tensor.add_int32_data(value != 0.0 ? 1 : 0);
  return initializer(std::move(tensor), shape);
}

std::string OnnxGraph::singles(std::span<const double> values,
                               const std::vector<std::int64_t>& shape) {
  const std::vector<float> rounded(values.begin(), values.end());
  return singles(rounded, shape);
}

std::string OnnxGraph::singles(std::span<const float> values,
                               const std::vector<std::int64_t>& shape) {
  onnx::TensorProto tensor;
  tensor.set_data_type(onnx::TensorProto::FLOAT);
  tensor.set_raw_data(values.data(), values.size_bytes());
  return initializer(std::move(tensor), shape);
}

std::string OnnxGraph::doubles(std::span<const double> values,
                               const std::vector<std::int64_t>& shape) {
  onnx::TensorProto tensor;
  tensor.set_data_type(onnx::TensorProto::DOUBLE);
  tensor.set_raw_data(values.data(), values.size_bytes());
  return initializer(std::move(tensor), shape);
}

void OnnxGraph::describe(onnx::ValueInfoProto& value, const std::string& name, int type,
                         const std::vector<std::int64_t>& shape) {
  value.set_name(name);
  onnx::TypeProto::Tensor& tensor = *value.mutable_type()->mutable_tensor_type();
  tensor.set_elem_type(type);
  onnx::TensorShapeProto& of = *tensor.mutable_shape();
  for (const std::int64_t size : shape) {
    if (size < 0)
      of.add_dim()->set_dim_param("joints");
    else
      of.add_dim()->set_dim_value(size);
  }
}

void OnnxGraph::input(const std::string& name, int type, const std::vector<std::int64_t>& shape) {
  describe(*graph_.add_input(), name, type, shape);
}

void OnnxGraph::output(const std::string& name, int type, const std::vector<std::int64_t>& shape) {
  describe(*graph_.add_output(), name, type, shape);
}

void OnnxGraph::metadata(const std::string& key, const std::string& value) {
  onnx::StringStringEntryProto& entry = *model_.add_metadata_props();
  entry.set_key(key);
  entry.set_value(value);
}

std::string OnnxGraph::bytes() const { return model_.SerializeAsString(); }

}  // namespace torsio

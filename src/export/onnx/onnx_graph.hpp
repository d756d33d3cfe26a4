#pragma once

#include <onnx/onnx_pb.h>

#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace torsio {

/// Adds nodes and constants to an ONNX model; names of values are made here.
class OnnxGraph {
 public:
  using Names = std::vector<std::string>;

  OnnxGraph();

  /// @returns the name of its output
  std::string add(const std::string& operation, const Names& inputs,
                  const std::string& output = {});
  onnx::NodeProto& add_node(const std::string& operation, const Names& inputs,
                            const Names& outputs);
  static void set(onnx::NodeProto& node, const std::string& name, std::int64_t value);
  static void set(onnx::NodeProto& node, const std::string& name,
                  const std::vector<std::int64_t>& values);

  std::string whole(const std::vector<std::int64_t>& values);
  std::string truths(std::span<const double> values, const std::vector<std::int64_t>& shape);
  std::string singles(std::span<const double> values, const std::vector<std::int64_t>& shape);
  std::string singles(std::span<const float> values, const std::vector<std::int64_t>& shape);
  std::string doubles(std::span<const double> values, const std::vector<std::int64_t>& shape);

  /// A dimension below 0 is the number of joints.
  void input(const std::string& name, int type, const std::vector<std::int64_t>& shape);
  void output(const std::string& name, int type, const std::vector<std::int64_t>& shape);
  void metadata(const std::string& key, const std::string& value);
  void description(const std::string& text) { model_.set_doc_string(text); }

  [[nodiscard]] std::string bytes() const;

 private:
  std::string initializer(onnx::TensorProto tensor, const std::vector<std::int64_t>& shape);
  static void describe(onnx::ValueInfoProto& value, const std::string& name, int type,
                       const std::vector<std::int64_t>& shape);

  onnx::ModelProto model_;
  onnx::GraphProto& graph_;
  std::size_t names_ = 0;
};

}  // namespace torsio

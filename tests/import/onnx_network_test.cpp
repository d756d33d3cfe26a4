// Graphs that are not, or not only, what torsio can run: refused by name, never misread.
#include "torsio/import/onnx_network.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <onnx/onnx_pb.h>

#include <array>
#include <fstream>
#include <functional>
#include <limits>
#include <sstream>
#include <string>

#include "import/network_parameters.hpp"
#include "model/network/lstm.hpp"
#include "support/error_message.hpp"
#include "torsio/import/import_network.hpp"

namespace torsio {
namespace {

using testing::AllOf;
using testing::HasSubstr;

std::string file(const std::string& name) {
  std::ostringstream text;
  text << std::ifstream(std::string(TORSIO_GOLDEN_IMPORT) + "/" + name, std::ios::binary).rdbuf();
  return text.str();
}

ForeignNetwork parse_network(const std::string& bytes, const std::string& output = {}) {
  return parse_onnx(std::as_bytes(std::span(bytes)), "net.onnx", output);
}

std::string onnx_refusal(const std::string& bytes, const std::string& output = {}) {
  return test::error_message(
      [&] { (void)network_parameters(parse_network(bytes, output), 0.01, 0); });
}

using Change = std::function<void(onnx::GraphProto&)>;

std::string changed(const std::string& name, const Change& change) {
  onnx::ModelProto model;
  if (!model.ParseFromString(file(name))) throw std::runtime_error(name + " is missing");
  change(*model.mutable_graph());
  return model.SerializeAsString();
}

onnx::NodeProto& node_of(onnx::GraphProto& graph, const std::string& op) {
  for (onnx::NodeProto& node : *graph.mutable_node())
    if (node.op_type() == op) return node;
  throw std::runtime_error("no node " + op);
}

onnx::TensorProto& tensor_of(onnx::GraphProto& graph, const std::string& name) {
  for (onnx::TensorProto& tensor : *graph.mutable_initializer())
    if (tensor.name() == name) return tensor;
  throw std::runtime_error("no tensor " + name);
}

/// The error for a good graph after `change`.
std::string refusal_after(const std::string& name, const Change& change) {
  return onnx_refusal(changed(name, change));
}

onnx::AttributeProto& attribute(onnx::NodeProto& node, const std::string& name) {
  for (onnx::AttributeProto& one : *node.mutable_attribute())
    if (one.name() == name) return one;
  onnx::AttributeProto& added = *node.add_attribute();
  added.set_name(name);
  return added;
}

TEST(OnnxNetwork, ThatIsNoneOrCutOffIsRefused) {
  EXPECT_THAT(onnx_refusal(""), HasSubstr("an ONNX model"));
  EXPECT_THAT(onnx_refusal("torsio"), HasSubstr("an ONNX model"));
  const std::string whole = file("torch_softsign.onnx");
  EXPECT_EQ(onnx_refusal(whole), "");
  for (std::size_t length = 0; length < whole.size(); length += 7)
    EXPECT_NE(onnx_refusal(whole.substr(0, length)), "") << length;
}

TEST(OnnxNetwork, ListsAllNodesThatAreNotSupported) {
  EXPECT_THAT(refusal_after("torch_relu.onnx",
                            [](onnx::GraphProto& graph) {
                              graph.mutable_node(1)->set_op_type("Sigmoid");
                              graph.mutable_node(3)->set_op_type("Gelu");
                              graph.mutable_node(3)->set_domain("com.microsoft");
                            }),
              AllOf(HasSubstr("(Sigmoid), node"), HasSubstr("(com.microsoft::Gelu)")));
}

TEST(OnnxNetwork, LooksOnlyAtWhatItsOutputNeeds) {
  const std::string bytes = changed("torch_relu.onnx", [](onnx::GraphProto& graph) {
    onnx::NodeProto& node = *graph.add_node();
    node.set_op_type("Sigmoid");
    node.add_input(graph.node(0).output(0));
    node.add_output("gate");
    graph.add_output()->set_name("gate");
  });
  EXPECT_EQ(onnx_refusal(bytes), "");
  EXPECT_THAT(onnx_refusal(bytes, "gate"), HasSubstr("node 'gate' (Sigmoid)"));
  EXPECT_THAT(onnx_refusal(bytes, "nothing"),
              AllOf(HasSubstr("--output-name"), HasSubstr("y, gate")));
}

TEST(OnnxNetwork, OfUnknownOperatorSetsIsRefused) {
  for (const int version : {0, 6, 22, 99}) {
    onnx::ModelProto model;
    ASSERT_TRUE(model.ParseFromString(file("torch_relu.onnx")));
    model.mutable_opset_import(0)->set_version(version);
    EXPECT_THAT(onnx_refusal(model.SerializeAsString()),
                AllOf(HasSubstr("net.onnx: opset"), HasSubstr("7 to 21"),
                      HasSubstr(std::to_string(version))));
  }
}

TEST(OnnxNetwork, WithBadTensorsNamesThem) {
  const auto spoiled = [](const std::function<void(onnx::TensorProto&)>& spoil) {
    return refusal_after("keras_gru.onnx",
                         [&](onnx::GraphProto& graph) { spoil(tensor_of(graph, "W")); });
  };
  EXPECT_THAT(spoiled([](onnx::TensorProto& tensor) {
                tensor.set_data_location(onnx::TensorProto::EXTERNAL);
              }),
              AllOf(HasSubstr("tensor 'W'"), HasSubstr("another file")));
  EXPECT_THAT(spoiled([](onnx::TensorProto& tensor) {
                const float bad = std::numeric_limits<float>::quiet_NaN();
                tensor.mutable_raw_data()->replace(
                    8, sizeof bad, std::string(reinterpret_cast<const char*>(&bad), sizeof bad));
              }),
              AllOf(HasSubstr("tensor 'W'"), HasSubstr("nan at 2")));
  EXPECT_THAT(spoiled([](onnx::TensorProto& tensor) { tensor.mutable_raw_data()->pop_back(); }),
              HasSubstr("tensor 'W'"));
  EXPECT_THAT(spoiled([](onnx::TensorProto& tensor) { tensor.set_dims(1, 13); }),
              AllOf(HasSubstr("tensor 'W'"), HasSubstr("as in its shape")));
  EXPECT_THAT(spoiled([](onnx::TensorProto& tensor) { tensor.set_dims(1, INT64_MAX); }),
              AllOf(HasSubstr("tensor 'W'"), HasSubstr("a shape that fits into a file")));
  EXPECT_THAT(spoiled([](onnx::TensorProto& tensor) { tensor.set_dims(1, -1); }),
              AllOf(HasSubstr("tensor 'W'"), HasSubstr("a shape that fits into a file")));
  EXPECT_THAT(
      spoiled([](onnx::TensorProto& tensor) { tensor.set_data_type(onnx::TensorProto::FLOAT16); }),
      AllOf(HasSubstr("tensor 'W'"), HasSubstr("float32")));
}

TEST(OnnxNetwork, WithShapesThatDoNotFitNamesTheNode) {
  EXPECT_THAT(
      refusal_after("keras_gru.onnx",
                    [](onnx::GraphProto& graph) {
                      onnx::TensorProto& tensor = tensor_of(graph, "W");
                      tensor.set_dims(1, 9);
                      tensor.set_dims(2, 4);
                    }),
      AllOf(HasSubstr("node 'gru' (GRU)"), HasSubstr("[1, 12, 3]"), HasSubstr("[1, 9, 4]")));
  EXPECT_THAT(
      refusal_after("keras_lstm.onnx",
                    [](onnx::GraphProto& graph) { node_of(graph, "MatMul").set_input(1, "W"); }),
      AllOf(HasSubstr("(MatMul)"), HasSubstr("a matrix of weights")));
  EXPECT_THAT(refusal_after("torch_relu.onnx",
                            [](onnx::GraphProto& graph) {
                              graph.mutable_input(0)
                                  ->mutable_type()
                                  ->mutable_tensor_type()
                                  ->mutable_shape()
                                  ->mutable_dim(1)
                                  ->set_dim_value(4);
                            }),
              AllOf(HasSubstr("(Gemm)"), HasSubstr("4 inputs"), HasSubstr("for 3")));
}

TEST(OnnxNetwork, WithOtherKindsOfMemoryNamesTheNode) {
  const auto lstm = [](const std::function<void(onnx::NodeProto&)>& change) {
    return refusal_after("keras_lstm.onnx",
                         [&](onnx::GraphProto& graph) { change(node_of(graph, "LSTM")); });
  };
  EXPECT_THAT(lstm([](onnx::NodeProto& node) { attribute(node, "direction").set_s("reverse"); }),
              AllOf(HasSubstr("node 'lstm' (LSTM)"), HasSubstr("direction")));
  EXPECT_THAT(lstm([](onnx::NodeProto& node) { attribute(node, "clip").set_f(3.0F); }),
              HasSubstr("clip"));
  EXPECT_THAT(lstm([](onnx::NodeProto& node) {
                attribute(node, "activations").set_strings(0, "HardSigmoid");
              }),
              HasSubstr("activations"));
  EXPECT_THAT(lstm([](onnx::NodeProto& node) { node.set_input(4, "zero"); }),
              HasSubstr("lengths of sequences"));
  EXPECT_THAT(lstm([](onnx::NodeProto& node) { node.set_input(5, "head_b"); }),
              HasSubstr("a start from zeros"));
  EXPECT_THAT(lstm([](onnx::NodeProto& node) { node.add_input("head_b"); }), HasSubstr("peephole"));
  EXPECT_THAT(refusal_after("keras_gru.onnx",
                            [](onnx::GraphProto& graph) {
                              attribute(node_of(graph, "GRU"), "linear_before_reset").set_i(0);
                            }),
              AllOf(HasSubstr("linear_before_reset"), HasSubstr("reset_after=True")));
}

TEST(OnnxNetwork, ThatMixesSamplesAndChannelsIsRefused) {
  // Without its transposition the second layer would run along the batch.
  EXPECT_THAT(refusal_after("torch_lstm.onnx",
                            [](onnx::GraphProto& graph) {
                              int seen = 0;
                              for (onnx::NodeProto& node : *graph.mutable_node())
                                if (node.op_type() == "Squeeze" && ++seen == 1) {
                                  node.set_op_type("Transpose");
                                  node.mutable_input()->RemoveLast();
                                  onnx::AttributeProto& order = attribute(node, "perm");
                                  order.set_type(onnx::AttributeProto::INTS);
                                  for (const int axis : {2, 0, 1, 3}) order.add_ints(axis);
                                }
                            }),
              HasSubstr("expected"));
  EXPECT_THAT(refusal_after("keras_gru.onnx",
                            [](onnx::GraphProto& graph) {
                              // Rows of a sample and a half.
                              const std::array<std::int64_t, 2> rows{-1, 6};
                              tensor_of(graph, "rows").set_raw_data(rows.data(), sizeof rows);
                            }),
              AllOf(HasSubstr("(Reshape)"), HasSubstr("samples and channels apart")));
  EXPECT_THAT(refusal_after("batch_first_lstm.onnx",
                            [](onnx::GraphProto& graph) {
                              const std::int64_t first = 0;
                              tensor_of(graph, "last").set_raw_data(&first, sizeof first);
                            }),
              AllOf(HasSubstr("(Gather)"), HasSubstr("the last sample")));
  EXPECT_THAT(refusal_after("batch_first_lstm.onnx",
                            [](onnx::GraphProto& graph) {
                              attribute(node_of(graph, "Gather"), "axis").set_i(0);
                            }),
              AllOf(HasSubstr("(Gather)"), HasSubstr("axis 0")));
}

TEST(OnnxNetwork, ThatIsNoSinglePathIsRefused) {
  EXPECT_THAT(refusal_after("torch_relu.onnx",
                            [](onnx::GraphProto& graph) {
                              onnx::NodeProto& node = *graph.mutable_node(3);
                              node.set_op_type("Add");
                              node.add_input(graph.node(2).output(0));
                            }),
              AllOf(HasSubstr("(Add)"), HasSubstr("to be a constant")));
  EXPECT_THAT(refusal_after("torch_relu.onnx",
                            [](onnx::GraphProto& graph) {
                              graph.mutable_node(1)->set_input(0, graph.node(2).output(0));
                            }),
              AllOf(HasSubstr("(Relu)"), HasSubstr("nodes before it")));
  EXPECT_THAT(refusal_after("torch_relu.onnx",
                            [](onnx::GraphProto& graph) {
                              graph.mutable_node(2)->set_output(0, graph.node(0).output(0));
                            }),
              HasSubstr("again"));
  EXPECT_THAT(
      refusal_after("torch_relu.onnx",
                    [](onnx::GraphProto& graph) { graph.mutable_node(0)->set_output(0, "x"); }),
      HasSubstr("'x' again"));
  EXPECT_THAT(refusal_after("torch_relu.onnx",
                            [](onnx::GraphProto& graph) {
                              graph.mutable_output(0)->set_name(graph.node(1).output(0));
                            }),
              HasSubstr("one output"));
}

TEST(OnnxNetwork, CannotAskForMoreMemoryThanAModelNeeds) {
  EXPECT_THAT(refusal_after("torch_tanh_scaled.onnx",
                            [](onnx::GraphProto& graph) {
                              // Each doubles the one before: 2^40 numbers.
                              std::string last = graph.node(0).output(0);
                              for (int i = 0; i < 40; ++i) {
                                onnx::NodeProto node;
                                node.set_op_type("Concat");
                                onnx::AttributeProto& axis = attribute(node, "axis");
                                axis.set_type(onnx::AttributeProto::INT);
                                axis.set_i(0);
                                node.add_input(last);
                                node.add_input(last);
                                last = "doubled" + std::to_string(i);
                                node.add_output(last);
                                *graph.add_node() = node;
                              }
                              onnx::NodeProto& add = *graph.add_node();
                              add.set_op_type("Add");
                              add.add_input(graph.output(0).name());
                              add.add_input(last);
                              add.add_output("z");
                              graph.mutable_output(0)->set_name("z");
                            }),
              AllOf(HasSubstr("(Concat)"), HasSubstr("numbers made from constants")));
}

TEST(OnnxNetwork, CannotSwellTheConstantsOfASmallFile) {
  // A byte each in the file, eight in memory.
  EXPECT_THAT(refusal_after("torch_relu.onnx",
                            [](onnx::GraphProto& graph) {
                              onnx::TensorProto& flags = *graph.add_initializer();
                              flags.set_name("flags");
                              flags.set_data_type(onnx::TensorProto::BOOL);
                              flags.add_dims(17 << 20);
                              flags.set_raw_data(std::string(17 << 20, '\1'));
                            }),
              AllOf(HasSubstr("tensor 'flags'"), HasSubstr("numbers in all constants")));
}

TEST(OnnxNetwork, KeepsItsScalesAsStandardisation) {
  const auto lstm =
      network_parameters(parse_network(file("torch_lstm.onnx")), 0.01, 0).get<Lstm::Parameters>();
  EXPECT_EQ(lstm.scaling.inputs.scale, (std::vector<double>{0.5, 4.0}));
  EXPECT_EQ(lstm.scaling.target_scale, 20.0);
}

}  // namespace
}  // namespace torsio

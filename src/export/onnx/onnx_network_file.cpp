#include "export/onnx/onnx_network_file.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <nlohmann/json.hpp>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "export/drive_inputs.hpp"
#include "export/onnx/onnx_graph.hpp"
#include "model/network/gru.hpp"
#include "model/network/lstm.hpp"
#include "model/network/mlp.hpp"
#include "torsio/core/error.hpp"
#include "torsio/model/any_model.hpp"

namespace torsio {
namespace {

using NetworkType = onnx::TensorProto;

/// The rows of gates in the order of ONNX: i, o, f, c of an LSTM (here i, f, g, o); z, r, h of a GRU (here r, z, n).
template <class Layer>
constexpr auto kGateOrder = std::array<std::size_t, 4>{0, 3, 1, 2};
template <>
constexpr auto kGateOrder<GruLayer> = std::array<std::size_t, 3>{1, 0, 2};

template <class Layer>
std::vector<float> in_gate_order(std::span<const float> values, std::size_t units) {
  constexpr auto kOrder = kGateOrder<Layer>;
  const std::size_t columns = values.size() / (kOrder.size() * units);
  std::vector<float> ordered;
  for (const std::size_t gate : kOrder) {
    const auto block = values.subspan(gate * units * columns, units * columns);
    ordered.insert(ordered.end(), block.begin(), block.end());
  }
  return ordered;
}

/// Both biases of a layer, that of the inputs first.
std::vector<float> biases(const LstmLayer& layer) {
  const std::size_t gates = 4 * layer.units();
  const std::span<const float> all = layer.bias;
  std::vector<float> both = in_gate_order<LstmLayer>(all.first(gates), layer.units());
  std::vector<float> second(gates, 0.0F);
  if (layer.keeps_biases_apart())
    second = in_gate_order<LstmLayer>(all.subspan(gates), layer.units());
  both.insert(both.end(), second.begin(), second.end());
  return both;
}
std::vector<float> biases(const GruLayer& layer) {
  std::vector<float> both = in_gate_order<GruLayer>(layer.input_bias, layer.units());
  const std::vector<float> second = in_gate_order<GruLayer>(layer.recurrent_bias, layer.units());
  both.insert(both.end(), second.begin(), second.end());
  return both;
}

std::int64_t signed_size(std::size_t size) { return static_cast<std::int64_t>(size); }

/// Centre and scale of the inputs within the first layer's weights and the bias of its inputs, and its inputs in
/// another order: W' = W_order / scale, b' = b - W' centre.
void fold(FloatMatrix& weights, std::span<float> bias, const NetworkScaling& scaling,
          const std::vector<std::size_t>& order) {
  const FloatMatrix given = weights;
  for (std::size_t i = 0; i < given.rows; ++i) {
    double offset = 0.0;
    for (std::size_t j = 0; j < order.size(); ++j) {
      const std::size_t from = order[j];
      const double weight = static_cast<double>(given(i, from)) / scaling.inputs.scale[from];
      offset += weight * scaling.inputs.centre[from];
      weights(i, j) = static_cast<float>(weight);
    }
    bias[i] = static_cast<float>(static_cast<double>(bias[i]) - offset);
  }
}

void fold_output(DenseLayer& layer, const NetworkScaling& scaling) {
  for (float& weight : layer.weights.values)
    weight = static_cast<float>(static_cast<double>(weight) * scaling.target_scale);
  for (float& bias : layer.bias)
    bias = static_cast<float>(static_cast<double>(bias) * scaling.target_scale +
                              scaling.target_centre);
}

class NetworkWriter {
 public:
  NetworkWriter(const ModelFile& model, const OnnxOptions& options)
      : model_(model), is_newton_(options.layout == OnnxLayout::newton) {}

  std::string bytes(const std::string& description) {
    onnx_.description(description);
    onnx_.metadata("sample_rate_Hz", fmt::format("{}", model_.settings.sample_rate_Hz));
    onnx_.metadata("target", model_.settings.target);
    onnx_.metadata("features", nlohmann::json(model_.settings.features.inputs).dump());
    if (const auto* mlp = model_.parameters.get_if<Mlp::Parameters>())
      add(*mlp);
    else if (const auto* gru = model_.parameters.get_if<Gru::Parameters>())
      add(*gru);
    else if (const auto* lstm = model_.parameters.get_if<Lstm::Parameters>())
      add(*lstm);
    else
      throw UsageError({.place = "the model",
                        .expected = "a network: mlp, gru or lstm",
                        .found = std::string(model_.parameters.family()),
                        .advice = "Export it without a layout: the graph of its estimator."});
    return onnx_.bytes();
  }

 private:
  /// The order of Newton's inputs, by the features of the model.
  static std::vector<std::size_t> newton_order(const DriveInputs& inputs) {
    std::vector<std::size_t> order = inputs.position_errors;
    order.insert(order.end(), inputs.speeds.begin(), inputs.speeds.end());
    return order;
  }

  void add(Mlp::Parameters p) {
    const std::size_t inputs = p.scaling.inputs.centre.size();
    if (is_newton_) {
      const DriveInputs drive = drive_inputs(model_, "--layout newton");
      fold(p.layers.front().weights, p.layers.front().bias, p.scaling, newton_order(drive));
      fold_output(p.layers.back(), p.scaling);
      onnx_.metadata("metadata", nlohmann::json{{"input_order", "pos_vel"},
                                                {"input_idx", drive.lags},
                                                {"pos_scale", 1.0},
                                                {"vel_scale", 1.0},
                                                {"effort_scale", 1.0},
                                                {"sample_rate_Hz", model_.settings.sample_rate_Hz}}
                                     .dump());
    }
    onnx_.input("input", NetworkType::FLOAT, {-1, signed_size(inputs)});
    std::string y =
        is_newton_ ? "input" : standardised_input("input", p.scaling, {1, signed_size(inputs)});
    y = dense(p.layers, y);
    finish(y, p.scaling);
  }

  template <class Layer>
  void add(RecurrentParameters<Layer> p) {
    constexpr bool kHasCell = std::is_same_v<Layer, LstmLayer>;
    const std::size_t inputs = p.scaling.inputs.centre.size();
    const std::size_t layers = p.layers.size();
    if (is_newton_) fold_recurrent(p);
    onnx_.input("input", NetworkType::FLOAT, {1, -1, signed_size(inputs)});
    std::string y =
        is_newton_ ? "input" : standardised_input("input", p.scaling, {1, 1, signed_size(inputs)});
    add_state("hidden", p.layers);
    if (kHasCell) add_state("cell", p.layers);
    std::vector<std::string> hidden;
    std::vector<std::string> cell;
    for (std::size_t i = 0; i < layers; ++i) {
      const Layer& layer = p.layers[i];
      const std::size_t units = layer.units();
      const auto of = [&](const std::string& state) {
        if (!is_newton_) return fmt::format("{}_{}", state, i);
        if (layers == 1) return state;
        const auto first = signed_size(i);
        return onnx_.add("Slice",
                         {state, onnx_.whole({first}), onnx_.whole({first + 1}), onnx_.whole({0})});
      };
      const auto gates = signed_size(kGateOrder<Layer>.size() * units);
      const auto columns = signed_size(layer.input_weights.columns);
      OnnxGraph::Names in{y,
                          onnx_.singles(in_gate_order<Layer>(layer.input_weights.values, units),
                                        {1, gates, columns}),
                          onnx_.singles(in_gate_order<Layer>(layer.recurrent_weights.values, units),
                                        {1, gates, signed_size(units)}),
                          onnx_.singles(biases(layer), {1, 2 * gates}),
                          "",
                          of("hidden")};
      OnnxGraph::Names out{fmt::format("rows_{}", i), fmt::format("next_hidden_{}", i)};
      if (kHasCell) {
        in.push_back(of("cell"));
        out.push_back(fmt::format("next_cell_{}", i));
      }
      onnx::NodeProto& node = onnx_.add_node(kHasCell ? "LSTM" : "GRU", in, out);
      OnnxGraph::set(node, "hidden_size", signed_size(units));
      if (!kHasCell) OnnxGraph::set(node, "linear_before_reset", std::int64_t{1});
      // Sequence, directions, joints, units: without the directions.
      y = onnx_.add("Squeeze", {out[0], onnx_.whole({1})});
      hidden.push_back(out[1]);
      if (kHasCell) cell.push_back(out[2]);
    }
    y = onnx_.add("Squeeze", {y, onnx_.whole({0})});
    y = dense(p.head, y);
    finish(y, p.scaling);
    finish_state("next_hidden", hidden, p.layers);
    if (kHasCell) finish_state("next_cell", cell, p.layers);
  }

  /// Newton has the states of all layers in one tensor: layers, joints, units.
  template <class Layer>
  void add_state(const std::string& name, const std::vector<Layer>& layers) {
    if (is_newton_)
      return onnx_.input(name, NetworkType::FLOAT,
                         {signed_size(layers.size()), -1, signed_size(layers[0].units())});
    for (std::size_t i = 0; i < layers.size(); ++i)
      onnx_.input(fmt::format("{}_{}", name, i), NetworkType::FLOAT,
                  {1, -1, signed_size(layers[i].units())});
  }

  template <class Layer>
  void finish_state(const std::string& name, const std::vector<std::string>& rows,
                    const std::vector<Layer>& layers) {
    if (is_newton_) {
      OnnxGraph::set(onnx_.add_node("Concat", rows, {name}), "axis", std::int64_t{0});
      return onnx_.output(name, NetworkType::FLOAT,
                          {signed_size(layers.size()), -1, signed_size(layers[0].units())});
    }
    for (std::size_t i = 0; i < layers.size(); ++i)
      onnx_.output(rows[i], NetworkType::FLOAT, {1, -1, signed_size(layers[i].units())});
  }

  void fold_recurrent(RecurrentParameters<LstmLayer>& p) {
    const DriveInputs drive = single_tick();
    for (const LstmLayer& layer : p.layers)
      require_same_units(layer.units(), p.layers.front().units());
    fold(p.layers.front().input_weights, p.layers.front().bias, p.scaling, newton_order(drive));
    fold_output(p.head.back(), p.scaling);
    onnx_.metadata("metadata", nlohmann::json{{"input_name", "input"},
                                              {"hidden_in_name", "hidden"},
                                              {"cell_in_name", "cell"},
                                              {"output_name", "output"},
                                              {"hidden_out_name", "next_hidden"},
                                              {"cell_out_name", "next_cell"},
                                              {"num_layers", p.layers.size()},
                                              {"hidden_size", p.layers.front().units()},
                                              {"pos_scale", 1.0},
                                              {"vel_scale", 1.0},
                                              {"effort_scale", 1.0},
                                              {"sample_rate_Hz", model_.settings.sample_rate_Hz}}
                                   .dump());
  }

  /// Newton standardises the inputs of a GRU itself.
  void fold_recurrent(RecurrentParameters<GruLayer>& p) {
    const DriveInputs drive = single_tick();
    for (const GruLayer& layer : p.layers)
      require_same_units(layer.units(), p.layers.front().units());
    if (p.head.size() != 1)
      throw UsageError({.place = "--layout newton",
                        .expected = "a gru with one dense layer after its recurrent ones",
                        .found = fmt::format("{} of them", p.head.size()),
                        .advice = "Fit it with one, or take an lstm."});
    const std::size_t error = drive.position_errors.front();
    const std::size_t speed = drive.speeds.front();
    NetworkScaling unit = p.scaling;
    std::ranges::fill(unit.inputs.centre, 0.0);
    std::ranges::fill(unit.inputs.scale, 1.0);
    fold(p.layers.front().input_weights, p.layers.front().input_bias, unit, newton_order(drive));
    const auto named = [&](const std::vector<double>& values) {
      return nlohmann::json{{"position_error", values[error]}, {"velocity", values[speed]}};
    };
    onnx_.metadata("metadata", nlohmann::json{{"input_columns", {"position_error", "velocity"}},
                                              {"normalization",
                                               {{"inputs",
                                                 {{"mean", named(p.scaling.inputs.centre)},
                                                  {"std", named(p.scaling.inputs.scale)}}},
                                                {"targets",
                                                 {{"mean", {{"torque", p.scaling.target_centre}}},
                                                  {"std", {{"torque", p.scaling.target_scale}}}}}}},
                                              {"sample_rate_Hz", model_.settings.sample_rate_Hz}}
                                   .dump());
  }

  DriveInputs single_tick() {
    DriveInputs drive = drive_inputs(model_, "--layout newton");
    if (drive.lags.size() != 1 || drive.lags.front() != 0)
      throw UsageError({.place = "--layout newton",
                        .expected = "a recurrent network without lags in its inputs",
                        .found = fmt::format("lags of {} ticks", fmt::join(drive.lags, ", "))});
    return drive;
  }

  static void require_same_units(std::size_t found, std::size_t expected) {
    if (found != expected)
      throw UsageError(
          {.place = "the network",
           .expected = fmt::format("{} units in each recurrent layer, as in the first", expected),
           .found = fmt::format("{}", found)});
  }

  std::string standardised_input(const std::string& name, const NetworkScaling& scaling,
                                 const std::vector<std::int64_t>& shape) {
    return onnx_.add("Div", {onnx_.add("Sub", {name, onnx_.singles(scaling.inputs.centre, shape)}),
                             onnx_.singles(scaling.inputs.scale, shape)});
  }

  std::string dense(const std::vector<DenseLayer>& layers, std::string y) {
    for (const DenseLayer& layer : layers) {
      const auto rows = signed_size(layer.weights.rows);
      onnx::NodeProto& node = onnx_.add_node(
          "Gemm",
          {y, onnx_.singles(layer.weights.values, {rows, signed_size(layer.weights.columns)}),
           onnx_.singles(layer.bias, {rows})},
          {fmt::format("dense_{}", ++dense_)});
      OnnxGraph::set(node, "transB", std::int64_t{1});
      y = node.output(0);
      switch (static_cast<Activation>(layer.activation)) {
        case Activation::linear: break;
        case Activation::relu: y = onnx_.add("Relu", {y}); break;
        case Activation::tanh: y = onnx_.add("Tanh", {y}); break;
        case Activation::softsign: y = onnx_.add("Softsign", {y}); break;
        case Activation::elu: y = onnx_.add("Elu", {y}); break;
      }
    }
    return y;
  }

  void finish(const std::string& y, const NetworkScaling& scaling) {
    if (is_newton_) {
      onnx_.add("Identity", {y}, "output");
    } else {
      const std::string scaled =
          onnx_.add("Mul", {y, onnx_.singles(std::vector<double>{scaling.target_scale}, {1, 1})});
      onnx_.add("Add", {scaled, onnx_.singles(std::vector<double>{scaling.target_centre}, {1, 1})},
                "output");
    }
    onnx_.output("output", NetworkType::FLOAT, {-1, 1});
  }

  const ModelFile& model_;
  OnnxGraph onnx_;
  bool is_newton_;
  std::size_t dense_ = 0;
};

}  // namespace

std::string network_onnx(const ModelFile& model, const OnnxOptions& options,
                         const std::string& description) {
  return NetworkWriter(model, options).bytes(description);
}

}  // namespace torsio

#include <fmt/format.h>

#include <algorithm>
#include <cstddef>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "export/graph/graph_families.hpp"
#include "torsio/model/network/network_layers.hpp"

namespace torsio {
namespace {

/// W^T, so that a row x becomes x W^T.
Row transposed(GraphBuilder& graph, const FloatMatrix& weights) {
  Matrix of(weights.columns, weights.rows);
  for (std::size_t i = 0; i < weights.rows; ++i)
    for (std::size_t j = 0; j < weights.columns; ++j) of(j, i) = static_cast<double>(weights(i, j));
  return graph.single_constant(std::move(of));
}

Row single_row(GraphBuilder& graph, std::span<const float> values) {
  Matrix row(1, values.size());
  std::ranges::copy(values, row.values.begin());
  return graph.single_constant(std::move(row));
}

Row destandardised_row(const NetworkScaling& scaling, Row y) {
  return to_real(y) * scaling.target_scale + scaling.target_centre;
}

Row activated_row(std::size_t activation, Row y) {
  switch (static_cast<Activation>(activation)) {
    case Activation::linear: return y;
    case Activation::relu: return maximum(y, 0.0);
    case Activation::tanh: return tangent(y);
    case Activation::softsign: return y / (absolute(y) + 1.0);
    case Activation::elu: break;
  }
  // The exponential of a large number, which is not selected, would be infinite.
  return select(y < 0.0, exponential(minimum(y, 0.0)) - 1.0, y);
}

Row dense_rows(GraphBuilder& graph, const std::vector<DenseLayer>& layers, Row y) {
  for (const DenseLayer& layer : layers)
    y = activated_row(layer.activation,
                      product(y, transposed(graph, layer.weights)) + single_row(graph, layer.bias));
  return y;
}

std::vector<float> added(std::span<const float> a, std::span<const float> b) {
  std::vector<float> sum(a.size());
  std::ranges::transform(a, b, sum.begin(), std::plus<>{});
  return sum;
}

/// A state of a layer, whose numbers have 32 bits.
Row hidden_state(GraphBuilder& graph, const std::string& name, std::size_t units) {
  return to_single(graph.state(name, units));
}

Row recurrent_rows(GraphBuilder& graph, const std::string& name, const LstmLayer& layer, Row x) {
  const std::size_t units = layer.units();
  const std::size_t gates = 4 * units;
  const std::span<const float> bias = layer.bias;
  const Row hidden = hidden_state(graph, name + "_hidden", units);
  const Row cell = hidden_state(graph, name + "_cell", units);
  const Row a =
      product(x, transposed(graph, layer.input_weights)) +
      product(hidden, transposed(graph, layer.recurrent_weights)) +
      single_row(graph, layer.keeps_biases_apart() ? added(bias.first(gates), bias.subspan(gates))
                                                   : layer.bias);
  const Row opened = sigmoid(a.part(0, 2 * units));
  const Row next =
      opened.part(units, units) * cell + opened.part(0, units) * tangent(a.part(2 * units, units));
  const Row out = sigmoid(a.part(3 * units, units)) * tangent(next);
  graph.set_state(name + "_cell", next);
  graph.set_state(name + "_hidden", out);
  return out;
}

Row recurrent_rows(GraphBuilder& graph, const std::string& name, const GruLayer& layer, Row x) {
  const std::size_t units = layer.units();
  const Row hidden = hidden_state(graph, name + "_hidden", units);
  const Row from_input =
      product(x, transposed(graph, layer.input_weights)) + single_row(graph, layer.input_bias);
  const Row from_hidden = product(hidden, transposed(graph, layer.recurrent_weights)) +
                          single_row(graph, layer.recurrent_bias);
  const Row opened = sigmoid(from_input.part(0, 2 * units) + from_hidden.part(0, 2 * units));
  const Row fresh = tangent(from_input.part(2 * units, units) +
                            opened.part(0, units) * from_hidden.part(2 * units, units));
  const Row out = fresh + opened.part(units, units) * (hidden - fresh);
  graph.set_state(name + "_hidden", out);
  return out;
}

template <class Layer>
GraphEstimate recurrent_estimate(GraphBuilder& graph, const RecurrentParameters<Layer>& p, Row x) {
  Row y = to_single(standardised_row(graph, p.scaling, x));
  for (std::size_t i = 0; i < p.layers.size(); ++i)
    y = recurrent_rows(graph, fmt::format("layer_{}", i), p.layers[i], y);
  GraphEstimate estimate =
      plain_estimate(destandardised_row(p.scaling, dense_rows(graph, p.head, y)));
  if (p.warm_up_samples > 0) {
    const auto warm_up = static_cast<double>(p.warm_up_samples);
    const Row steps = graph.state("model_steps");
    estimate.fault = select(steps < warm_up, fault_number(Fault::warming_up), 0.0);
    graph.set_state("model_steps", minimum(steps + 1.0, warm_up));
  }
  return estimate;
}

}  // namespace

Row standardised_row(GraphBuilder& graph, const NetworkScaling& scaling, Row x) {
  std::vector<double> factors;
  for (const double scale : scaling.inputs.scale) factors.push_back(1.0 / scale);
  return (x - graph.constant(scaling.inputs.centre)) * graph.constant(factors);
}

Row network_row(GraphBuilder& graph, const Mlp::Parameters& p, Row x) {
  return destandardised_row(
      p.scaling, dense_rows(graph, p.layers, to_single(standardised_row(graph, p.scaling, x))));
}

GraphEstimate add_network(GraphBuilder& graph, const Mlp::Parameters& p, Row x) {
  return plain_estimate(network_row(graph, p, x));
}
GraphEstimate add_network(GraphBuilder& graph, const Gru::Parameters& p, Row x) {
  return recurrent_estimate(graph, p, x);
}
GraphEstimate add_network(GraphBuilder& graph, const Lstm::Parameters& p, Row x) {
  return recurrent_estimate(graph, p, x);
}

}  // namespace torsio

// What computes: dense and recurrent layers, scales, activations.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "core/lower.hpp"
#include "files/safetensors.hpp"
#include "import/graph_evaluator.hpp"

namespace torsio::graph {
namespace {

std::string shape_of(const Tensor& tensor) {
  return shape_text(std::vector<std::size_t>(tensor.shape.begin(), tensor.shape.end()));
}

/// Whether the features are the innermost axis, as every layer requires them.
bool ends_in_features(const Signal& signal) {
  if (signal.axes.empty()) return false;
  const Axis& last = signal.axes.back();
  return signal.width == 1 ? last.empty() : last.size() == 1 && last.front().label == kFeatureLabel;
}

Axis feature_axis(std::size_t width) {
  return width == 1 ? Axis{} : Axis{{kFeatureLabel, static_cast<std::int64_t>(width)}};
}

/// Rows in blocks of `units`, brought into another order of blocks.
template <std::size_t kGates>
std::vector<double> reordered(const double* rows, std::size_t block,
                              const std::array<std::size_t, kGates>& order) {
  std::vector<double> result;
  result.reserve(kGates * block);
  for (const std::size_t gate : order)
    result.insert(result.end(), rows + gate * block, rows + (gate + 1) * block);
  return result;
}

// Positions of torsio's gates (i, f, g, o; r, z, n) among ONNX's (i, o, f, c; z, r, h).
constexpr std::array<std::size_t, 4> kLstmGates{0, 2, 3, 1};
constexpr std::array<std::size_t, 3> kGruGates{1, 0, 2};

std::vector<double> in_our_order(const std::string& op, const double* rows, std::size_t block) {
  return op == "LSTM" ? reordered(rows, block, kLstmGates) : reordered(rows, block, kGruGates);
}

bool same_letters(std::string_view a, std::string_view b) {
  return std::ranges::equal(
      a, b, [](unsigned char x, unsigned char y) { return std::tolower(x) == std::tolower(y); });
}

}  // namespace

Signal Evaluator::dense(const Node& node, const Signal& from, Matrix weights,
                        std::vector<double> bias) {
  if (!ends_in_features(from))
    refuse(graph_, node, "the channels as the last axis", "another one",
           "A layer must act on each sample's channels.");
  if (weights.columns != from.width)
    refuse(graph_, node, fmt::format("weights for {} inputs", from.width),
           fmt::format("for {}", weights.columns));
  Signal result = from;
  result.width = weights.rows;
  result.axes.back() = feature_axis(result.width);
  return appended(node, std::move(result), DenseStage{std::move(weights), std::move(bias)});
}

Value Evaluator::matmul(const Node& node) {
  const Signal& from = signal(node, 0);
  const Tensor& weights = constant(node, 1);
  if (weights.shape.size() != 2 || weights.values.empty())
    refuse(graph_, node, "a matrix of weights", "shape " + shape_of(weights));
  Matrix matrix;
  matrix.rows = static_cast<std::size_t>(weights.shape[1]);
  matrix.columns = static_cast<std::size_t>(weights.shape[0]);
  matrix.values = transposed(weights, {1, 0}).values;
  std::vector<double> bias(matrix.rows, 0.0);
  return dense(node, from, std::move(matrix), std::move(bias));
}

Value Evaluator::gemm(const Node& node) {
  const Signal& from = signal(node, 0);
  if (integer(node, "transA", 0) != 0 || from.axes.size() != 2)
    refuse(graph_, node, "rows of samples, not transposed", "something else");
  Tensor weights = constant(node, 1);
  if (weights.shape.size() != 2 || weights.values.empty())
    refuse(graph_, node, "a matrix of weights", "shape " + shape_of(weights));
  if (integer(node, "transB", 0) == 0) weights = transposed(weights, {1, 0});
  Matrix matrix;
  matrix.rows = static_cast<std::size_t>(weights.shape[0]);
  matrix.columns = static_cast<std::size_t>(weights.shape[1]);
  matrix.values = std::move(weights.values);
  for (double& weight : matrix.values) weight *= number(node, "alpha", 1.0);
  std::vector<double> bias(matrix.rows, 0.0);
  if (has_input(node, 2)) {
    const Tensor& added = constant(node, 2);
    const std::size_t count = added.values.size();
    if (added.shape.size() > 2 || (count != 1 && count != bias.size()) ||
        (added.shape.size() == 2 && added.shape[0] != 1))
      refuse(graph_, node, fmt::format("a bias of {} numbers", bias.size()),
             "shape " + shape_of(added));
    for (std::size_t i = 0; i < bias.size(); ++i)
      bias[i] = number(node, "beta", 1.0) * added.values[count == 1 ? 0 : i];
  }
  return dense(node, from, std::move(matrix), std::move(bias));
}

std::vector<double> Evaluator::by_feature(const Node& node, Signal& from,
                                          const Tensor& tensor) const {
  // A constant of more axes adds axes of size 1 in front.
  while (from.axes.size() < tensor.shape.size() && tensor.values.size() <= from.width)
    from.axes.insert(from.axes.begin(), Axis{});
  if (tensor.values.size() == 1) {
    std::vector<double> same(from.width, tensor.values.front());
    return same;
  }
  if (!ends_in_features(from) || tensor.values.size() != from.width || tensor.shape.empty() ||
      tensor.shape.back() != static_cast<std::int64_t>(from.width))
    refuse(graph_, node, fmt::format("one number, or {}: one per channel", from.width),
           "shape " + shape_of(tensor));
  return tensor.values;
}

Signal Evaluator::affine(const Node& node, const Signal& from, std::vector<double> gain,
                         std::vector<double> offset) {
  // A single number applies to all channels.
  gain.resize(from.width, gain.front());
  offset.resize(from.width, offset.front());
  for (std::size_t j = 0; j < from.width; ++j)
    if (!std::isfinite(gain[j]) || !std::isfinite(offset[j]) || is_symbol(gain[j]) ||
        is_symbol(offset[j]))
      refuse(graph_, node, "finite numbers", "others");
  return appended(node, from, AffineStage{std::move(gain), std::move(offset)});
}

Value Evaluator::add(const Node& node) {
  const bool is_first = !std::holds_alternative<Tensor>(input(node, 0));
  const Value& value = input(node, is_first ? 0 : 1);
  const Tensor& added = constant(node, is_first ? 1 : 0);
  if (const auto* const magnitude = std::get_if<Magnitude>(&value)) {
    if (added.values != std::vector<double>{1.0})
      refuse(graph_, node, "1 + |x| of a softsign", "another number");
    return Magnitude{magnitude->signal, magnitude->added + 1.0};
  }
  Signal from = signal(node, is_first ? 0 : 1);
  std::vector<double> offset = by_feature(node, from, added);
  return affine(node, from, {1.0}, std::move(offset));
}

Value Evaluator::subtract(const Node& node) {
  const bool is_first = !std::holds_alternative<Tensor>(input(node, 0));
  Signal from = signal(node, is_first ? 0 : 1);
  std::vector<double> offset = by_feature(node, from, constant(node, is_first ? 1 : 0));
  if (!is_first) return affine(node, from, {-1.0}, std::move(offset));
  for (double& value : offset) value = -value;
  return affine(node, from, {1.0}, std::move(offset));
}

Value Evaluator::multiply(const Node& node) {
  const bool is_first = !std::holds_alternative<Tensor>(input(node, 0));
  Signal from = signal(node, is_first ? 0 : 1);
  std::vector<double> gain = by_feature(node, from, constant(node, is_first ? 1 : 0));
  return affine(node, from, std::move(gain), {0.0});
}

Value Evaluator::divide(const Node& node) {
  Signal from = signal(node, 0);
  if (const auto* const below = std::get_if<Magnitude>(&input(node, 1))) {
    if (below->added != 1.0 || below->signal != from)
      refuse(graph_, node, "x / (1 + |x|), a softsign", "another quotient");
    return appended(node, std::move(from), ActivationStage{Activation::softsign});
  }
  std::vector<double> gain = by_feature(node, from, constant(node, 1));
  for (double& value : gain) value = 1.0 / value;
  return affine(node, from, std::move(gain), {0.0});
}

Value Evaluator::magnitude(const Node& node) { return Magnitude{signal(node, 0)}; }

Value Evaluator::activation(const Node& node) {
  if (node.op == "Elu" && number(node, "alpha", 1.0) != 1.0)
    refuse(graph_, node, "alpha 1", fmt::format("{}", number(node, "alpha", 1.0)));
  return appended(node, signal(node, 0), ActivationStage{activation_of(lower(node.op))});
}

void Evaluator::check_recurrent(const Node& node) const {
  const bool is_lstm = node.op == "LSTM";
  for (const auto& [name, attribute] : node.attributes) {
    if (name == "direction" && attribute.texts == std::vector<std::string>{"forward"}) continue;
    if (name == "activations") {
      const std::vector<std::string> usual =
          is_lstm ? std::vector<std::string>{"Sigmoid", "Tanh", "Tanh"}
                  : std::vector<std::string>{"Sigmoid", "Tanh"};
      if (std::ranges::equal(attribute.texts, usual, same_letters)) continue;
    }
    if (name == "input_forget" && integer(node, "input_forget", 0) == 0) continue;
    if (name == "hidden_size" || name == "layout" || (!is_lstm && name == "linear_before_reset"))
      continue;
    refuse(graph_, node, "a forward layer with sigmoid and tanh, without clipping",
           fmt::format("the attribute {}", name));
  }
  if (!is_lstm && integer(node, "linear_before_reset", 0) == 0)
    refuse(graph_, node, "linear_before_reset 1, as in PyTorch and in Keras with reset_after",
           "0: a reset gate in front of the recurrent weights",
           "Train with reset_after=True, Keras' default.");
  if (has_input(node, 4))
    refuse(graph_, node, "no lengths of sequences", fmt::format("'{}'", node.inputs[4]),
           "Export without masking: a stream has no end.");
  if (is_lstm && has_input(node, 7))
    refuse(graph_, node, "no peepholes", fmt::format("'{}'", node.inputs[7]));
}

RecurrentStage Evaluator::recurrent_stage(const Node& node, std::size_t inputs) const {
  const bool is_lstm = node.op == "LSTM";
  const std::size_t gates = is_lstm ? 4 : 3;
  const Tensor& input_weights = constant(node, 1);
  const Tensor& recurrent_weights = constant(node, 2);
  const std::size_t units = recurrent_weights.shape.size() == 3
                                ? static_cast<std::size_t>(recurrent_weights.shape[2])
                                : 0;
  const auto check = [&](const Tensor& tensor, std::vector<std::int64_t> shape, const char* what) {
    if (tensor.shape != shape || tensor.values.empty())
      refuse(graph_, node,
             fmt::format("{} of shape {}", what, shape_of(Tensor{std::move(shape), {}})),
             shape_of(tensor));
  };
  const auto rows = static_cast<std::int64_t>(gates * units);
  check(recurrent_weights, {1, rows, static_cast<std::int64_t>(units)}, "recurrent weights");
  check(input_weights, {1, rows, static_cast<std::int64_t>(inputs)}, "input weights");
  const std::int64_t hidden = integer(node, "hidden_size", static_cast<std::int64_t>(units));
  if (hidden != static_cast<std::int64_t>(units))
    refuse(graph_, node, fmt::format("hidden_size {}", units), fmt::format("{}", hidden));

  RecurrentStage stage;
  stage.kind = is_lstm ? RecurrentStage::Kind::lstm : RecurrentStage::Kind::gru;
  stage.input_weights.rows = stage.recurrent_weights.rows = gates * units;
  stage.input_weights.columns = inputs;
  stage.recurrent_weights.columns = units;
  stage.input_weights.values = in_our_order(node.op, input_weights.values.data(), units * inputs);
  stage.recurrent_weights.values =
      in_our_order(node.op, recurrent_weights.values.data(), units * units);
  stage.input_bias.assign(gates * units, 0.0);
  stage.recurrent_bias = stage.input_bias;
  if (has_input(node, 3)) {
    const Tensor& bias = constant(node, 3);
    check(bias, {1, 2 * rows}, "biases");
    stage.input_bias = in_our_order(node.op, bias.values.data(), units);
    stage.recurrent_bias = in_our_order(node.op, bias.values.data() + rows, units);
  }
  return stage;
}

Value Evaluator::recurrent(const Node& node) {
  check_recurrent(node);
  const Signal& from = signal(node, 0);
  if (from.axes.size() != 3 || !ends_in_features(from))
    refuse(graph_, node, "time, batch and channels", "other axes");
  const bool is_batch_first = integer(node, "layout", 0) == 1;
  const Axis& along = from.axes[is_batch_first ? 1 : 0];
  const Axis& across = from.axes[is_batch_first ? 0 : 1];
  if (along.size() > 1 || (from.width > 1 && along == feature_axis(from.width)))
    refuse(graph_, node, "one axis of time", "a mixture");
  const int time = along.empty() ? kUnitLabel : along.front().label;
  if (from.is_last_sample || (from.time && *from.time != time))
    refuse(graph_, node, "all recurrent layers along one axis, over all of its samples",
           "layers along different ones",
           "Stack layers that return sequences; batch_first must be what the data are.");
  for (std::size_t i = 5; i < 7; ++i) {
    if (!has_input(node, i)) continue;
    const Value& start = input(node, i);
    const auto* const tensor = std::get_if<Tensor>(&start);
    const bool is_zero =
        tensor != nullptr && std::ranges::all_of(tensor->values, [](double x) { return x == 0.0; });
    if (std::holds_alternative<Signal>(start) || std::holds_alternative<Magnitude>(start) ||
        (tensor != nullptr && !is_zero))
      refuse(graph_, node, "a start from zeros, or from a state that the graph is given",
             fmt::format("'{}'", node.inputs[i]));
  }
  const bool has_states = has_input(node, 5) && std::holds_alternative<State>(input(node, 5));
  starts_from_zeros_ = starts_from_zeros_ || !has_states;
  if (!has_states) {
    const std::optional<std::int64_t> samples = along.empty() ? 1 : along.front().size;
    if (samples) window_ = static_cast<std::size_t>(*samples);
  }

  RecurrentStage stage = recurrent_stage(node, from.width);
  Signal every = from;
  every.time = time;
  every.width = stage.recurrent_weights.columns;
  every = appended(node, std::move(every), std::move(stage));
  const Axis units = feature_axis(every.width);
  Signal last = every;
  last.is_last_sample = time != kUnitLabel;
  if (is_batch_first) {
    every.axes = {across, along, Axis{}, units};
    last.axes = {across, Axis{}, units};
  } else {
    every.axes = {along, Axis{}, across, units};
    last.axes = {Axis{}, across, units};
  }
  if (!node.outputs.empty() && !node.outputs[0].empty()) values_[node.outputs[0]] = every;
  if (node.outputs.size() > 1 && !node.outputs[1].empty()) values_[node.outputs[1]] = last;
  return every;
}

}  // namespace torsio::graph

#include "import/graph_evaluator.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <utility>

#include "core/checks.hpp"

namespace torsio::graph {
namespace {

constexpr std::size_t kMaxRank = 8;
constexpr std::size_t kMaxNodes = 10000;
constexpr std::size_t kMaxStages = 8 * kMaxLayers;

}  // namespace

std::string title(const Node& node) {
  std::string name = node.name;
  if (name.empty() && !node.outputs.empty()) name = node.outputs.front();
  return fmt::format("node '{}' ({})", name, node.op);
}

void refuse(const Graph& graph, const Node& node, const std::string& expected,
            const std::string& found, const std::string& advice) {
  torsio::refuse({graph.place, title(node)}, expected, found, advice);
}

std::int64_t integer(const Node& node, const char* attribute, std::int64_t otherwise) {
  const auto found = node.attributes.find(attribute);
  return found == node.attributes.end() || found->second.integers.empty()
             ? otherwise
             : found->second.integers.front();
}

double number(const Node& node, const char* attribute, double otherwise) {
  const auto found = node.attributes.find(attribute);
  return found == node.attributes.end() || found->second.numbers.empty()
             ? otherwise
             : found->second.numbers.front();
}

std::size_t axis_of(const Graph& graph, const Node& node, std::int64_t axis, std::size_t rank) {
  const auto count = static_cast<std::int64_t>(rank);
  if (axis < -count || axis >= count)
    refuse(graph, node, fmt::format("an axis of the {} that there are", rank),
           fmt::format("{}", axis));
  return static_cast<std::size_t>(axis < 0 ? axis + count : axis);
}

Evaluator::Evaluator(const Graph& graph) : graph_(graph) {
  for (const auto& [name, tensor] : graph.constants) values_[name] = tensor;
  for (const Graph::Input& input : graph.inputs) values_[input.name] = State{};
  if (graph.inputs.empty())
    throw Error({.place = graph.place, .expected = "a graph with an input", .found = "none"});
  const Graph::Input& first = graph.inputs.front();
  const std::size_t rank = first.shape.size();
  if (rank == 0 || rank > kMaxRank || !first.shape.back() || *first.shape.back() < 1)
    throw Error({.place = fmt::format("{}: input '{}'", graph.place, first.name),
                 .expected = "a last axis of known size: the network's inputs",
                 .found = rank == 0 ? "no axis" : "another shape",
                 .advice = "Export with a fixed number of inputs; only batch and time may vary."});
  if (*first.shape.back() > static_cast<std::int64_t>(kMaxUnits))
    throw Error({.place = fmt::format("{}: input '{}'", graph.place, first.name),
                 .expected = fmt::format("at most {} inputs", kMaxUnits),
                 .found = fmt::format("{}", *first.shape.back())});
  Signal signal;
  for (std::size_t i = 0; i < rank; ++i) {
    const bool is_last = i + 1 == rank;
    const Part part{is_last ? kFeatureLabel : static_cast<int>(i), first.shape[i]};
    signal.axes.push_back(part.size == 1 ? Axis{} : Axis{part});
  }
  signal.width = static_cast<std::size_t>(*first.shape.back());
  values_[first.name] = std::move(signal);
}

const std::map<std::string_view, Evaluator::Method>& Evaluator::methods() {
  using E = Evaluator;
  static const std::map<std::string_view, Method> all{{"Abs", &E::magnitude},
                                                      {"Add", &E::add},
                                                      {"Cast", &E::cast},
                                                      {"Concat", &E::concat},
                                                      {"Constant", &E::constant_node},
                                                      {"ConstantOfShape", &E::constant_of_shape},
                                                      {"Div", &E::divide},
                                                      {"Dropout", &E::dropout},
                                                      {"Elu", &E::activation},
                                                      {"Expand", &E::expand},
                                                      {"Flatten", &E::flatten},
                                                      {"GRU", &E::recurrent},
                                                      {"Gather", &E::gather},
                                                      {"Gemm", &E::gemm},
                                                      {"Identity", &E::identity},
                                                      {"LSTM", &E::recurrent},
                                                      {"MatMul", &E::matmul},
                                                      {"Mul", &E::multiply},
                                                      {"Relu", &E::activation},
                                                      {"Reshape", &E::reshape},
                                                      {"Shape", &E::shape},
                                                      {"Slice", &E::slice},
                                                      {"Softsign", &E::activation},
                                                      {"Squeeze", &E::squeeze},
                                                      {"Sub", &E::subtract},
                                                      {"Tanh", &E::activation},
                                                      {"Transpose", &E::transpose},
                                                      {"Unsqueeze", &E::unsqueeze}};
  return all;
}

bool Evaluator::supports(std::string_view op) { return methods().contains(op); }

void Evaluator::evaluate(const Node& node) {
  if (node.outputs.empty()) return;
  Value value = (this->*methods().at(node.op))(node);
  // A recurrent node sets its own outputs.
  if (node.op != "LSTM" && node.op != "GRU") values_[node.outputs.front()] = std::move(value);
}

ForeignNetwork Evaluator::network(const std::string& output) {
  const Value* const value = find(output);
  const auto* const estimate = value == nullptr ? nullptr : std::get_if<Signal>(value);
  if (estimate == nullptr)
    throw Error({.place = fmt::format("{}: output '{}'", graph_.place, output),
                 .expected = "a value that the network computes from its first input",
                 .found = "another one",
                 .advice = "--output-name chooses among a graph's outputs."});
  const Signal& first = std::get<Signal>(values_.at(graph_.inputs.front().name));
  ForeignNetwork network{.place = graph_.place, .inputs = first.width};
  for (const std::size_t stage : estimate->stages) network.stages.push_back(stages_[stage]);
  network.window = window_;
  if (estimate->time && starts_from_zeros_)
    network.notes.push_back(
        window_ ? fmt::format(
                      "the graph starts every window of {} samples from the zero state; here the "
                      "state continues from sample to sample, so that the first {} samples after a "
                      "reset are the graph's",
                      *window_, *window_)
                : std::string(
                      "the graph starts every sequence from the zero state, as a reset does here"));
  return network;
}

const Value* Evaluator::find(const std::string& name) const {
  const auto found = values_.find(name);
  return found == values_.end() ? nullptr : &found->second;
}

bool Evaluator::has_input(const Node& node, std::size_t index) {
  return index < node.inputs.size() && !node.inputs[index].empty();
}

const Value& Evaluator::input(const Node& node, std::size_t index) const {
  if (!has_input(node, index))
    refuse(graph_, node, fmt::format("at least {} inputs", index + 1), "fewer");
  const Value* const value = find(node.inputs[index]);
  if (value == nullptr)
    refuse(graph_, node, "inputs that nodes before it make",
           fmt::format("'{}'", node.inputs[index]));
  return *value;
}

const Signal& Evaluator::signal(const Node& node, std::size_t index) const {
  const auto* const found = std::get_if<Signal>(&input(node, index));
  if (found == nullptr)
    refuse(graph_, node,
           fmt::format("'{}' to be computed from the network's input", node.inputs[index]),
           "something else");
  return *found;
}

const Tensor& Evaluator::constant(const Node& node, std::size_t index) const {
  const auto* const found = std::get_if<Tensor>(&input(node, index));
  if (found == nullptr)
    refuse(graph_, node, fmt::format("'{}' to be a constant", node.inputs[index]),
           "something that the graph computes or is given");
  return *found;
}

std::optional<std::vector<std::int64_t>> Evaluator::whole_numbers(
    const Node& node, std::size_t index, const std::string& attribute) const {
  if (has_input(node, index)) return whole_numbers(node, index);
  const auto found = node.attributes.find(attribute);
  if (found == node.attributes.end()) return std::nullopt;
  return found->second.integers;
}

std::vector<std::int64_t> Evaluator::whole_numbers(const Node& node, std::size_t index) const {
  constexpr double kMax = 9.2e18;  // symbols are beyond it
  std::vector<std::int64_t> numbers;
  for (const double value : constant(node, index).values) {
    if (!(std::abs(value) <= kMax))
      refuse(graph_, node, "numbers that are known when the graph is read", "others");
    numbers.push_back(static_cast<std::int64_t>(value));
  }
  return numbers;
}

void Evaluator::reserve(const Node& node, std::size_t count) {
  constexpr std::size_t kMax = kMaxForeignBytes / sizeof(float);
  if (count > kMax || folded_ + count > kMax)
    refuse(graph_, node, fmt::format("at most {} numbers made from constants", kMax), "more");
  folded_ += count;
}

Tensor Evaluator::copy_of(const Node& node, const Tensor& tensor) {
  reserve(node, tensor.values.size());
  return tensor;
}

Tensor Evaluator::taken_from(const Node& node, const Tensor& tensor, std::size_t axis,
                             const std::vector<std::size_t>& indices) {
  if (!tensor.values.empty())
    reserve(node,
            tensor.values.size() / static_cast<std::size_t>(tensor.shape[axis]) * indices.size());
  return taken(tensor, axis, indices);
}

Signal Evaluator::appended(const Node& node, Signal signal, ForeignStage stage) {
  if (signal.stages.size() >= kMaxStages)
    refuse(graph_, node, fmt::format("at most {} stages", kMaxStages), "more");
  signal.stages.push_back(stages_.size());
  stages_.push_back(std::move(stage));
  return signal;
}

namespace {

/// The node that makes each name.
std::map<std::string, const Node*> makers_of(const Graph& graph) {
  std::set<std::string> given;
  for (const Graph::Input& input : graph.inputs) given.insert(input.name);
  std::map<std::string, const Node*> makers;
  for (const Node& node : graph.nodes)
    for (const std::string& name : node.outputs)
      if (!name.empty() && (given.contains(name) || graph.constants.contains(name) ||
                            !makers.emplace(name, &node).second))
        refuse(graph, node, "outputs of its own", fmt::format("'{}' again", name));
  return makers;
}

/// Only what the output needs is looked at.
std::set<const Node*> needed(const Graph& graph, const std::string& output) {
  const std::map<std::string, const Node*> makers = makers_of(graph);
  std::set<const Node*> nodes;
  std::vector<std::string> open{output};
  while (!open.empty()) {
    const auto maker = makers.find(open.back());
    open.pop_back();
    if (maker == makers.end() || !nodes.insert(maker->second).second) continue;
    for (const std::string& name : maker->second->inputs)
      if (!name.empty()) open.push_back(name);
  }
  return nodes;
}

}  // namespace

ForeignNetwork network_of(const Graph& graph, const std::string& output) {
  if (graph.nodes.size() > kMaxNodes)
    throw Error({.place = graph.place,
                 .expected = fmt::format("at most {} nodes", kMaxNodes),
                 .found = fmt::format("{}", graph.nodes.size())});
  if (graph.outputs.empty())
    throw Error({.place = graph.place, .expected = "a graph with an output", .found = "none"});
  const std::string& wanted = output.empty() ? graph.outputs.front() : output;
  if (std::ranges::find(graph.outputs, wanted) == graph.outputs.end())
    throw UsageError({.place = "--output-name",
                      .expected = fmt::format("one of {}", fmt::join(graph.outputs, ", ")),
                      .found = fmt::format("'{}'", wanted)});
  const std::set<const Node*> is_needed = needed(graph, wanted);
  std::string unknown;
  for (const Node& node : graph.nodes)
    if (is_needed.contains(&node) && !Evaluator::supports(node.op))
      unknown += (unknown.empty() ? "" : ", ") + title(node);
  if (!unknown.empty())
    throw Error(
        {.place = graph.place,
         .expected = "dense, LSTM and GRU layers with relu, tanh, softsign or elu between them",
         .found = "what is not supported: " + unknown,
         .advice = "docs/models/import.md lists what is; move the rest out of the graph."});

  Evaluator evaluator(graph);
  for (const Node& node : graph.nodes)
    if (is_needed.contains(&node)) evaluator.evaluate(node);
  return evaluator.network(wanted);
}

}  // namespace torsio::graph

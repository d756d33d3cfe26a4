#include "export/graph/graph_builder.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <utility>

namespace torsio {
namespace {

using GraphIndex = StepGraph::Index;
using GraphNode = StepGraph::Node;
using GraphType = StepGraph::Type;

std::string key_of(const GraphNode& node) {
  std::string key =
      fmt::format("{} {} {} {} {}:", static_cast<int>(node.operation), static_cast<int>(node.type),
                  node.width, node.first, fmt::join(node.operands, ","));
  for (const double value : node.values.values)
    key += fmt::format(" {:x}", std::bit_cast<std::uint64_t>(value));
  return key + fmt::format(" {}", node.values.rows);
}

Row binary(GraphOperation operation, GraphType type, Row a, Row b) {
  return a.graph->node(operation, type, std::max(a.width(), b.width()), {a.index, b.index});
}

Row computed(GraphOperation operation, Row a, Row b) {
  return binary(operation, a.graph->at(a.index).type, a, b);
}

Row computed(GraphOperation operation, Row a) {
  return a.graph->node(operation, a.graph->at(a.index).type, a.width(), {a.index});
}

/// A number of the type of the row beside it.
Row beside(Row a, double value) {
  return a.graph->constant(Matrix(1, 1, value), a.graph->at(a.index).type);
}

bool is_number(Row a, double value) {
  const GraphNode& node = a.graph->at(a.index);
  return node.operation == GraphOperation::constant && node.type != GraphType::truth &&
         node.values.values.size() == 1 && node.values.values.front() == value;
}

}  // namespace

std::string_view name(GraphOperation operation) noexcept {
  switch (operation) {
    case GraphOperation::input: return "input";
    case GraphOperation::state: return "state";
    case GraphOperation::timestep: return "timestep";
    case GraphOperation::constant: return "constant";
    case GraphOperation::add: return "add";
    case GraphOperation::subtract: return "subtract";
    case GraphOperation::multiply: return "multiply";
    case GraphOperation::divide: return "divide";
    case GraphOperation::minimum: return "minimum";
    case GraphOperation::maximum: return "maximum";
    case GraphOperation::power: return "power";
    case GraphOperation::negate: return "negate";
    case GraphOperation::absolute: return "absolute";
    case GraphOperation::sign: return "sign";
    case GraphOperation::square_root: return "square_root";
    case GraphOperation::exponential: return "exponential";
    case GraphOperation::tangent: return "tangent";
    case GraphOperation::sigmoid: return "sigmoid";
    case GraphOperation::sine: return "sine";
    case GraphOperation::cosine: return "cosine";
    case GraphOperation::arc_tangent: return "arc_tangent";
    case GraphOperation::less: return "less";
    case GraphOperation::less_or_equal: return "less_or_equal";
    case GraphOperation::both: return "both";
    case GraphOperation::either: return "either";
    case GraphOperation::is_not: return "is_not";
    case GraphOperation::select: return "select";
    case GraphOperation::product: return "product";
    case GraphOperation::interpolation: return "interpolation";
    case GraphOperation::held_interpolation: return "held_interpolation";
    case GraphOperation::sum: return "sum";
    case GraphOperation::largest: return "largest";
    case GraphOperation::part: return "part";
    case GraphOperation::joined: return "joined";
    case GraphOperation::to_real: return "to_real";
    case GraphOperation::to_wide: return "to_wide";
    case GraphOperation::to_single: break;
  }
  return "to_single";
}

std::size_t Row::width() const { return graph->at(index).width; }

bool Row::is_constant() const { return graph->at(index).operation == GraphOperation::constant; }

Row Row::part(std::size_t first, std::size_t count) const {
  const GraphNode& node = graph->at(index);
  if (first == 0 && count == node.width) return *this;
  if (node.operation == GraphOperation::constant && node.values.rows == 1) {
    Matrix values(1, count);
    for (std::size_t j = 0; j < count; ++j) values(0, j) = node.values(0, first + j);
    return graph->constant(std::move(values), node.type);
  }
  return graph->node(GraphOperation::part, node.type, count, {index}, first);
}

GraphBuilder::GraphBuilder(GraphPrecision precision) {
  graph_.precision = precision;
  node(GraphOperation::input, state_type(), 0, {});
  node(GraphOperation::state, state_type(), 0, {});
}

StepGraph::Type GraphBuilder::state_type() const noexcept {
  return graph_.precision == GraphPrecision::mixed ? GraphType::wide : GraphType::real;
}

StepGraph::Type GraphBuilder::number_type() const noexcept {
  return is_wide_ ? state_type() : GraphType::real;
}

Row GraphBuilder::added(GraphNode node, const std::string& key) {
  const auto [at, is_new] = known_.try_emplace(key, static_cast<GraphIndex>(graph_.nodes.size()));
  if (is_new) graph_.nodes.push_back(std::move(node));
  return {this, at->second};
}

Row GraphBuilder::node(GraphOperation operation, GraphType type, std::size_t width,
                       std::vector<GraphIndex> operands, std::size_t first) {
  GraphNode node{.operation = operation,
                 .type = type,
                 .width = width,
                 .operands = std::move(operands),
                 .first = first};
  const std::string key = key_of(node);
  return added(std::move(node), key);
}

Row GraphBuilder::input(std::size_t width) {
  graph_.nodes[0].width = width;
  return {this, 0};
}

Row GraphBuilder::timestep() { return node(GraphOperation::timestep, state_type(), 1, {}); }

Row GraphBuilder::constant(Matrix values, GraphType type) {
  GraphNode node{
      .operation = GraphOperation::constant, .type = type, .width = values.columns, .values = {}};
  node.values = std::move(values);
  const std::string key = key_of(node);
  return added(std::move(node), key);
}

Row GraphBuilder::constant(Matrix values) { return constant(std::move(values), number_type()); }
Row GraphBuilder::single_constant(Matrix values) {
  return constant(std::move(values), GraphType::single);
}
Row GraphBuilder::constant(double value) { return constant(Matrix(1, 1, value)); }

Row GraphBuilder::constant(std::span<const double> values) {
  Matrix row(1, values.size());
  std::ranges::copy(values, row.values.begin());
  return constant(std::move(row));
}

Row GraphBuilder::truth(bool value) {
  return constant(Matrix(1, 1, value ? 1.0 : 0.0), GraphType::truth);
}

Row GraphBuilder::as_type(Row row, GraphType type) {
  if (at(row.index).type == type) return row;
  if (type == GraphType::single) return to_single(row);
  return node(type == GraphType::wide ? GraphOperation::to_wide : GraphOperation::to_real, type,
              row.width(), {row.index});
}

void GraphBuilder::begin_scope(Row restarts) {
  scope_ = {.first = graph_.state_width, .first_part = graph_.state.size()};
  // Widths follow at the end. Two scopes are never equal: the place of the first state differs, or the first is empty.
  const Row before = node(GraphOperation::part, state_type(), 0, {1}, scope_.first);
  Row cleared = before;
  // A state is finite, so that a factor clears it: a selection takes longer.
  if (!restarts.is_constant())
    cleared = node(GraphOperation::multiply, state_type(), 0,
                   {before.index, as_type(is_not(restarts), state_type()).index});
  scope_.before = before.index;
  scope_.cleared = cleared.index;
  scope_.read = as_type(cleared, number_type()).index;
}

GraphBuilder::Scope GraphBuilder::end_scope() {
  scope_.end_part = graph_.state.size();
  for (const GraphIndex index : {scope_.before, scope_.cleared, scope_.read})
    graph_.nodes[index].width = graph_.state_width - scope_.first;
  return scope_;
}

void GraphBuilder::finish(const Scope& scope, Row keeps, Row clears) {
  if (scope.first_part == scope.end_part) return;
  std::vector<Row> next;
  for (std::size_t i = scope.first_part; i < scope.end_part; ++i)
    next.push_back({this, next_.at(graph_.state[i].name)});
  const auto is_real = [this](Row row) { return at(row.index).type == GraphType::real; };
  if (!std::ranges::all_of(next, is_real))
    for (Row& row : next) row = as_type(row, state_type());
  const Row own = as_type(joined(next), state_type());
  const Row before{this, scope.before};
  const Row kept = clears.is_constant() ? before : before * as_type(keeps, state_type());
  finished_[scope.first] = select(either(keeps, clears), kept, own).index;
}

Row GraphBuilder::state(const std::string& name, std::size_t width) {
  const std::size_t first = graph_.state_width;
  graph_.state.push_back({name, first, width});
  graph_.state_width += width;
  const GraphIndex read = number_type() == state_type() ? scope_.cleared : scope_.read;
  return node(GraphOperation::part, number_type(), width, {read}, first - scope_.first);
}

Row GraphBuilder::truth_state(const std::string& name) { return 0.5 < state(name); }

void GraphBuilder::set_state(const std::string& name, Row next) {
  next_[name] = as_type(next, number_type()).index;
}

StepGraph GraphBuilder::finished(Row value, Row std_dev, Row fault) {
  std::vector<Row> next;
  for (const auto& [column, index] : finished_) next.push_back({this, index});
  graph_.nodes[1].width = graph_.state_width;
  const Row all = next.empty() ? Row{this, 1} : joined(next);
  std::vector<bool> is_used(graph_.nodes.size(), false);
  for (const GraphIndex index :
       {GraphIndex{0}, GraphIndex{1}, value.index, std_dev.index, fault.index, all.index})
    is_used[index] = true;
  for (std::size_t i = graph_.nodes.size(); i-- > 0;)
    if (is_used[i])
      for (const GraphIndex operand : graph_.nodes[i].operands) is_used[operand] = true;
  std::vector<GraphIndex> place(graph_.nodes.size());
  StepGraph pruned = graph_;
  pruned.nodes.clear();
  for (std::size_t i = 0; i < graph_.nodes.size(); ++i) {
    if (!is_used[i]) continue;
    place[i] = static_cast<GraphIndex>(pruned.nodes.size());
    pruned.nodes.push_back(graph_.nodes[i]);
    GraphNode& node = pruned.nodes.back();
    node.is_common =
        node.operation != GraphOperation::input && node.operation != GraphOperation::state;
    for (GraphIndex& operand : node.operands) {
      operand = place[operand];
      node.is_common = node.is_common && pruned.nodes[operand].is_common;
    }
  }
  pruned.value = place[value.index];
  pruned.std_dev = place[std_dev.index];
  pruned.fault = place[fault.index];
  pruned.next_state = place[all.index];
  return pruned;
}

Row operator+(Row a, Row b) {
  if (is_number(a, 0.0) && b.width() >= a.width()) return b;
  if (is_number(b, 0.0)) return a;
  return computed(GraphOperation::add, a, b);
}
Row operator-(Row a, Row b) { return computed(GraphOperation::subtract, a, b); }
Row operator*(Row a, Row b) {
  if (is_number(a, 1.0)) return b;
  if (is_number(b, 1.0)) return a;
  return computed(GraphOperation::multiply, a, b);
}
Row operator/(Row a, Row b) { return computed(GraphOperation::divide, a, b); }
Row operator<(Row a, Row b) { return binary(GraphOperation::less, GraphType::truth, a, b); }
Row operator<=(Row a, Row b) {
  return binary(GraphOperation::less_or_equal, GraphType::truth, a, b);
}
Row operator+(Row a, double b) { return a + beside(a, b); }
Row operator-(Row a, double b) { return b == 0.0 ? a : a - beside(a, b); }
Row operator*(Row a, double b) { return a * beside(a, b); }
Row operator<(Row a, double b) { return a < beside(a, b); }
Row operator<=(Row a, double b) { return a <= beside(a, b); }
Row operator-(double a, Row b) { return beside(b, a) - b; }
Row operator<(double a, Row b) { return beside(b, a) < b; }
Row operator-(Row a) { return computed(GraphOperation::negate, a); }

Row minimum(Row a, Row b) { return computed(GraphOperation::minimum, a, b); }
Row maximum(Row a, Row b) { return computed(GraphOperation::maximum, a, b); }
Row minimum(Row a, double b) { return minimum(a, beside(a, b)); }
Row maximum(Row a, double b) { return maximum(a, beside(a, b)); }
Row power(Row a, Row b) { return computed(GraphOperation::power, a, b); }
Row absolute(Row a) { return computed(GraphOperation::absolute, a); }
Row square_root(Row a) { return computed(GraphOperation::square_root, a); }
Row exponential(Row a) { return computed(GraphOperation::exponential, a); }
Row tangent(Row a) { return computed(GraphOperation::tangent, a); }
Row sigmoid(Row a) { return computed(GraphOperation::sigmoid, a); }
Row limited(Row a, Row lowest, Row highest) { return maximum(minimum(a, highest), lowest); }
Row limited(Row a, double lowest, double highest) {
  return limited(a, beside(a, lowest), beside(a, highest));
}
Row both(Row a, Row b) {
  if (a.index == b.index) return a;
  for (const auto& [one, other] : {std::pair(a, b), std::pair(b, a)})
    if (one.is_constant())
      return one.graph->at(one.index).values.values.front() != 0.0 ? other : one;
  return binary(GraphOperation::both, GraphType::truth, a, b);
}
Row either(Row a, Row b) {
  if (a.index == b.index) return a;
  for (const auto& [one, other] : {std::pair(a, b), std::pair(b, a)})
    if (one.is_constant())
      return one.graph->at(one.index).values.values.front() != 0.0 ? one : other;
  return binary(GraphOperation::either, GraphType::truth, a, b);
}
Row is_not(Row a) {
  if (a.is_constant()) return a.graph->truth(a.graph->at(a.index).values.values.front() == 0.0);
  return computed(GraphOperation::is_not, a);
}
Row select(Row where, Row yes, Row no) {
  if (yes.index == no.index) return yes;
  if (where.is_constant())
    return where.graph->at(where.index).values.values.front() != 0.0 ? yes : no;
  return where.graph->node(GraphOperation::select, where.graph->at(yes.index).type,
                           std::max({where.width(), yes.width(), no.width()}),
                           {where.index, yes.index, no.index});
}
Row select(Row where, Row yes, double no) { return select(where, yes, beside(yes, no)); }
Row select(Row where, double yes, Row no) { return select(where, beside(no, yes), no); }
Row select(Row where, double yes, double no) {
  return select(where, where.graph->constant(yes), where.graph->constant(no));
}
Row is_finite(Row a) {
  // Also of a NaN, which is not less than anything.
  return absolute(a) < std::numeric_limits<double>::infinity();
}
// A sum of finite numbers may overflow, one of products with 0 does not.
Row all_finite(Row a) { return is_finite(a.width() == 1 ? a : sum(a * 0.0)); }
Row product(Row a, Row matrix) {
  return a.graph->node(GraphOperation::product, a.graph->at(a.index).type, matrix.width(),
                       {a.index, matrix.index});
}
Row sum(Row a) {
  if (a.width() == 1) return a;
  return a.graph->node(GraphOperation::sum, a.graph->at(a.index).type, 1, {a.index});
}
Row largest(Row a) {
  if (a.width() == 1) return a;
  return a.graph->node(GraphOperation::largest, a.graph->at(a.index).type, 1, {a.index});
}
Row dot(Row a, Row b) {
  if (a.width() == 1) return a * b;
  if (!a.is_constant() && !b.is_constant()) return sum(a * b);
  const Row of = a.is_constant() ? b : a;
  Matrix column = a.graph->at(a.is_constant() ? a.index : b.index).values;
  std::swap(column.rows, column.columns);
  return product(of, a.graph->constant(std::move(column), a.graph->at(of.index).type));
}
Row to_real(Row a) { return a.graph->as_type(a, GraphType::real); }
Row to_single(Row a) {
  return a.graph->node(GraphOperation::to_single, GraphType::single, a.width(), {a.index});
}
Row joined(std::span<const Row> rows) {
  if (rows.size() == 1) return rows.front();
  std::size_t width = 0;
  std::vector<GraphIndex> operands;
  for (const Row row : rows) {
    operands.push_back(row.index);
    width += row.width();
  }
  GraphBuilder* graph = rows.front().graph;
  const GraphType type = graph->at(operands.front()).type;
  return graph->node(GraphOperation::joined, type, width, std::move(operands));
}
Row hypotenuse(Row a, Row b) { return square_root(a * a + b * b); }
Row interpolated(Row x, std::span<const double> knots, Row table, bool is_held) {
  return x.graph->node(is_held ? GraphOperation::held_interpolation : GraphOperation::interpolation,
                       x.graph->at(x.index).type, table.width(),
                       {x.index, x.graph->constant(knots).index, table.index});
}

}  // namespace torsio

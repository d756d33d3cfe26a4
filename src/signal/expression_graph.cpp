#include "signal/expression_graph.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <utility>

#include "core/hyperbolic_tangent.hpp"
#include "torsio/core/units.hpp"

namespace torsio {
namespace {

Motion together(Motion left, Motion right) {
  if (left == Motion::none) return right;
  if (right == Motion::none) return left;
  return left == right ? left : Motion::other;
}

}  // namespace

double computed(Operation operation, double left, double right) noexcept {
  switch (operation) {
    case Operation::add: return left + right;
    case Operation::subtract: return left - right;
    case Operation::multiply: return left * right;
    case Operation::divide: return left / right;
    case Operation::power: return std::pow(left, right);
    case Operation::negate: return -left;
    case Operation::sign:
      if (left > 0.0) return 1.0;
      return left < 0.0 ? -1.0 : left;  // a zero or a NaN
    case Operation::tanh: return detail::hyperbolic_tangent(left);
    case Operation::sin: return std::sin(left);
    case Operation::cos: return std::cos(left);
    case Operation::atan: return std::atan(left);
    case Operation::abs: return std::abs(left);
    case Operation::sqrt: return std::sqrt(left);
    case Operation::exp: return std::exp(left);
    case Operation::min:  // written so that a NaN on either side stays one
      return left < right || std::isnan(left) ? left : right;
    case Operation::max: return left > right || std::isnan(left) ? left : right;
    case Operation::channel:
    case Operation::constant:
    case Operation::rate:
    case Operation::lowpass:
    case Operation::lag:
    case Operation::stop:
    case Operation::dahl: break;
  }
  return left;  // those are not computed from their operands alone
}

std::uint32_t ExpressionGraph::channel(std::string_view name) {
  const auto found = std::find(channels_.begin(), channels_.end(), name);
  const auto position = static_cast<std::uint32_t>(found - channels_.begin());
  if (found == channels_.end()) channels_.emplace_back(name);
  const std::uint32_t node = unique({.operation = Operation::channel, .left = position});
  declare_rate_if_named(node, name);
  return node;
}

void ExpressionGraph::declare_rate_if_named(std::uint32_t node, std::string_view name) {
  const auto parts = split_channel_name(name);
  if (parts && (parts->unit->si_suffix == "rad_s" || parts->unit->si_suffix == "m_s"))
    declared_rates_[node] = true;
}

std::uint32_t ExpressionGraph::constant(double value) { return unique({.parameter = value}); }

std::uint32_t ExpressionGraph::operation(Operation operation, std::uint32_t left,
                                         std::uint32_t right) {
  if (is_constant(left) && is_constant(right))
    return constant(computed(operation, nodes_[left].parameter, nodes_[right].parameter));
  // A square is exact to the last bit as a product, and many times faster than std::pow.
  if (operation == Operation::power && is_constant(right) && nodes_[right].parameter == 2.0)
    return this->operation(Operation::multiply, left, left);
  if ((operation == Operation::add || operation == Operation::multiply) && right < left)
    std::swap(left, right);
  return unique({.operation = operation, .left = left, .right = right});
}

std::uint32_t ExpressionGraph::memory(Operation operation, std::uint32_t operand,
                                      double parameter) {
  if (is_constant(operand)) {
    const bool is_of_changes = operation == Operation::rate || operation == Operation::stop ||
                               operation == Operation::dahl;
    return is_of_changes ? constant(0.0) : operand;
  }
  if (operation == Operation::lag && parameter == 0.0) return operand;
  return unique(
      {.operation = operation, .left = operand, .right = operand, .parameter = parameter});
}

std::uint32_t ExpressionGraph::unique(const Node& node) {
  const Key key{node.operation, node.left, node.right,
                std::bit_cast<std::uint64_t>(node.parameter)};
  const auto [entry, is_new] = index_.try_emplace(key, static_cast<std::uint32_t>(nodes_.size()));
  if (is_new) {
    nodes_.push_back(node);
    declared_rates_.push_back(false);
  }
  return entry->second;
}

std::vector<Motion> ExpressionGraph::motions() const {
  std::vector<Motion> motions(nodes_.size(), Motion::none);
  for (std::size_t i = 0; i < nodes_.size(); ++i) {
    const Node& node = nodes_[i];
    if (node.operation == Operation::constant) continue;
    if (declared_rates_[i] || node.operation == Operation::rate) {
      motions[i] = Motion::rate;
    } else if (node.operation == Operation::channel) {
      motions[i] = Motion::other;
    } else {
      motions[i] = together(motions[node.left], motions[node.right]);
    }
  }
  return motions;
}

}  // namespace torsio

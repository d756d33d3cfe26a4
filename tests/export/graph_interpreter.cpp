#include "export/graph_interpreter.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <stdexcept>

namespace torsio::test {

Estimate GraphInterpreter::step(const std::vector<double>& raw, double timestep_s) {
  timestep_s_ = timestep_s > 0.0 ? timestep_s : 1.0 / graph_.sample_rate_Hz;
  for (std::size_t i = 0; i < rows_.size(); ++i) rows_[i] = rounded(i, row_of(i, raw));
  state_ = rows_[graph_.next_state];
  return {.value = rows_[graph_.value].at(0),
          .std_dev = rows_[graph_.std_dev].at(0),
          .fault = static_cast<Fault>(rows_[graph_.fault].at(0))};
}

GraphInterpreter::Numbers GraphInterpreter::rounded(std::size_t index, Numbers row) const {
  const StepGraph::Node& node = graph_.nodes[index];
  if (row.size() != node.width) throw std::logic_error("a node has another width");
  const bool is_rounded =
      node.type == StepGraph::Type::single ||
      (node.type == StepGraph::Type::real && graph_.precision != GraphPrecision::twofold) ||
      (node.type == StepGraph::Type::wide && graph_.precision == GraphPrecision::single);
  if (is_rounded)
    for (double& x : row) x = static_cast<double>(static_cast<float>(x));
  return row;
}

GraphInterpreter::Numbers GraphInterpreter::row_of(std::size_t index, const Numbers& raw) const {
  using Op = GraphOperation;
  const StepGraph::Node& node = graph_.nodes[index];
  const auto operand = [&](std::size_t i) -> const Numbers& { return rows_[node.operands.at(i)]; };
  const auto at = [](const Numbers& row, std::size_t j) {
    return row.size() == 1 ? row[0] : row.at(j);
  };
  const auto by_column = [&](auto of) {
    Numbers out(node.width);
    for (std::size_t j = 0; j < node.width; ++j) out[j] = of(j);
    return out;
  };
  const auto a = [&](std::size_t j) { return at(operand(0), j); };
  const auto b = [&](std::size_t j) { return at(operand(1), j); };
  switch (node.operation) {
    case Op::input: return raw;
    case Op::state: return state_;
    case Op::timestep: return {timestep_s_};
    case Op::constant: return {node.values.row(0).begin(), node.values.row(0).end()};
    case Op::add: return by_column([&](std::size_t j) { return a(j) + b(j); });
    case Op::subtract: return by_column([&](std::size_t j) { return a(j) - b(j); });
    case Op::multiply: return by_column([&](std::size_t j) { return a(j) * b(j); });
    case Op::divide: return by_column([&](std::size_t j) { return a(j) / b(j); });
    case Op::minimum:
      return by_column(
          [&](std::size_t j) { return std::isnan(a(j)) ? a(j) : std::min(b(j), a(j)); });
    case Op::maximum:
      return by_column(
          [&](std::size_t j) { return std::isnan(a(j)) ? a(j) : std::max(b(j), a(j)); });
    case Op::power: return by_column([&](std::size_t j) { return std::pow(a(j), b(j)); });
    case Op::negate: return by_column([&](std::size_t j) { return -a(j); });
    case Op::absolute: return by_column([&](std::size_t j) { return std::abs(a(j)); });
    case Op::sign:
      return by_column([&](std::size_t j) { return a(j) > 0.0 ? 1.0 : a(j) < 0.0 ? -1.0 : a(j); });
    case Op::square_root: return by_column([&](std::size_t j) { return std::sqrt(a(j)); });
    case Op::exponential: return by_column([&](std::size_t j) { return std::exp(a(j)); });
    case Op::tangent: return by_column([&](std::size_t j) { return std::tanh(a(j)); });
    case Op::sigmoid:
      return by_column([&](std::size_t j) { return 1.0 / (1.0 + std::exp(-a(j))); });
    case Op::sine: return by_column([&](std::size_t j) { return std::sin(a(j)); });
    case Op::cosine: return by_column([&](std::size_t j) { return std::cos(a(j)); });
    case Op::arc_tangent: return by_column([&](std::size_t j) { return std::atan(a(j)); });
    case Op::less: return by_column([&](std::size_t j) { return a(j) < b(j) ? 1.0 : 0.0; });
    case Op::less_or_equal:
      return by_column([&](std::size_t j) { return a(j) <= b(j) ? 1.0 : 0.0; });
    case Op::both: return by_column([&](std::size_t j) { return a(j) * b(j); });
    case Op::either: return by_column([&](std::size_t j) { return std::max(a(j), b(j)); });
    case Op::is_not: return by_column([&](std::size_t j) { return 1.0 - a(j); });
    case Op::select:
      return by_column([&](std::size_t j) { return a(j) != 0.0 ? b(j) : at(operand(2), j); });
    case Op::product: {
      const Matrix& matrix = graph_.nodes[node.operands.at(1)].values;
      return by_column([&](std::size_t j) {
        double sum = 0.0;
        for (std::size_t i = 0; i < matrix.rows; ++i) sum += operand(0).at(i) * matrix(i, j);
        return sum;
      });
    }
    case Op::interpolation:
    case Op::held_interpolation: return interpolated(node, operand(0).at(0));
    case Op::sum: {
      double sum = 0.0;
      for (const double x : operand(0)) sum += x;
      return {sum};
    }
    case Op::largest: return {*std::ranges::max_element(operand(0))};
    case Op::part: {
      const auto first = operand(0).begin() + static_cast<std::ptrdiff_t>(node.first);
      return {first, first + static_cast<std::ptrdiff_t>(node.width)};
    }
    case Op::joined: {
      Numbers out;
      for (std::size_t i = 0; i < node.operands.size(); ++i)
        out.insert(out.end(), operand(i).begin(), operand(i).end());
      return out;
    }
    case Op::to_real:
    case Op::to_wide:
    case Op::to_single: return operand(0);
  }
  throw std::logic_error("unknown operation");
}

GraphInterpreter::Numbers GraphInterpreter::interpolated(const StepGraph::Node& node,
                                                         double x) const {
  const Numbers& knots = graph_.nodes[node.operands.at(1)].values.values;
  const Matrix& table = graph_.nodes[node.operands.at(2)].values;
  std::size_t left = 0;
  while (left + 2 < knots.size() && !(x < knots[left + 1])) ++left;
  double share = (x - knots[left]) / (knots[left + 1] - knots[left]);
  if (node.operation == GraphOperation::held_interpolation) share = std::clamp(share, 0.0, 1.0);
  Numbers out(table.columns);
  for (std::size_t j = 0; j < out.size(); ++j)
    out[j] = table(left, j) + (table(left + 1, j) - table(left, j)) * share;
  return out;
}

}  // namespace torsio::test

#include "export/onnx/onnx_estimator.hpp"

#include <fmt/format.h>

#include <cstddef>
#include <limits>
#include <nlohmann/json.hpp>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include "export/onnx/onnx_graph.hpp"
#include "torsio/core/fault.hpp"

namespace torsio {
namespace {

using OnnxType = onnx::TensorProto;

/// The operators of the operations whose operands are theirs.
std::string operator_of(GraphOperation operation) {
  switch (operation) {
    case GraphOperation::add: return "Add";
    case GraphOperation::subtract: return "Sub";
    case GraphOperation::multiply: return "Mul";
    case GraphOperation::divide: return "Div";
    case GraphOperation::minimum: return "Min";
    case GraphOperation::maximum: return "Max";
    case GraphOperation::power: return "Pow";
    case GraphOperation::negate: return "Neg";
    case GraphOperation::absolute: return "Abs";
    case GraphOperation::sign: return "Sign";
    case GraphOperation::square_root: return "Sqrt";
    case GraphOperation::exponential: return "Exp";
    case GraphOperation::tangent: return "Tanh";
    case GraphOperation::sigmoid: return "Sigmoid";
    case GraphOperation::sine: return "Sin";
    case GraphOperation::less: return "Less";
    case GraphOperation::less_or_equal: return "LessOrEqual";
    case GraphOperation::both: return "And";
    case GraphOperation::either: return "Or";
    case GraphOperation::is_not: return "Not";
    case GraphOperation::select: return "Where";
    case GraphOperation::product: return "MatMul";
    default: return {};
  }
}

class EstimatorWriter {
 public:
  explicit EstimatorWriter(const StepGraph& graph) : graph_(graph), names_(graph.nodes.size()) {}

  std::string bytes(const std::string& description) {
    wide_ = graph_.precision == GraphPrecision::single ? OnnxType::FLOAT : OnnxType::DOUBLE;
    real_ = graph_.precision == GraphPrecision::twofold ? OnnxType::DOUBLE : OnnxType::FLOAT;
    onnx_.description(description);
    onnx_.input("inputs", wide_, {-1, std::ssize(graph_.raw_inputs)});
    if (graph_.state_width > 0) onnx_.input("state", wide_, {-1, state_width()});
    for (std::size_t i = 0; i < graph_.nodes.size(); ++i)
      if (graph_.nodes[i].operation != GraphOperation::constant) names_[i] = added(graph_.nodes[i]);
    onnx_.add("Identity", {full(graph_.value)}, "value");
    onnx_.add("Identity", {full(graph_.std_dev)}, "std_dev");
    OnnxGraph::set(onnx_.add_node("Cast", {full(graph_.fault)}, {"fault"}), "to", OnnxType::INT32);
    onnx_.output("value", real_, {-1, 1});
    onnx_.output("std_dev", real_, {-1, 1});
    onnx_.output("fault", OnnxType::INT32, {-1, 1});
    if (graph_.state_width > 0) {
      onnx_.add("Identity", {full(graph_.next_state)}, "next_state");
      onnx_.output("next_state", wide_, {-1, state_width()});
    }
    add_metadata();
    return onnx_.bytes();
  }

 private:
  [[nodiscard]] std::int64_t state_width() const {
    return static_cast<std::int64_t>(graph_.state_width);
  }

  void add_metadata() {
    nlohmann::json faults = nlohmann::json::array();
    for (std::size_t i = 0; i < kFaultCount; ++i)
      faults.push_back(std::string(name(static_cast<Fault>(i))));
    nlohmann::json state = nlohmann::json::array();
    for (const StepGraph::StatePart& part : graph_.state)
      state.push_back({{"name", part.name}, {"first", part.first}, {"width", part.width}});
    onnx_.metadata("family", graph_.family);
    onnx_.metadata("target", graph_.target);
    onnx_.metadata("sample_rate_Hz", fmt::format("{}", graph_.sample_rate_Hz));
    onnx_.metadata("inputs", nlohmann::json(graph_.raw_inputs).dump());
    onnx_.metadata("zeroed_channels", nlohmann::json(graph_.zeroed_channels).dump());
    onnx_.metadata("faults", faults.dump());
    onnx_.metadata("state", state.dump());
  }

  /// A constant is written where it is first needed: an interpolation has others in its place.
  const std::string& name_of(StepGraph::Index index) {
    if (names_[index].empty()) names_[index] = added(graph_.nodes[index]);
    return names_[index];
  }

  std::string added(const StepGraph::Node& node) {
    OnnxGraph::Names operands;
    const bool is_interpolation = node.operation == GraphOperation::interpolation ||
                                  node.operation == GraphOperation::held_interpolation;
    for (const StepGraph::Index index : node.operands)
      if (!is_interpolation || operands.empty()) operands.push_back(name_of(index));
    switch (node.operation) {
      case GraphOperation::input: return "inputs";
      case GraphOperation::state: return "state";
      case GraphOperation::timestep: return timestep();
      case GraphOperation::constant: return constant(node.values, node.type);
      case GraphOperation::sum: {
        OnnxGraph::Names inputs{operands[0], onnx_.whole({1})};
        return onnx_.add("ReduceSum", inputs);
      }
      case GraphOperation::largest: {
        std::string out = fmt::format("largest_{}", operands[0]);
        OnnxGraph::set(onnx_.add_node("ReduceMax", operands, {out}), "axes",
                       std::vector<std::int64_t>{1});
        return out;
      }
      case GraphOperation::part: {
        const auto first = static_cast<std::int64_t>(node.first);
        const auto end = first + static_cast<std::int64_t>(node.width);
        return onnx_.add("Slice",
                         {operands[0], onnx_.whole({first}), onnx_.whole({end}), onnx_.whole({1})});
      }
      case GraphOperation::joined: {
        OnnxGraph::Names rows;
        for (const StepGraph::Index index : node.operands) rows.push_back(full(index));
        std::string out = fmt::format("joined_{}", ++joined_);
        OnnxGraph::set(onnx_.add_node("Concat", rows, {out}), "axis", std::int64_t{1});
        return out;
      }
      // ONNX Runtime has neither in 64 bits.
      case GraphOperation::cosine: {
        const Matrix quarter(1, 1, std::numbers::pi / 2.0);
        return onnx_.add("Sin", {onnx_.add("Add", {operands[0], constant(quarter, node.type)})});
      }
      case GraphOperation::arc_tangent: {
        const std::string single = cast(operands[0], OnnxType::FLOAT);
        const std::string angle = onnx_.add("Atan", {single});
        return cast(angle, node.type == StepGraph::Type::wide ? wide_ : real_);
      }
      case GraphOperation::to_real: return cast(operands[0], real_);
      case GraphOperation::to_wide: return cast(operands[0], wide_);
      case GraphOperation::to_single: return cast(operands[0], OnnxType::FLOAT);
      case GraphOperation::interpolation:
      case GraphOperation::held_interpolation: return interpolated(node, operands[0]);
      default: return onnx_.add(operator_of(node.operation), operands);
    }
  }

  std::string timestep() {
    onnx_.input("timestep_s", wide_, {1, 1});
    return "timestep_s";
  }

  std::string cast(const std::string& name, int type) {
    std::string out = fmt::format("{}_as_{}_{}", name, type, ++joined_);
    OnnxGraph::set(onnx_.add_node("Cast", {name}, {out}), "to", static_cast<std::int64_t>(type));
    return out;
  }

  std::string constant(const Matrix& values, StepGraph::Type type) {
    const std::vector<std::int64_t> shape{static_cast<std::int64_t>(values.rows),
                                          static_cast<std::int64_t>(values.columns)};
    if (type == StepGraph::Type::truth) return onnx_.truths(values.values, shape);
    const int numbers = type == StepGraph::Type::single ? OnnxType::FLOAT
                        : type == StepGraph::Type::wide ? wide_
                                                        : real_;
    return numbers == OnnxType::FLOAT ? onnx_.singles(values.values, shape)
                                      : onnx_.doubles(values.values, shape);
  }

  /// A value with one row for each joint, also where it is the same for all.
  std::string full(StepGraph::Index index) {
    const StepGraph::Node& node = graph_.nodes[index];
    if (!node.is_common) return name_of(index);
    if (joints_.empty())
      joints_ =
          onnx_.add("Slice", {onnx_.add("Shape", {"inputs"}), onnx_.whole({0}), onnx_.whole({1})});
    const std::string shape = fmt::format("shape_{}", ++joined_);
    OnnxGraph::set(
        onnx_.add_node("Concat", {joints_, onnx_.whole({static_cast<std::int64_t>(node.width)})},
                       {shape}),
        "axis", std::int64_t{0});
    return onnx_.add("Expand", {name_of(index), shape});
  }

  /// With t_k, the place within the k-th gap, limited to 0..1: y_0 + sum_k (y_k+1 - y_k) t_k. At an end that continues, t is
  /// not limited.
  std::string interpolated(const StepGraph::Node& node, const std::string& x) {
    const std::vector<double>& knots = graph_.nodes[node.operands[1]].values.values;
    const Matrix& table = graph_.nodes[node.operands[2]].values;
    const std::size_t gaps = knots.size() - 1;
    constexpr double kInfinity = std::numeric_limits<double>::infinity();
    const bool is_held = node.operation == GraphOperation::held_interpolation;
    Matrix left(1, gaps);
    Matrix per_width(1, gaps);
    Matrix lowest(1, gaps, 0.0);
    Matrix highest(1, gaps, 1.0);
    Matrix rises(gaps, table.columns);
    Matrix first(1, table.columns);
    for (std::size_t k = 0; k < gaps; ++k) {
      left(0, k) = knots[k];
      per_width(0, k) = 1.0 / (knots[k + 1] - knots[k]);
      for (std::size_t j = 0; j < table.columns; ++j) rises(k, j) = table(k + 1, j) - table(k, j);
    }
    for (std::size_t j = 0; j < table.columns; ++j) first(0, j) = table(0, j);
    if (!is_held) {
      lowest(0, 0) = -kInfinity;
      highest(0, gaps - 1) = kInfinity;
    }
    const auto real = [&](const Matrix& values) { return constant(values, StepGraph::Type::real); };
    const std::string t = onnx_.add("Mul", {onnx_.add("Sub", {x, real(left)}), real(per_width)});
    const std::string limited =
        onnx_.add("Max", {onnx_.add("Min", {t, real(highest)}), real(lowest)});
    return onnx_.add("Add", {onnx_.add("MatMul", {limited, real(rises)}), real(first)});
  }

  const StepGraph& graph_;
  OnnxGraph onnx_;
  std::vector<std::string> names_;
  std::string joints_;
  std::size_t joined_ = 0;
  int real_ = OnnxType::DOUBLE;
  int wide_ = OnnxType::DOUBLE;
};

}  // namespace

std::string estimator_onnx(const StepGraph& graph, const std::string& description) {
  return EstimatorWriter(graph).bytes(description);
}

}  // namespace torsio

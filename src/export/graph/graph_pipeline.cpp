#include "export/graph/graph_pipeline.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>
#include <string>
#include <variant>

namespace torsio {
namespace {

using Value = PipelineListing::Value;

Row computed_row(Operation operation, Row a, Row b) {
  const auto of_one = [&](GraphOperation wanted) {
    return a.graph->node(wanted, a.graph->at(a.index).type, a.width(), {a.index});
  };
  switch (operation) {
    case Operation::add: return a + b;
    case Operation::subtract: return a - b;
    case Operation::multiply: return a * b;
    case Operation::divide: return a / b;
    case Operation::negate: return -a;
    case Operation::power: return power(a, b);
    case Operation::sign: return of_one(GraphOperation::sign);
    case Operation::min: return minimum(a, b);
    case Operation::max: return maximum(a, b);
    case Operation::tanh: return tangent(a);
    case Operation::sin: return of_one(GraphOperation::sine);
    case Operation::cos: return of_one(GraphOperation::cosine);
    case Operation::atan: return of_one(GraphOperation::arc_tangent);
    case Operation::abs: return absolute(a);
    case Operation::sqrt: return square_root(a);
    case Operation::exp: return exponential(a);
    default: return a;
  }
}

/// The rules of `FeaturePipeline`, one node or a few for each instruction.
class GraphPipeline {
 public:
  GraphPipeline(GraphBuilder& graph, const PipelineListing& listing)
      : graph_(graph),
        listing_(listing),
        values_(listing.value_count),
        errors_(listing.value_count) {}

  GraphFeatures add(Row raw, std::span<const double> slopes) {
    for (const PipelineListing::Constant& constant : listing_.constants)
      values_[constant.target] = graph_.constant(constant.value);
    for (std::size_t i = 0; i < listing_.raw_targets.size(); ++i)
      values_[listing_.raw_targets[i]] = raw.part(i);
    GraphFeatures features;
    features.is_settled = graph_.truth(true);
    for (const auto& instruction : listing_.instructions)
      std::visit([this](const auto& of) { add_instruction(of); }, instruction);
    for (const Value value : listing_.features) features.rows.push_back(values_[value]);
    features.all = joined(features.rows);
    if (listing_.settling_samples > 0) {
      const auto settling = static_cast<double>(listing_.settling_samples);
      const Row ticks = minimum(ticks_before() + 1.0, settling);
      graph_.set_state("ticks", ticks);
      features.is_settled = is_not(ticks < settling);
    } else if (ticks_) {
      graph_.set_state("ticks", graph_.constant(1.0));
    }
    features.start_std_dev = start_std_dev(slopes);
    return features;
  }

 private:
  void add_instruction(const PipelineListing::Computation& of) {
    const Row left = values_[of.left];
    const Row right = values_[of.right];
    const Row value = computed_row(of.operation, left, right);
    values_[of.target] = value;
    if (!errors_[of.left] && !errors_[of.right]) return;
    // Each operation is evaluated at the corners of its operands.
    Row largest = graph_.constant(0.0);
    for (const double from_left : {-1.0, 1.0})
      for (const double from_right : {-1.0, 1.0}) {
        const auto corner = [&](Value operand, Row at, double sign) {
          return errors_[operand] ? at + *errors_[operand] * sign : at;
        };
        const Row error = absolute(computed_row(of.operation, corner(of.left, left, from_left),
                                                corner(of.right, right, from_right)) -
                                   value);
        largest = select(error <= largest, largest, error);
      }
    errors_[of.target] = largest;
  }

  /// Ticks since the restart, counted until the filters have settled.
  Row ticks_before() {
    if (!ticks_) ticks_ = graph_.state("ticks");
    return *ticks_;
  }
  Row is_first() { return ticks_before() < 0.5; }

  /// The last value of a row; in the first tick the value itself.
  Row last(const std::string& name, Row value) {
    const Row before = graph_.state(name);
    graph_.set_state(name, value);
    return select(is_first(), value, before);
  }

  void add_instruction(const PipelineListing::Rate& of) {
    const Row x = values_[of.operand];
    values_[of.target] = (x - last(fmt::format("rate_{}", of.target), x)) * listing_.sample_rate_Hz;
    if (errors_[of.operand])
      errors_[of.target] = select(0.0 < *errors_[of.operand], kBoundless, 0.0);
  }

  void add_instruction(const PipelineListing::Filter& of) {
    const Row x = values_[of.operand];
    const std::string name = fmt::format("lowpass_{}", of.target);
    const Row band_before = graph_.state(name + "_band");
    const Row low_before = select(is_first(), x, graph_.state(name + "_low"));
    const Row high = x - low_before;
    const Row band = band_before * of.gains.band + high * of.gains.low;
    const Row low = low_before + band_before * of.gains.low + high * of.gains.high;
    graph_.set_state(name + "_band", band * 2.0 - band_before);
    graph_.set_state(name + "_low", low * 2.0 - low_before);
    values_[of.target] = low;
    errors_[of.target] = errors_[of.operand];
  }

  void add_instruction(const PipelineListing::Lag& of) {
    const Row x = values_[of.operand];
    errors_[of.target] = errors_[of.operand];
    values_[of.target] = x;
    if (of.samples == 0) return;
    const std::string name = fmt::format("lag_{}", of.target);
    // Before the first value the row is taken to have been the same.
    const Row before = select(is_first(), x, graph_.state(name, of.samples));
    values_[of.target] = before.part(of.samples - 1);
    const std::vector<Row> next =
        of.samples == 1 ? std::vector{x} : std::vector{x, before.part(0, of.samples - 1)};
    graph_.set_state(name, joined(next));
  }

  void add_instruction(const PipelineListing::Stop& of) {
    const Row x = values_[of.operand];
    const std::string name = fmt::format("stop_{}", of.target);
    const double r = of.threshold;
    const Row change = x - last(name + "_input", x);
    const auto moved = [&](const char* which, double first) {
      const Row before = select(is_first(), first, graph_.state(name + which));
      const Row next = limited(before + change, -r, r);
      graph_.set_state(name + which, next);
      return next;
    };
    const Row state = moved("", 0.0);
    const Row lowest = moved("_lowest", -r);
    const Row highest = moved("_highest", r);
    values_[of.target] = state;
    const Row own = maximum(highest - state, state - lowest);
    errors_[of.target] = minimum(own + error(of.operand) * 2.0, 2.0 * r);
    constexpr double kStopRounding = 1e-9;
    settled_.push_back(highest - lowest <= kStopRounding * r);
  }

  void add_instruction(const PipelineListing::Dahl& of) {
    const Row x = values_[of.operand];
    const std::string name = fmt::format("dahl_{}", of.target);
    const Row change = x - last(name + "_input", x);
    const Row moved = absolute(change);
    const Row before = graph_.state(name);
    const Row direction = select(0.0 < change, 1.0, -1.0);
    const Row after = direction + (before - direction) * exponential(moved * (-1.0 / of.distance));
    const Row state = select(0.0 < moved, after, before);
    const Row travel = graph_.state(name + "_travel") + moved;
    const Row input_error = maximum(graph_.state(name + "_input_error"), error(of.operand));
    graph_.set_state(name, state);
    graph_.set_state(name + "_travel", travel);
    graph_.set_state(name + "_input_error", input_error);
    values_[of.target] = state;
    const Row sure = maximum(travel - input_error * 2.0, 0.0);
    const Row start = input_error * (4.0 / of.distance) + 1.0;
    errors_[of.target] = minimum(
        start * exponential(sure * (-1.0 / of.distance)) + error(of.operand) * (4.0 / of.distance),
        2.0);
    constexpr double kForgotten = 3.0;  // distances after which 5 % of the start is left
    settled_.push_back(is_not(travel < kForgotten * of.distance));
  }

  Row error(Value value) { return errors_[value] ? *errors_[value] : graph_.constant(0.0); }

  Row start_std_dev(std::span<const double> slopes) {
    if (settled_.empty()) return graph_.constant(0.0);
    Row all = settled_.front();
    for (const Row each : settled_) all = both(all, each);
    const Row has_travelled = either(graph_.truth_state("has_travelled"), all);
    graph_.set_state("has_travelled", has_travelled);
    Row sum = graph_.constant(0.0);
    for (std::size_t i = 0; i < listing_.features.size(); ++i)
      if (errors_[listing_.features[i]] && slopes[i] != 0.0)
        sum = sum + *errors_[listing_.features[i]] * (std::abs(slopes[i]) / std::numbers::sqrt3);
    return select(has_travelled, 0.0, sum);
  }

  static constexpr double kBoundless = 1e30;

  GraphBuilder& graph_;
  const PipelineListing& listing_;
  std::vector<Row> values_;
  std::vector<std::optional<Row>> errors_;
  std::optional<Row> ticks_;
  std::vector<Row> settled_;
};

}  // namespace

GraphFeatures add_pipeline(GraphBuilder& graph, const PipelineListing& listing, Row raw,
                           std::span<const double> slopes) {
  return GraphPipeline(graph, listing).add(raw, slopes);
}

}  // namespace torsio

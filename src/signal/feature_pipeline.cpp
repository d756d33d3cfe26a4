#include "torsio/signal/feature_pipeline.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>
#include <utility>

#include "core/did_you_mean.hpp"
#include "signal/expression_graph.hpp"
#include "signal/expression_parser.hpp"
#include "signal/pipeline_listing.hpp"
#include "torsio/core/error.hpp"
#include "torsio/signal/differentiator.hpp"
#include "torsio/signal/lowpass.hpp"

namespace torsio {
namespace {

constexpr std::size_t kMaxLagMemory = 1'000'000;  // samples, all lags of a pipeline together

/// The value `samples` ticks ago; before there is one, the first.
class DelayLine {
 public:
  explicit DelayLine(std::size_t samples) : past_(samples) {}

  void reset() noexcept {
    next_ = 0;
    is_full_ = false;
  }

  double step(double input) noexcept {
    const double leaving = std::exchange(past_[next_], input);
    const double output = is_full_ ? leaving : past_[0];
    if (++next_ == past_.size()) {
      next_ = 0;
      is_full_ = true;
    }
    return output;
  }

  [[nodiscard]] std::size_t samples() const noexcept { return past_.size(); }

  void visit_state(detail::StateBytes& bytes) noexcept {
    bytes.visit(past_, is_full_);
    bytes.visit_at_most(next_, past_.size() - 1);
  }

 private:
  std::vector<double> past_;  // a ring
  std::size_t next_ = 0;
  bool is_full_ = false;
};

/// s <- clip(s + change of the input, +-threshold): the deflection of a spring whose far end slips.
class StopOperator {
 public:
  explicit StopOperator(double threshold) : threshold_(threshold) { reset(); }

  void reset() noexcept {
    state_ = 0.0;
    lowest_ = -threshold_;
    highest_ = threshold_;
    has_last_ = false;
  }

  /// A value that is not finite is returned and leaves the state.
  double step(double input) noexcept {
    if (!std::isfinite(input)) return input;
    if (has_last_) {
      const double change = input - last_;
      state_ = clipped(state_ + change);
      lowest_ = clipped(lowest_ + change);
      highest_ = clipped(highest_ + change);
    }
    last_ = input;
    has_last_ = true;
    return state_;
  }
  /// Whether the input has moved so far that the state no longer depends on that at the start.
  [[nodiscard]] bool is_settled() const noexcept {
    return highest_ - lowest_ <= kRounding * threshold_;
  }
  /// Bound of the error of the state, with an input whose errors are at most `input_error`.
  [[nodiscard]] double error(double input_error) const noexcept {
    const double own = std::max(highest_ - state_, state_ - lowest_);
    return std::min(2.0 * threshold_, own + 2.0 * input_error);
  }

  [[nodiscard]] double threshold() const noexcept { return threshold_; }

  void visit_state(detail::StateBytes& bytes) noexcept {
    bytes.visit(state_, lowest_, highest_, last_, has_last_);
  }

 private:
  static constexpr double kRounding = 1e-9;
  [[nodiscard]] double clipped(double state) const noexcept {
    return std::clamp(state, -threshold_, threshold_);
  }

  double threshold_;
  double state_ = 0.0;
  double lowest_ = 0.0;  ///< the state, had it begun at one end; likewise the other
  double highest_ = 0.0;
  double last_ = 0.0;
  bool has_last_ = false;
};

/// s <- d + (s - d) exp(-|change of the input| / distance), d the sign of the change: the friction of Dahl 1968
/// over its level.
class DahlOperator {
 public:
  explicit DahlOperator(double distance) : distance_(distance) {}

  void reset() noexcept {
    state_ = 0.0;
    travel_ = 0.0;
    largest_input_error_ = 0.0;
    has_last_ = false;
  }

  /// A value that is not finite is returned and leaves the state.
  double step(double input) noexcept {
    if (!std::isfinite(input)) return input;
    if (has_last_ && input != last_) {
      const double direction = input > last_ ? 1.0 : -1.0;
      state_ = direction + (state_ - direction) * std::exp(-std::abs(input - last_) / distance_);
    }
    travel_ += has_last_ ? std::abs(input - last_) : 0.0;
    last_ = input;
    has_last_ = true;
    return state_;
  }
  /// Whether what is left of the unknown state at the start is below 5 %.
  [[nodiscard]] bool is_settled() const noexcept { return travel_ >= 3.0 * distance_; }
  /// Bound of the error of the state, with an input whose errors are at most `input_error` now. By what they
  /// were at most, the travel may be shorter.
  [[nodiscard]] double error(double input_error) noexcept {
    largest_input_error_ = std::max(largest_input_error_, input_error);
    const double sure = std::max(0.0, travel_ - 2.0 * largest_input_error_);
    const double start = 1.0 + 4.0 * largest_input_error_ / distance_;
    return std::min(2.0, start * std::exp(-sure / distance_) + 4.0 * input_error / distance_);
  }

  [[nodiscard]] double distance() const noexcept { return distance_; }

  void visit_state(detail::StateBytes& bytes) noexcept {
    bytes.visit(travel_, largest_input_error_, state_, last_, has_last_);
  }

 private:
  double distance_;
  double travel_ = 0.0;
  double largest_input_error_ = 0.0;
  double state_ = 0.0;
  double last_ = 0.0;
  bool has_last_ = false;
};

struct Instruction {
  Operation operation;
  std::uint32_t target;  ///< index into the values; the operands' likewise
  std::uint32_t left;
  std::uint32_t right;
  std::uint32_t
      state;  ///< index among the differentiators, low-passes, lags, stops or friction states
};

bool has_operands(const Node& node) {
  return node.operation != Operation::channel && node.operation != Operation::constant;
}

void check_sample_rate(double sample_rate_Hz) {
  if (!(sample_rate_Hz > 0.0) || !std::isfinite(sample_rate_Hz))
    throw UsageError({.place = "feature pipeline",
                      .expected = "a positive sample rate",
                      .found = fmt::format("{} Hz", sample_rate_Hz)});
}

}  // namespace

// The graph as straight code over one array of values: channels and constants have their places in
// it, each instruction writes one.
struct FeaturePipeline::Program {
  Program(FeatureSpec feature_spec, double rate_Hz);
  void compile(const ExpressionGraph& graph, const std::vector<std::uint32_t>& input_nodes);
  /// @returns by how many samples the operation settles later than its operands.
  std::size_t add(const Node& node, std::uint32_t target);
  [[nodiscard]] PipelineListing::Instruction listed(const Instruction& instruction) const;
  [[nodiscard]] double run(const Instruction& instruction) noexcept TORSIO_REALTIME;
  void bound_errors() noexcept TORSIO_REALTIME;
  [[nodiscard]] double error_of(const Instruction& instruction) noexcept TORSIO_REALTIME;

  FeatureSpec spec;
  double sample_rate_Hz;
  std::vector<std::string> raw_inputs;
  std::vector<double> zeros;
  std::vector<std::uint32_t> raw_targets;
  std::vector<double> values;
  std::vector<Instruction> instructions;
  std::vector<PipelineListing::Constant> constants;
  std::vector<Differentiator> differentiators;
  std::vector<Lowpass> lowpasses;
  std::vector<DelayLine> delay_lines;
  std::vector<StopOperator> stops;
  std::vector<DahlOperator> dahls;
  std::size_t lag_memory = 0;
  std::vector<std::uint32_t> feature_sources;
  std::vector<double> features;
  std::vector<bool> is_rate;
  std::size_t settling_samples = 0;
  std::size_t seen = 0;
  bool has_travelled = false;  ///< every operator has forgotten its state at the start
  std::vector<double> errors;  ///< errors of the values, by unknown states at the start
  std::vector<double> feature_errors;

  [[nodiscard]] bool have_travelled() const noexcept {
    const auto is_settled = [](const auto& of) { return of.is_settled(); };
    return std::ranges::all_of(stops, is_settled) && std::ranges::all_of(dahls, is_settled);
  }
};

FeaturePipeline::Program::Program(FeatureSpec feature_spec, double rate_Hz)
    : spec(std::move(feature_spec)), sample_rate_Hz(rate_Hz) {
  check_sample_rate(rate_Hz);
  ExpressionGraph graph;
  ExpressionParser parser(graph, spec.definitions, rate_Hz);
  std::vector<std::uint32_t> input_nodes;
  for (const std::string& input : spec.inputs) input_nodes.push_back(parser.parse(input, "input"));
  parser.check_unused_definitions();
  compile(graph, input_nodes);
}

void FeaturePipeline::Program::compile(const ExpressionGraph& graph,
                                       const std::vector<std::uint32_t>& input_nodes) {
  const std::vector<Node>& nodes = graph.nodes();
  std::vector<bool> is_needed(nodes.size(), false);
  for (const std::uint32_t node : input_nodes) is_needed[node] = true;
  for (std::size_t i = nodes.size(); i-- > 0;) {
    if (!is_needed[i] || !has_operands(nodes[i])) continue;
    is_needed[nodes[i].left] = true;
    is_needed[nodes[i].right] = true;
  }

  values.resize(nodes.size());
  std::vector<std::size_t> unsettled(nodes.size(), 0);  // leading samples that are not settled
  for (std::uint32_t i = 0; i < nodes.size(); ++i) {
    if (!is_needed[i]) continue;
    const Node& node = nodes[i];
    if (node.operation == Operation::constant) {
      values[i] = node.parameter;
      constants.push_back({i, node.parameter});
    } else if (node.operation == Operation::channel) {
      raw_inputs.push_back(graph.channels()[node.left]);
      raw_targets.push_back(i);
    } else {
      unsettled[i] = std::max(unsettled[node.left], unsettled[node.right]) + add(node, i);
    }
  }
  zeros.resize(raw_inputs.size());

  const std::vector<Motion> motions = graph.motions();
  std::size_t longest = 0;
  for (const std::uint32_t node : input_nodes) {
    is_rate.push_back(motions[node] == Motion::rate);
    longest = std::max(longest, unsettled[node]);
  }
  settling_samples = longest == 0 ? 0 : longest + 1;
  has_travelled = stops.empty() && dahls.empty();
  feature_sources = input_nodes;
  features.resize(input_nodes.size());
  errors.resize(nodes.size());
  feature_errors.resize(input_nodes.size());
}

std::size_t FeaturePipeline::Program::add(const Node& node, std::uint32_t target) {
  std::size_t state = 0;
  std::size_t delay = 0;
  switch (node.operation) {
    case Operation::rate:
      state = differentiators.size();
      differentiators.emplace_back(sample_rate_Hz);
      delay = differentiators.back().settling_samples() - 1;
      break;
    case Operation::lowpass:
      state = lowpasses.size();
      lowpasses.emplace_back(node.parameter, sample_rate_Hz);
      delay = lowpasses.back().settling_samples() - 1;
      break;
    case Operation::lag:
      state = delay_lines.size();
      delay = static_cast<std::size_t>(node.parameter);
      lag_memory += delay;
      if (lag_memory > kMaxLagMemory)
        throw Error({.place = "feature pipeline",
                     .expected = fmt::format("lags of at most {} samples together", kMaxLagMemory),
                     .found = "more"});
      delay_lines.emplace_back(delay);
      break;
    case Operation::stop:
      state = stops.size();
      stops.emplace_back(node.parameter);
      break;
    case Operation::dahl:
      state = dahls.size();
      dahls.emplace_back(node.parameter);
      break;
    default: break;
  }
  instructions.push_back(
      {node.operation, target, node.left, node.right, static_cast<std::uint32_t>(state)});
  return delay;
}

double FeaturePipeline::Program::run(const Instruction& instruction) noexcept {
  const double left = values[instruction.left];
  switch (instruction.operation) {
    case Operation::rate: return differentiators[instruction.state].step(left);
    case Operation::lowpass: return lowpasses[instruction.state].step(left);
    case Operation::lag: return delay_lines[instruction.state].step(left);
    case Operation::stop: return stops[instruction.state].step(left);
    case Operation::dahl: return dahls[instruction.state].step(left);
    default: return computed(instruction.operation, left, values[instruction.right]);
  }
}

PipelineListing::Instruction FeaturePipeline::Program::listed(
    const Instruction& instruction) const {
  const auto [operation, target, left, right, state] = instruction;
  switch (operation) {
    case Operation::rate: return PipelineListing::Rate{target, left};
    case Operation::lowpass: return PipelineListing::Filter{target, left, lowpasses[state].gains()};
    case Operation::lag: return PipelineListing::Lag{target, left, delay_lines[state].samples()};
    case Operation::stop: return PipelineListing::Stop{target, left, stops[state].threshold()};
    case Operation::dahl: return PipelineListing::Dahl{target, left, dahls[state].distance()};
    default: return PipelineListing::Computation{operation, target, left, right};
  }
}

double FeaturePipeline::Program::error_of(const Instruction& instruction) noexcept {
  const double left = errors[instruction.left];
  const double right = errors[instruction.right];
  switch (instruction.operation) {
    case Operation::stop: return stops[instruction.state].error(left);
    case Operation::dahl: return dahls[instruction.state].error(left);
    case Operation::rate: return left == 0.0 ? 0.0 : std::numeric_limits<double>::infinity();
    case Operation::lowpass:
    case Operation::lag: return left;
    default: break;
  }
  if (left == 0.0 && right == 0.0) return 0.0;
  double largest = 0.0;
  for (const double from_left : {-left, left})
    for (const double from_right : {-right, right}) {
      const double corner = computed(instruction.operation, values[instruction.left] + from_left,
                                     values[instruction.right] + from_right);
      const double error = std::abs(corner - values[instruction.target]);
      if (!(error <= largest)) largest = error;
    }
  return largest;
}

void FeaturePipeline::Program::bound_errors() noexcept {
  for (const Instruction& instruction : instructions)
    errors[instruction.target] = error_of(instruction);
  for (std::size_t i = 0; i < feature_errors.size(); ++i)
    feature_errors[i] = errors[feature_sources[i]];
}

FeaturePipeline::FeaturePipeline(FeatureSpec spec, double sample_rate_Hz)
    : program_(std::make_unique<Program>(std::move(spec), sample_rate_Hz)) {}

FeaturePipeline::FeaturePipeline(const FeaturePipeline& other)
    : program_(std::make_unique<Program>(*other.program_)) {}

FeaturePipeline::FeaturePipeline(FeaturePipeline&& other) noexcept = default;

FeaturePipeline& FeaturePipeline::operator=(FeaturePipeline other) noexcept {
  program_.swap(other.program_);
  return *this;
}

FeaturePipeline::~FeaturePipeline() = default;

const FeatureSpec& FeaturePipeline::spec() const noexcept { return program_->spec; }

double FeaturePipeline::sample_rate_Hz() const noexcept { return program_->sample_rate_Hz; }

std::size_t FeaturePipeline::feature_count() const noexcept { return program_->features.size(); }

const std::vector<std::string>& FeaturePipeline::raw_inputs() const noexcept {
  return program_->raw_inputs;
}

bool FeaturePipeline::is_rate(std::size_t feature) const noexcept {
  return program_->is_rate[feature];
}

bool FeaturePipeline::set_zero(std::string_view channel, double value) {
  const std::vector<std::string>& names = program_->raw_inputs;
  const auto found = std::find(names.begin(), names.end(), channel);
  if (found == names.end())
    throw UsageError({.place = "set_zero",
                      .expected = fmt::format("one of {}", fmt::join(names, ", ")),
                      .found = fmt::format("'{}'", channel),
                      .advice = did_you_mean(channel, names)});
  if (!std::isfinite(value))
    throw UsageError({.place = fmt::format("set_zero of {}", channel),
                      .expected = "a finite value",
                      .found = fmt::format("{}", value)});
  return std::exchange(program_->zeros[static_cast<std::size_t>(found - names.begin())], value) !=
         value;
}

std::size_t FeaturePipeline::settling_samples() const noexcept {
  return program_->settling_samples;
}

void FeaturePipeline::reset() noexcept {
  for (Differentiator& differentiator : program_->differentiators) differentiator.reset();
  for (Lowpass& lowpass : program_->lowpasses) lowpass.reset();
  for (DelayLine& line : program_->delay_lines) line.reset();
  for (StopOperator& stop : program_->stops) stop.reset();
  for (DahlOperator& dahl : program_->dahls) dahl.reset();
  program_->seen = 0;
  program_->has_travelled = program_->stops.empty() && program_->dahls.empty();
}

std::span<const double> FeaturePipeline::step(std::span<const double> raw) noexcept {
  Program& program = *program_;
  for (std::size_t i = 0; i < program.raw_targets.size(); ++i)
    program.values[program.raw_targets[i]] = raw[i] - program.zeros[i];
  for (const Instruction& instruction : program.instructions)
    program.values[instruction.target] = program.run(instruction);
  for (std::size_t i = 0; i < program.features.size(); ++i)
    program.features[i] = program.values[program.feature_sources[i]];
  if (program.seen < program.settling_samples) ++program.seen;
  if (!program.has_travelled) {
    program.has_travelled = program.have_travelled();
    if (program.has_travelled) {
      std::ranges::fill(program.feature_errors, 0.0);
    } else {
      program.bound_errors();
    }
  }
  return program.features;
}

PipelineListing FeaturePipeline::listing() const {
  const Program& program = *program_;
  PipelineListing listing{.sample_rate_Hz = program.sample_rate_Hz,
                          .value_count = program.values.size(),
                          .raw_inputs = program.raw_inputs,
                          .raw_targets = program.raw_targets,
                          .constants = program.constants,
                          .features = program.feature_sources,
                          .settling_samples = program.settling_samples};
  for (const Instruction& instruction : program.instructions)
    listing.instructions.push_back(program.listed(instruction));
  return listing;
}

bool FeaturePipeline::are_filters_settled() const noexcept {
  return program_->seen == program_->settling_samples;
}

bool FeaturePipeline::is_settled() const noexcept {
  return are_filters_settled() && program_->has_travelled;
}

std::span<const double> FeaturePipeline::state_errors() const noexcept {
  return program_->feature_errors;
}

void FeaturePipeline::visit_state(detail::StateBytes& bytes) noexcept {
  Program& program = *program_;
  bytes.visit(program.differentiators, program.lowpasses, program.delay_lines, program.stops,
              program.dahls, program.has_travelled, program.feature_errors);
  bytes.visit_at_most(program.seen, program.settling_samples);
}

std::vector<std::string> channels_of(std::string_view expression) {
  ExpressionGraph graph;
  ExpressionParser(graph, {}, std::nullopt).parse(expression, "expression");
  return graph.channels();
}

std::vector<std::string> split_inputs(std::string_view list) {
  constexpr std::string_view kBlank = " \t\r\n";
  std::vector<std::string> inputs;
  if (list.find_first_not_of(kBlank) == std::string_view::npos) return inputs;
  const auto add_trimmed = [&](std::string_view part) {
    const std::size_t first = part.find_first_not_of(kBlank);
    if (first == std::string_view::npos)
      inputs.emplace_back();
    else
      inputs.emplace_back(part.substr(first, part.find_last_not_of(kBlank) - first + 1));
  };
  std::size_t start = 0;
  std::ptrdiff_t depth = 0;
  for (std::size_t i = 0; i < list.size(); ++i) {
    if (list[i] == '(') ++depth;
    if (list[i] == ')') --depth;
    if (list[i] != ',' || depth > 0) continue;
    add_trimmed(list.substr(start, i - start));
    start = i + 1;
  }
  add_trimmed(list.substr(start));
  return inputs;
}

}  // namespace torsio

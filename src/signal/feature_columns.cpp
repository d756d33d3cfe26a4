#include "signal/feature_columns.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <numbers>

#include "signal/expression_parser.hpp"

namespace torsio::detail {
namespace {

// The bytes of `Differentiator::visit_state` (samples seen, previous input, rate, skipped) and of
// `Lowpass::visit_state` (band, low, started), in this order, 8 each.
constexpr std::size_t kDifferenceBytes = 32;
constexpr std::size_t kLowpassBytes = 24;

template <class Number>
Number number_at(const std::byte* from) noexcept {
  Number number;
  std::memcpy(&number, from, sizeof number);
  return number;
}

void put(double number, std::byte* to) noexcept { std::memcpy(to, &number, sizeof number); }

}  // namespace

FeatureColumns::FeatureColumns(const FeatureSpec& spec, double sample_rate_Hz, std::size_t rows)
    : sample_rate_Hz_(sample_rate_Hz), rows_(rows) {
  ExpressionGraph graph;
  ExpressionParser parser(graph, spec.definitions, sample_rate_Hz);
  for (const std::string& input : spec.inputs) sources_.push_back(parser.parse(input, "input"));
  const std::vector<Node>& nodes = graph.nodes();
  std::vector<bool> is_needed(nodes.size(), false);
  for (const std::uint32_t node : sources_) is_needed[node] = true;
  const auto is_leaf = [](const Node& node) {
    return node.operation == Operation::channel || node.operation == Operation::constant;
  };
  for (std::size_t i = nodes.size(); i-- > 0;)
    if (is_needed[i] && !is_leaf(nodes[i]))
      is_needed[nodes[i].left] = is_needed[nodes[i].right] = true;
  values_.resize(nodes.size());
  std::size_t columns = 0;
  for (std::uint32_t i = 0; i < nodes.size(); ++i) {
    if (!is_needed[i]) continue;
    const Node& node = nodes[i];
    if (node.operation == Operation::constant) {
      values_[i].fill(node.parameter);
    } else if (node.operation == Operation::channel) {
      raw_targets_.push_back(i);
    } else {
      Instruction each{node.operation, i, node.left, node.right, columns};
      if (node.operation == Operation::rate) {
        differences_.push_back(columns);
        columns += 2;
      } else if (node.operation == Operation::lowpass) {
        // As `Lowpass` computes its gains.
        const double g = std::tan(std::numbers::pi * node.parameter / sample_rate_Hz);
        each.band_gain = 1.0 / (1.0 + g * (g + std::numbers::sqrt2));
        each.low_gain = g * each.band_gain;
        each.high_gain = g * each.low_gain;
        lowpasses_.push_back(columns);
        columns += 2;
      } else if (node.operation >= Operation::rate) {
        is_supported_ = false;
      }
      instructions_.push_back(each);
    }
  }
  zeros_.resize(raw_targets_.size());
  next_.resize(columns);
  states_.assign(columns * rows, 0.0);
}

bool FeatureColumns::read(std::size_t row, std::span<const std::byte> state) noexcept {
  const std::byte* from = state.data() + differences_.size() * kDifferenceBytes;
  for (std::size_t i = 0; i < lowpasses_.size(); ++i)
    if (from[i * kLowpassBytes + 16] == std::byte{0}) return false;
  for (const std::size_t first : lowpasses_) {
    column(first)[row] = number_at<double>(from);
    column(first + 1)[row] = number_at<double>(from + 8);
    from += kLowpassBytes;
  }
  from = state.data();
  for (const std::size_t first : differences_) {
    column(first)[row] = number_at<double>(from + 8);
    column(first + 1)[row] = number_at<double>(from + 16);
    from += kDifferenceBytes;
  }
  return true;
}

void FeatureColumns::write(std::size_t row, std::span<std::byte> state) const noexcept {
  std::byte* to = state.data();
  for (const std::size_t first : differences_) {
    put(states_[first * rows_ + row], to + 8);
    put(states_[(first + 1) * rows_ + row], to + 16);
    to += kDifferenceBytes;
  }
  for (const std::size_t first : lowpasses_) {
    put(states_[first * rows_ + row], to);
    put(states_[(first + 1) * rows_ + row], to + 8);
    to += kLowpassBytes;
  }
}

void FeatureColumns::step(std::size_t first, std::size_t count, const double* raw) noexcept {
  const std::size_t channels = raw_targets_.size();
  for (std::size_t i = 0; i < channels; ++i) {
    Block& value = values_[raw_targets_[i]];
    for (std::size_t n = 0; n < count; ++n) value[n] = raw[n * channels + i] - zeros_[i];
  }
  overflowed_.fill(0);
  for (const Instruction& each : instructions_) run(each, first, count);
}

void FeatureColumns::run(const Instruction& instruction, std::size_t first,
                         std::size_t count) noexcept {
  const double* const left = values_[instruction.left].data();
  const double* const right = values_[instruction.right].data();
  double* const target = values_[instruction.target].data();
  switch (instruction.operation) {
    case Operation::add:
      for (std::size_t n = 0; n < count; ++n) target[n] = left[n] + right[n];
      return;
    case Operation::subtract:
      for (std::size_t n = 0; n < count; ++n) target[n] = left[n] - right[n];
      return;
    case Operation::multiply:
      for (std::size_t n = 0; n < count; ++n) target[n] = left[n] * right[n];
      return;
    case Operation::rate: {
      const double* const previous = column(instruction.column) + first;
      double* const next_input = next_[instruction.column].data();
      double* const next_rate = next_[instruction.column + 1].data();
      for (std::size_t n = 0; n < count; ++n) {
        target[n] = next_rate[n] = (left[n] - previous[n]) * sample_rate_Hz_;
        next_input[n] = left[n];
      }
      return;
    }
    case Operation::lowpass: {
      const double* const bands = column(instruction.column) + first;
      const double* const lows = column(instruction.column + 1) + first;
      double* const next_band = next_[instruction.column].data();
      double* const next_low = next_[instruction.column + 1].data();
      for (std::size_t n = 0; n < count; ++n) {
        const double high = left[n] - lows[n];
        const double band = instruction.band_gain * bands[n] + instruction.low_gain * high;
        const double low = lows[n] + instruction.low_gain * bands[n] + instruction.high_gain * high;
        next_band[n] = 2.0 * band - bands[n];
        next_low[n] = 2.0 * low - lows[n];
        target[n] = low;
      }
      for (std::size_t n = 0; n < count; ++n)
        overflowed_[n] |= static_cast<std::uint8_t>(!std::isfinite(next_band[n] + next_low[n]));
      return;
    }
    default:
      for (std::size_t n = 0; n < count; ++n)
        target[n] = computed(instruction.operation, left[n], right[n]);
  }
}

void FeatureColumns::commit(std::size_t first, std::size_t count,
                            const std::uint8_t* flags) noexcept {
  for (std::size_t c = 0; c < next_.size(); ++c) {
    double* const state = column(c) + first;
    for (std::size_t n = 0; n < count; ++n) state[n] = flags[n] != 0 ? next_[c][n] : state[n];
  }
}

}  // namespace torsio::detail

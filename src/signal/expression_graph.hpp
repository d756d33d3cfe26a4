#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <tuple>
#include <vector>

namespace torsio {

enum class Operation : std::uint8_t {
  channel,
  constant,
  add,
  subtract,
  multiply,
  divide,
  power,
  negate,
  sign,
  tanh,
  sin,
  cos,
  atan,
  abs,
  sqrt,
  exp,
  min,
  max,
  rate,
  lowpass,
  lag,
  stop,
  dahl,
};

/// The value of an operation without memory; those of one operand take it from `left`.
[[nodiscard]] double computed(Operation operation, double left, double right) noexcept;

/// One value that is computed at every tick. Operands have a smaller index than the node itself.
struct Node {
  Operation operation = Operation::constant;
  std::uint32_t left = 0;   ///< operand; for a channel its index in `channels()`
  std::uint32_t right = 0;  ///< second operand; the first again where there is one only
  double parameter =
      0.0;  ///< value of a constant, cut-off in Hz, lag in samples, threshold of a stop, distance of dahl
};

/// The kind of motion that an expression depends on: none (constants), a rate, or something else.
enum class Motion : std::uint8_t { none, rate, other };

/// All expressions of a pipeline as one graph: equal sub-expressions are one node, operations on
/// constants are done while building.
class ExpressionGraph {
 public:
  std::uint32_t channel(std::string_view name);
  std::uint32_t constant(double value);
  std::uint32_t operation(Operation operation, std::uint32_t left, std::uint32_t right);
  /// `parameter` is the cut-off of `lowpass`, the number of samples of `lag`, the threshold of `stop`, the distance of `dahl`.
  std::uint32_t memory(Operation operation, std::uint32_t operand, double parameter);

  /// A name in the unit of a rate (rad_s, m_s) makes its node one, whatever it is made of.
  void declare_rate_if_named(std::uint32_t node, std::string_view name);
  /// One for each node.
  [[nodiscard]] std::vector<Motion> motions() const;

  [[nodiscard]] bool is_constant(std::uint32_t node) const {
    return nodes_[node].operation == Operation::constant;
  }
  [[nodiscard]] const std::vector<Node>& nodes() const noexcept { return nodes_; }
  [[nodiscard]] const std::vector<std::string>& channels() const noexcept { return channels_; }

 private:
  // operation, left, right, bits of the parameter
  using Key = std::tuple<Operation, std::uint32_t, std::uint32_t, std::uint64_t>;
  std::uint32_t unique(const Node& node);

  std::vector<Node> nodes_;
  std::vector<bool> declared_rates_;
  std::vector<std::string> channels_;
  std::map<Key, std::uint32_t> index_;
};

}  // namespace torsio

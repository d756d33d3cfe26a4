#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "torsio/core/matrix.hpp"
#include "torsio/files/model_file.hpp"

namespace torsio {

/// What a node of a `StepGraph` computes from its operands a, b, c. A row of width 1 is used in each column.
enum class GraphOperation : std::uint8_t {
  input,     ///< the raw inputs
  state,     ///< the state
  timestep,  ///< the time since the last tick in s, the same for all joints
  constant,  ///< `values`, one row; for `product` and `interpolation` more
  add,
  subtract,
  multiply,
  divide,
  minimum,
  maximum,
  power,
  negate,
  absolute,
  sign,
  square_root,
  exponential,
  tangent,  ///< hyperbolic
  sigmoid,
  sine,
  cosine,
  arc_tangent,
  less,           ///< a < b
  less_or_equal,  ///< a <= b
  both,
  either,
  is_not,
  select,         ///< where a: b, else c
  product,        ///< a times the matrix b, a constant
  interpolation,  ///< the rows of the constant c, between the knots b, straight beyond their ends
  held_interpolation,  ///< the same, held beyond the ends
  sum,                 ///< the columns added up
  largest,             ///< the largest column
  part,                ///< `width` columns from `first`
  joined,              ///< operands side by side
  to_real,             ///< a number or truth as a real, wide or single number
  to_wide,
  to_single,
};
[[nodiscard]] std::string_view name(GraphOperation operation) noexcept;

/// The numbers of a graph.
enum class GraphPrecision : std::uint8_t {
  single,  ///< 32 bits
  mixed,  ///< 64 bits for inputs, state and features, whose differences need them; 32 bits for model and guards
  twofold,  ///< 64 bits
};

/// One tick of an estimator as operations on rows: what a framework of tensors computes for many joints at once, one
/// row for each. There are no branches and no loops: each guard selects.
///
/// `input` (raw channels in SI, less their zeros) and `state` give `value`, `std_dev`, `fault` (as `Fault`) and `next_state`.
/// The state after a reset is 0 everywhere. Another `timestep` than the period of the model gives `Fault::wrong_rate`, unless
/// the model does not depend on time.
///
/// The guards are those of the estimator, with two differences (docs/robot/simulators.md): there is no rule of jumps, and a
/// tick without inputs is always a long gap, after which filters and model start again.
struct StepGraph {
  using Index = std::uint32_t;
  enum class Type : std::uint8_t {
    real,    ///< a number of model and guards
    wide,    ///< a number of inputs, state and pipeline
    single,  ///< a number of a network: always 32 bits
    truth,
  };

  struct Node {
    GraphOperation operation = GraphOperation::constant;
    Type type = Type::real;
    std::size_t width = 1;
    std::vector<Index> operands = {};  ///< indices of earlier nodes
    std::size_t first = 0;
    bool is_common = false;  ///< the same for all joints: one row
    Matrix values = {};      ///< numbers, if it is a constant
  };
  struct StatePart {
    std::string name;
    std::size_t first = 0;
    std::size_t width = 1;
  };

  std::vector<Node> nodes = {};
  Index value = 0;
  Index std_dev = 0;  ///< NaN where there is no evidence
  Index fault = 0;
  Index next_state = 0;
  std::size_t state_width = 0;
  std::vector<StatePart> state = {};

  GraphPrecision precision = GraphPrecision::twofold;
  std::vector<std::string> raw_inputs = {};
  std::vector<std::string> zeroed_channels = {};  ///< those from which the caller subtracts a zero
  std::string target = {};
  double sample_rate_Hz = 0.0;
  std::string family = {};
};

struct StepGraphOptions {
  GraphPrecision precision = GraphPrecision::twofold;
  bool has_guards = true;  ///< false: the value of the model alone, its own error bar and fault
};

/// The families of which there is a graph, separated by commas.
[[nodiscard]] std::string_view graph_families() noexcept;

/// @throws UsageError for another family
[[nodiscard]] StepGraph step_graph(const ModelFile& model, const StepGraphOptions& options = {});

}  // namespace torsio

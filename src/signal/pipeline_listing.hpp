#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <variant>
#include <vector>

#include "signal/expression_graph.hpp"
#include "torsio/signal/lowpass.hpp"

namespace torsio {

/// A compiled pipeline as plain data, for what writes it down in another language. Each instruction writes one value;
/// its operands were written before, or are constants or channels.
struct PipelineListing {
  using Value = std::uint32_t;  ///< index of a value

  struct Constant {
    Value target = 0;
    double value = 0.0;
  };
  struct Computation {
    Operation operation = Operation::add;  ///< the operation of `computed`
    Value target = 0;
    Value left = 0;
    Value right = 0;  ///< the left one again where there is one operand
  };
  struct Rate {
    Value target = 0;
    Value operand = 0;
  };
  struct Filter {
    Value target = 0;
    Value operand = 0;
    Lowpass::Gains gains = {};
  };
  struct Lag {
    Value target = 0;
    Value operand = 0;
    std::size_t samples = 0;
  };
  struct Stop {
    Value target = 0;
    Value operand = 0;
    double threshold = 0.0;
  };
  struct Dahl {
    Value target = 0;
    Value operand = 0;
    double distance = 0.0;
  };
  using Instruction = std::variant<Computation, Rate, Filter, Lag, Stop, Dahl>;

  double sample_rate_Hz = 0.0;
  std::size_t value_count = 0;
  std::vector<std::string> raw_inputs = {};
  std::vector<Value> raw_targets = {};  ///< where each raw input less its zero is written
  std::vector<Constant> constants = {};
  std::vector<Instruction> instructions = {};
  std::vector<Value> features = {};
  std::size_t settling_samples = 0;
};

}  // namespace torsio

#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

namespace torsio {

/// What a step of an exported program consists of.
enum class CWork : std::uint8_t {
  step,          ///< once
  input,         ///< a raw input, with its jump detection
  feature,       ///< with the guard of its range
  filter,        ///< a low-pass
  rate,          ///< a rate or a lag
  operation,     ///< an operation of an expression
  function,      ///< an exponential, a sine, a root
  memory,        ///< a model with memory
  term,          ///< a product of a coefficient and an input
  cell,          ///< half of a search between knots: log2 of them
  element,       ///< a slip element or a relaxation
  weight,        ///< a weight of a network
  unit,          ///< a unit of a layer
  tangent,       ///< a hyperbolic tangent or a sigmoid
  kernel_term,   ///< a factor of a covariance
  kernel_value,  ///< a covariance of two points
};
inline constexpr std::size_t kCWorkCount = static_cast<std::size_t>(CWork::kernel_value) + 1;
using CWorkCounts = std::array<double, kCWorkCount>;

/// What a program needs on a target, estimated from `./run long export` within 15 %; the RAM is exact.
struct CCost {
  double flash = 0.0;  ///< bytes of code and tables, without the functions for numbers in software
  double ram = 0.0;    ///< bytes of the state of one joint
  double stack = 0.0;  ///< bytes of a step
  double instructions = 0.0;  ///< of an ordinary step
};

/// A processor for which the cost of a program can be estimated.
struct CTarget {
  std::string_view name;         ///< as `--target` takes it
  std::string_view description;  ///< processor and flags
  bool has_double = false;       ///< in hardware
  bool has_float = false;
  /// Instructions of each part of the work, and bytes of code of a character of the source: measured by
  /// `./run long export`.
  struct Prices {
    CWorkCounts instructions = {};
    double code_bytes = 0.0;   ///< of a character
    double stack_bytes = 0.0;  ///< besides the arrays of the functions
  };
  Prices single = {};
  Prices twofold = {};
};
/// All of them.
[[nodiscard]] std::span<const CTarget> c_targets() noexcept;
/// @throws UsageError that lists them.
[[nodiscard]] const CTarget& find_c_target(std::string_view name);

}  // namespace torsio

#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>

namespace torsio {

/// What a step of an exported program consists of.
enum class CWork : std::uint8_t {
  step,           ///< once
  interpolation,  ///< once, where short gaps are filled
  input,          ///< a raw input
  counted,        ///< a raw input that is given as counts of an encoder
  jump,           ///< a number whose jumps are detected
  counted_jump,   ///< counts whose jumps are detected
  conversion,     ///< a sum of counts that becomes a number
  feature,        ///< with the guard of its range
  filter,         ///< a low-pass
  stop,           ///< in an expression
  dahl,           ///< the friction of Dahl in an expression
  rate,           ///< a rate or a lag
  operation,      ///< an operation of an expression
  exponential,    ///< a call, as the following ones
  root,           ///< a square root
  sine,           ///< or a cosine
  arc_tangent,    ///< the inverse of a tangent
  logarithm,      ///< for a power whose exponent is not a whole number
  tangent,        ///< a hyperbolic tangent or a sigmoid
  memory,         ///< a model with memory
  term,           ///< a coefficient and its product
  schedule,       ///< a place between rows of coefficients
  scheduled,      ///< a coefficient between rows, and its product
  polynomial,     ///< with the limits of its argument
  power,          ///< a coefficient of a polynomial
  direction,      ///< detection of the direction of motion
  search,         ///< between knots
  cell,           ///< half of a search: log2 of the knots
  element,        ///< a slip element
  relaxation,     ///< a relaxation
  section,        ///< a filter of second order of a Hammerstein-Wiener model
  bank,           ///< elements over another input
  border,         ///< the range of an input of a residual model
  scaled,         ///< an input of a network
  layer,          ///< a layer of a network
  weight,         ///< a weight of a network
  unit,           ///< a unit of a layer
  gate,           ///< a row of a recurrent layer
  kernel,         ///< a kernel of a Gaussian process
  kernel_term,    ///< a factor of a covariance
  kernel_value,   ///< a covariance of two points
  kernel_weight,  ///< a coefficient of a covariance
  kernel_unit,    ///< a row of coefficients
  control,        ///< the loops of a joint whose drive follows a current, once
  speed_control,  ///< the same where the drive follows a speed
  observer,       ///< the observer of the disturbing current
  brake,          ///< the stop on request
  inversion,      ///< inversion of a model of the torque, with the guards at the result
  evaluation,     ///< evaluation of the curve that is inverted, without its elements
  evaluated,      ///< a slip element in it
};
inline constexpr std::size_t kCWorkCount = static_cast<std::size_t>(CWork::evaluated) + 1;
using CWorkCounts = std::array<double, kCWorkCount>;
/// "kernel_term"
[[nodiscard]] std::string_view name(CWork kind) noexcept;

/// What the text of a program consists of, by which the size of its code is estimated.
enum class CCode : std::uint8_t {
  program,     ///< once
  function,    ///< one that is defined
  call,        ///< a call of a function
  branch,      ///< an if, a loop, a condition
  member,      ///< a member of a struct
  element,     ///< an element of an array
  number,      ///< a literal with a point
  arithmetic,  ///< an operation on numbers
  comparison,  ///< a comparison of numbers
  assignment,  ///< one to a variable
  wide,        ///< a type or a constant of 64 bits
};
inline constexpr std::size_t kCCodeCount = static_cast<std::size_t>(CCode::wide) + 1;
using CCodeCounts = std::array<double, kCCodeCount>;
[[nodiscard]] std::string_view name(CCode kind) noexcept;
/// Counts in functions in C; comments do not count.
[[nodiscard]] CCodeCounts c_code(std::string_view functions);

/// What the stack of a step consists of.
enum class CStack : std::uint8_t {
  program,             ///< once
  local_byte,          ///< a byte of its arrays and structs
  interpolation,       ///< once, where short gaps are filled
  interpolated_input,  ///< an input then
  counted,             ///< as the following ones: once, if there are such parts of the work
  stop,
  dahl,      ///< each
  function,  ///< a sine, a logarithm or the inverse of a tangent
  memory,
  layer,
  gate,
  process,        ///< a Gaussian process, once
  kernel,         ///< a kernel of it
  schedule,       ///< where short gaps are filled
  lone_schedule,  ///< where they are not
  bank,
  border,
  control,    ///< the loops of a joint, once
  inversion,  ///< inversion of a model of the torque
  curve,      ///< that is inverted
  shared,     ///< functions that a control step calls as well
  scheduled_polynomial,
};
inline constexpr std::size_t kCStackCount =
    static_cast<std::size_t>(CStack::scheduled_polynomial) + 1;
using CStackCounts = std::array<double, kCStackCount>;
[[nodiscard]] std::string_view name(CStack kind) noexcept;
/// @param local_bytes of arrays and structs
/// @param has_controller whether the program contains a control step
[[nodiscard]] CStackCounts c_stack(const CWorkCounts& work, std::size_t local_bytes,
                                   bool has_controller) noexcept;

/// What a program needs on a target, estimated from `./run long export` within 15 %; the RAM is exact.
struct CCost {
  double flash = 0.0;  ///< bytes of code and tables, without the functions for numbers in software
  double ram = 0.0;    ///< bytes of the state of one joint
  struct Step {
    double stack = 0.0;         ///< bytes
    double instructions = 0.0;  ///< without faults
  };
  Step step = {};
  std::optional<Step> control = std::nullopt;  ///< a control step that follows an impedance
};

/// A processor for which the cost of a program can be estimated.
struct CTarget {
  std::string_view name;         ///< as `--target` takes it
  std::string_view description;  ///< processor and flags
  /// Instructions and bytes of each part: measured by `./run long export`.
  struct Prices {
    CWorkCounts instructions = {};
    CCodeCounts code_bytes = {};
    CStackCounts stack_bytes = {};
  };
  const Prices* single = nullptr;   ///< for float; null: not offered
  const Prices* twofold = nullptr;  ///< for double
};
/// All of them.
[[nodiscard]] std::span<const CTarget> c_targets() noexcept;
/// @throws UsageError that lists them.
[[nodiscard]] const CTarget& find_c_target(std::string_view name);

}  // namespace torsio

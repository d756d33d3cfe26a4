#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

namespace torsio {

/// Numbers in sign and magnitude: where the sign bit is set, -(value - sign_bit). Numbers that were scaled may be as much
/// smaller as their rounding.
void decode_sign_bit(std::vector<double>& values, double sign_bit) noexcept;

/// Signed numbers that were read as unsigned ones: from half the modulus on, value - modulus.
void decode_modulus(std::vector<double>& values, double modulus) noexcept;

/// A counter or an angle that begins again: a step by more than half of `span` is one to the other side of it. Values
/// that are not finite are passed over.
void unwrap(std::vector<double>& values, double span) noexcept;

/// How the numbers of a channel must be decoded so that they are continuous.
struct CodedNumbers {
  enum class Kind : unsigned char { sign_bit, modulus, wrapped };
  Kind kind = Kind::wrapped;
  double span = 0.0;      ///< sign bit, modulus or span, as a number of the channel
  double codes = 0.0;     ///< the same in steps of the sensor; 0: the steps are not known
  std::size_t jumps = 0;  ///< how often the numbers jump by it
  std::size_t first = 0;  ///< index of the value after the first one
};

/// A signal that jumps again and again by one amount, a power of two of its steps or the whole range, and that one of the
/// three ways to decode numbers makes continuous. Negative numbers are decoded by their magnitude.
/// @param values finite ones, in the order of time
/// @param step resolution of the sensor; 0: not known
/// @param turns spans of whole turns: a jump by one of them is a wrap even if it is the only one, or if an angle before a
/// gear passes through the turn within a few samples
[[nodiscard]] std::optional<CodedNumbers> find_coded_numbers(std::span<const double> values,
                                                             double step,
                                                             std::span<const double> turns = {});

}  // namespace torsio

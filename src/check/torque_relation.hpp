#pragma once

#include <cstddef>
#include <optional>
#include <string_view>

#include "check/signal_pair.hpp"

namespace torsio {

/// Below it a torque hardly follows its input.
inline constexpr double kClearCorrelation = 0.5;

/// The torque rises with the input up to a sample and falls with it from there on, or the other way
/// round.
struct SignFlip {
  std::size_t sample = 0;  ///< the first of the second part
  double before = 0.0;     ///< correlation
  double after = 0.0;
};
[[nodiscard]] std::optional<SignFlip> find_sign_flip(const Pair& pair);

/// What the torque does at the same input and the same speed, early and late in one record.
struct RelationChange {
  bool is_gradual = false;   ///< along the whole record, else at `sample`
  std::size_t sample = 0;    ///< the first of the second part, about
  double offset = 0.0;       ///< late minus early, in the middle of the input's range
  double slope_ratio = 1.0;  ///< late over early
  bool is_of_slope = false;  ///< rather than of the offset
};

/// Every passage through a cell of input and speed tells a torque. If the torques of equal cells are
/// scattered, and one step or one straight line in time tells most of that scatter, something
/// changed: a sensor's zero, a part. Hysteresis and creep scatter too, but to and fro. Only changes
/// beyond 15 % of the torque's range, or of the slope by 2, are told; empty where passages are too
/// few or the torque does not follow the input.
[[nodiscard]] std::optional<RelationChange> find_relation_change(const Pair& pair,
                                                                 double sample_rate_Hz);

/// The unit mistake that makes a number `ratio` (or 1 / `ratio`) times too large, within 10 %;
/// empty if none does.
[[nodiscard]] std::string_view unit_mistake(double ratio);

}  // namespace torsio

#pragma once

#include <cstddef>
#include <optional>
#include <string_view>

#include "check/signal_pair.hpp"

namespace torsio {

/// Correlation below which a torque hardly follows its input.
inline constexpr double kClearCorrelation = 0.5;

/// The torque rises with the input up to a sample and falls with it afterwards, or falls first and
/// then rises.
struct SignFlip {
  std::size_t sample = 0;  ///< the first of the second part
  double before = 0.0;     ///< correlation
  double after = 0.0;
};
[[nodiscard]] std::optional<SignFlip> find_sign_flip(const Pair& pair);

/// Change of the torque at equal input and speed between early and late parts of one recording.
struct RelationChange {
  bool is_gradual = false;   ///< over the whole recording, else at `sample`
  std::size_t sample = 0;    ///< the first of the second part, about
  double offset = 0.0;       ///< late minus early, in the middle of the input's range
  double slope_ratio = 1.0;  ///< late over early
  bool is_of_slope = false;  ///< true: the slope changed; false: the offset
};

/// Each passage through a cell of input and speed has a torque. If the torques of equal cells are
/// scattered, and one step or one linear trend in time explains most of that scatter, the joint or
/// a sensor changed. Hysteresis and creep cause scatter too, but in both directions. Only changes
/// above 15 % of the torque's range, or of the slope by a factor of 2, are reported; empty if there
/// are too few passages or the torque does not follow the input.
[[nodiscard]] std::optional<RelationChange> find_relation_change(const Pair& pair,
                                                                 double sample_rate_Hz);

/// The unit mistake that makes a number `ratio` (or 1 / `ratio`) times too large, within 10 %;
/// empty if none does.
[[nodiscard]] std::string_view unit_mistake(double ratio);

}  // namespace torsio

#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "check/signal_pair.hpp"

namespace torsio {

/// A torque without its sign: it is never on the other side of its lowest amount, and grows to both sides of one input.
struct LostSign {
  double input = 0.0;     ///< where the amount is lowest
  double together = 0.0;  ///< correlation of the torque with the distance from that input
};
/// Empty if the torque follows the input itself, or the input is less than a tenth of the time on one side.
[[nodiscard]] std::optional<LostSign> find_lost_sign(const Pair& pair);

/// A level beyond which the target does not go while the input continues, as at the limit of an amplifier.
struct Limit {
  double level = 0.0;
  std::size_t visits = 0;
  double hidden = 0.0;  ///< what the motion would change the target by during the longest visit
  std::vector<Rest> samples;
};
/// At the lowest and at the highest values of the target, within its noise. A motion that turns there does not continue:
/// at least three visits hide more than a twentieth of the target's range and five times the width of the level.
/// @param noise standard deviation of the target
[[nodiscard]] std::optional<Limit> find_limit(const Pair& pair, double noise);

/// Much of the target lies within its noise at its lowest and highest values, while the input moves on.
struct Plateau {
  double share = 0.0;          ///< samples there
  std::vector<double> levels;  ///< the ends, lowest first, that have a tenth of the samples
  bool is_at_zero = false;     ///< the only level is zero: a load may be gone there
  double input_share = 0.0;    ///< what the input moves through meanwhile, of its range
  std::vector<Rest> samples;
};
/// Empty with less than 30 % of the samples there, or 30 % of the input's range at each end that has a tenth of them.
/// @param noise standard deviation of the target
[[nodiscard]] std::optional<Plateau> find_plateau(const Pair& pair, double noise);

/// A part of the target that follows the angle q of the joint and not the input: the weight of a link that bends the
/// sensor, an encoder whose magnet is off its axis.
struct PositionEffect {
  double amplitude = 0.0;    ///< half of what the angle changes the target by
  double unexplained = 1.0;  ///< share of the target's variance that the input leaves
  double left =
      1.0;  ///< share of that which remains with sin q, cos q, and over half a turn sin 2q, cos 2q
};
/// Empty unless these explain 65 % of what a curve with hysteresis over the input leaves, in parts that were not used
/// for the fit as well, and twice as much as q itself, which is what a wrong ratio of a gear adds. Empty also where the
/// joint moves with its load, or in fewer than five strokes.
[[nodiscard]] std::optional<PositionEffect> find_position_effect(
    const Pair& pair, const std::vector<double>& angle_rad);

}  // namespace torsio

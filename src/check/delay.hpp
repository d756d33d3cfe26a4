#pragma once

#include <optional>
#include <vector>

#include "check/signal_pair.hpp"

namespace torsio {

/// The shift of the target at which a static curve with hysteresis over the input explains it best.
struct Delay {
  double lag_s = 0.0;          ///< positive: the target comes late
  double unexplained = 1.0;    ///< share of the target's variance, there
  double without_shift = 1.0;  ///< the same without shift
  /// The shortest lag that would be reported: a slow motion has nearly the same torque before and
  /// after it. Infinite if none would.
  double shortest_s = 0.0;
  bool is_at_end = false;  ///< the search ends at this lag
};

/// Lags up to 0.6 s are searched. Empty if there are too few samples.
[[nodiscard]] std::optional<Delay> estimate_delay(const Pair& pair, double sample_rate_Hz);

/// Whether a delay explains what hysteresis does not. Late: at least 8 ms, and 13 % of the variance
/// that is unexplained without shift. Early: viscosity and relaxation make the torque of a spring
/// lead its deflection, too, so the rest must nearly vanish at the best shift.
[[nodiscard]] bool is_late(const Delay& delay, double sample_rate_Hz);
[[nodiscard]] bool is_early(const Delay& delay, double sample_rate_Hz);

/// How the angles of both sides of a spring are related beyond the deflection that the torque
/// explains:
///
///     first - second = f(torque) + excess second - lateness d second / dt
///
/// f is a static curve with hysteresis. excess: the scale of the first angle is wrong by that
/// share; lateness: the first angle is late.
struct TwoSides {
  double excess = 0.0;
  double lateness_s = 0.0;
  double unexplained = 1.0;  ///< share of the variance of first - second
  double without_excess = 1.0;
  double without_lateness = 1.0;
  /// The smaller range of the two angles over that of the deflection, without the excess.
  double travel = 0.0;
};
[[nodiscard]] std::optional<TwoSides> relate_sides(const std::vector<double>& first,
                                                   const std::vector<double>& second,
                                                   const std::vector<double>& torque,
                                                   double sample_rate_Hz);

/// A wrong scale or gear ratio: at least 1 % where the joint moves far.
[[nodiscard]] bool has_wrong_scale(const TwoSides& sides);
[[nodiscard]] bool has_late_side(const TwoSides& sides, double sample_rate_Hz);

}  // namespace torsio

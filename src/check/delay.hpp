#pragma once

#include <optional>
#include <vector>

#include "check/signal_pair.hpp"

namespace torsio {

/// A lag that grows in time, as between two clocks.
struct LagCourse {
  double at_middle_s = 0.0;  ///< in the middle of the recording
  double per_second = 0.0;
  double change_s = 0.0;  ///< over the whole recording
  double unexplained = 1.0;
};

/// The shift of the target at which a dissipative spring over the input explains it best:
///
///     target(t + lag) = f(z) + a t + sum c_k s_k(z) + sum d_k |z| s_k(z) + sum e_l (z - low-pass_l(z))
///
/// f is a static curve, a the drift of a zero or of a temperature, s_k are stop operators (`hysteresis_fit.hpp`), the low-passes have time
/// constants from 0.02 to 20 s; c, d, e >= 0 (non-negative least squares). The friction of the
/// stops does not depend on the speed, a lag shifts fast parts of the motion more than slow ones;
/// and with these signs friction, viscosity and relaxation only make the torque lead, so that a
/// late torque remains unexplained without a shift.
struct Delay {
  double lag_s = 0.0;          ///< positive: the target comes late
  double unexplained = 1.0;    ///< share of the target's variance, there
  double without_shift = 1.0;  ///< the same without shift
  /// Square sum of the errors in four parts of the recording, each of the fit to the other three,
  /// over the same without shift; and in how many parts it is smaller.
  double held_out_share = 1.0;
  std::size_t better_parts = 0;
  /// The shortest lag that would be reported: a slow motion has nearly the same torque before and
  /// after it. Infinite if none would.
  double shortest_s = 0.0;
  bool is_at_end = false;  ///< the search ends at this lag
  /// Two clocks; empty unless it changes by at least 12 ms, and leaves at most 30 % of what a constant lag leaves.
  std::optional<LagCourse> course = {};
};

/// Lags up to 0.6 s are searched. Empty if there are too few samples.
[[nodiscard]] std::optional<Delay> estimate_delay(const Pair& pair, double sample_rate_Hz);

/// Whether a shift explains a good part of what is unexplained without it, also in parts of the
/// recording that were not used for the fit. Late: at least 8 ms; the shift explains 30 % of it, of a long delay 75 %. Early: the
/// input is late; the shift explains 70 % of it, and hardly anything else remains.
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

/// `TwoSides::travel` from which on a wrong scale is found.
inline constexpr double kFarTravel = 5.0;
/// A wrong scale or gear ratio: at least 1 % where the joint moves far.
[[nodiscard]] bool has_wrong_scale(const TwoSides& sides);
[[nodiscard]] bool has_late_side(const TwoSides& sides, double sample_rate_Hz);

}  // namespace torsio

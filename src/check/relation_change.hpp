#pragma once

#include <cstddef>
#include <optional>

#include "check/signal_pair.hpp"

namespace torsio {

/// Change of the torque at equal input between early and late parts of one recording.
struct RelationChange {
  bool is_gradual = false;   ///< over the whole recording, else at `sample`
  std::size_t sample = 0;    ///< the first of the second part, about
  double offset = 0.0;       ///< late minus early, in the middle of the input's range
  double slope_ratio = 1.0;  ///< late over early
  bool is_of_slope = false;  ///< true: the slope changed; false: the offset
};

/// The torque is fitted by a static curve with hysteresis over the input (`hysteresis_columns`). If
/// one step, one linear trend in time or one that settles, of offset and slope, explains three quarters of what
/// remains, the joint or a sensor may have changed. Offset and slope of the change are those between
/// early and late samples at equal input after equal motion: what depends on the branch of the hysteresis
/// or on the load is equal in both. Only offsets above 5 % of the torque's range and slopes that change
/// by more than 12 % are reported; empty if the torque does not follow the input or the motion does not
/// reverse on both sides of the step. Where the late motion does not repeat the early one over a fifth of the input's
/// range, offset and slope are those of the fit, and only a change that explains 1 % of the torque's variance is
/// reported. A slope that changes with the rate of the motion, as that of a spring that relaxes, is none: relaxations
/// with time constants from 0.02 to 20 s explain it at least as well.
[[nodiscard]] std::optional<RelationChange> find_relation_change(const Pair& pair,
                                                                 double sample_rate_Hz);

/// A part of a recording in which the target hardly changes, although it follows the input elsewhere.
struct SwitchedOff {
  Rest samples;
  double passed = 0.0;    ///< range that the target passes through in it
  double expected = 0.0;  ///< the same elsewhere, at equal inputs and speeds
};
/// The recording is divided into twenty parts; in one the target passes through less than a tenth of what the curve with
/// hysteresis passes through, and that is at least a tenth of the range of the target. The neighbours in which it is as
/// quiet belong to it. Empty if these are more than six, if it happens elsewhere, or if the target passes through as
/// little elsewhere at equal inputs and speeds: then it is a backlash or a contact that opened.
[[nodiscard]] std::optional<SwitchedOff> find_switched_off(const Pair& pair);

}  // namespace torsio

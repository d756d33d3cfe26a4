#pragma once

#include "stress/stress.hpp"

namespace torsio::stress {

/// Estimators of every kind of family on streams with missing ticks, jumps, slow excursions, wrong zeros,
/// pauses and stamps that step back, at random. A difference from the same model's run on the undisturbed stream
/// by more than five error bars for more than 50 ms without a fault is a failure, as is a value that is not
/// finite. Where the sensor itself is wrong, this counts from the tick on in which it is right again, and only
/// if it had left the range or the speed of the training. One stream of a run may be wrong.
Outcome random_streams(const Settings& settings);

}  // namespace torsio::stress

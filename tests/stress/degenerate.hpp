#pragma once

#include "stress/stress.hpp"

namespace torsio::stress {

/// Models of every kind of family that are trained with too little: a fraction of a second, a few held levels, another
/// motion's torque, motions as small as the noise, a single ramp, a load cell that stops in the middle. The checks before
/// a fit may refuse. The test is an ordinary motion: a known spring with friction. Without a fault no value may exceed
/// three times the trained torque, and at most one sample in twenty may be wrong by more than five error bars after
/// 50 ms; in one case out of fifty more, since a motion that is a thousandth as large as the one in the test does not
/// show its friction.
Outcome degenerate_training(const Settings& settings);

}  // namespace torsio::stress

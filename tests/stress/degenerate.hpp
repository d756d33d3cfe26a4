#pragma once

#include "stress/stress.hpp"

namespace torsio::stress {

/// Models of every kind of family that are trained with too little: a fraction of a second, a few held levels, the torque of
/// another motion, motions of the size of the noise, a single ramp, a load cell that stops in the middle. A fit may
/// refuse. The test is an ordinary motion of a known spring with friction; without a fault no value may exceed three times
/// the trained torque, and at most one sample of twenty may be wrong by more than five error bars.
Outcome degenerate_training(const Settings& settings);

}  // namespace torsio::stress

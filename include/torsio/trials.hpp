#pragma once

// Start here to try models in closed loops on simulated actuators.
//
//   TrackingSpec     reference, gains and faults of a torque loop
//   track_models     its errors with each of several models
//   TrackingScore    how well a torque was followed
//   ImpedanceSpec    stiffness and damping to render, and the forces of a hand
//   track_impedance  the impedance that a joint rendered

#include "torsio/sim/closed_loop/impedance_tracking.hpp"
#include "torsio/sim/closed_loop/tracking.hpp"

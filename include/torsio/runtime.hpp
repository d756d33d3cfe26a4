#pragma once

// Start here in a robot: what steps in the loop of a joint, without heap, lock or exception. From a model file:
// `torsio/files.hpp`.
//
//   JointSample        the measurements of a joint at one tick; a channel that is not measured stays NaN
//   TorqueEstimator    sample -> `Estimate`: torque, error bar, `Fault`; `BasicTorqueEstimator<M>` around a model of
//                      your own
//   AdaptiveEstimator  the same, adapted to a reference sensor while it runs
//   TorqueController   torque reference -> motor current through the inverse of a model; `JointController` with limits
//   MonitoredTorque    one torque from several estimates, with the faults of each; `JointStop` stops the joint

#include "torsio/control/estimate_correction.hpp"
#include "torsio/control/joint_controller.hpp"
#include "torsio/control/joint_stop.hpp"
#include "torsio/control/model_inverse.hpp"
#include "torsio/control/torque_controller.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/realtime.hpp"
#include "torsio/core/units.hpp"
#include "torsio/core/version.hpp"
#include "torsio/estimate/adaptive_estimator.hpp"
#include "torsio/estimate/estimator.hpp"
#include "torsio/estimate/monitored_torque.hpp"
#include "torsio/estimate/motor_referenced_torques.hpp"
#include "torsio/estimate/torque_estimator.hpp"
#include "torsio/safety/angle_unwrapper.hpp"
#include "torsio/safety/command_watchdog.hpp"
#include "torsio/safety/monitor.hpp"
#include "torsio/safety/redundancy.hpp"

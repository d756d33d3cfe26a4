#pragma once

// Start here for an arm of elastic joints. Everything but its construction is real-time code.
//
//   ArmModel          links, joints and payload of a serial arm; `read_urdf` makes it from the text of a URDF file
//   ArmDynamics       torques of a motion, mass matrix, accelerations, Jacobian and place of the flange
//   ArmController     angles and currents of all joints -> currents: positions, impedances, hand guiding, stops
//   MomentumObserver  the external torque at each joint
//   ContactDetector   contacts, by an external torque above its error bar; `read_contacts` reads what was learned

#include "torsio/arm/arm_controller.hpp"
#include "torsio/arm/arm_dynamics.hpp"
#include "torsio/arm/arm_model.hpp"
#include "torsio/arm/arm_move.hpp"
#include "torsio/arm/cartesian_impedance.hpp"
#include "torsio/arm/contact_detector.hpp"
#include "torsio/arm/contact_reaction.hpp"
#include "torsio/arm/contacts_file.hpp"
#include "torsio/arm/flange_wrench.hpp"
#include "torsio/arm/momentum_observer.hpp"
#include "torsio/arm/urdf.hpp"

#pragma once

#include "control/controller_listing.hpp"
#include "export/c_text.hpp"
#include "torsio/control/joint_controller.hpp"

namespace torsio {

/// Writes the loops of a `JointController` as types and functions: `NAME_torque_*` for `TorqueLoopCore`, `NAME_cascade_*` for
/// `JointCascade`, `NAME_impedance_*` for `JointImpedance`. Members of the state have the names of the members there; what
/// is NaN after a reset there has a flag.
void write_loops(CText& c, const JointControllerCore::Settings& settings,
                 const ControllerListing& listing, double sample_rate_Hz);

}  // namespace torsio

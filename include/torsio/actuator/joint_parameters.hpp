#pragma once

#include "torsio/actuator/data_sheet.hpp"
#include "torsio/control/design/series_elastic_joint.hpp"
#include "torsio/control/joint_stop.hpp"
#include "torsio/control/tube_impedance.hpp"

// What the controllers take, from the data sheet of an actuator.

namespace torsio {

/// The drive of an actuator's data sheet; all its gears are combined into one.
[[nodiscard]] Drive drive_of(const DataSheet& sheet);

/// The rated speed of the joint [rad/s], or 95 % of that at which the supply is used up, whichever is smaller.
[[nodiscard]] double speed_limit_of(const DataSheet& sheet);

/// The joint of a data sheet: the relaxed stiffness of an elastomer, the middle one of rubber; a
/// torsion tube before the last gear is referred to the joint, and the gear is rigid: M contains
/// the inertia of its wave generator.
[[nodiscard]] SeriesElasticJoint series_elastic_joint(const DataSheet& sheet);

/// A stop with the brake of the data sheet (`brake_sheet`), and a ramp of half a second from the rated speed.
/// @param load_Nm the largest torque that pulls at the joint at rest
[[nodiscard]] JointStop::Settings joint_stop_settings(const DataSheet& sheet, double load_Nm = 0.0);

/// The settings of a joint with a tube before a gear. @throws Error if the actuator has none.
[[nodiscard]] TubeImpedance::Settings tube_impedance_settings(const DataSheet& sheet,
                                                              const TubeImpedance::Gains& gains);

}  // namespace torsio

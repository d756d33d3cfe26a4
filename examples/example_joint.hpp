// The joint of the examples, a small one of 50 Nm. Put the numbers of your own drive here, from the sheets of its motor,
// gear and spring.
#pragma once

#include "torsio/control/design/series_elastic_joint.hpp"
#include "torsio/core/units.hpp"

inline torsio::SeriesElasticJoint example_joint() {
  return {.drive = {.ratio = 120.0,
                    .torque_constant_Nm_A = 0.104,
                    .rotor_inertia_kg_m2 = 6e-5,
                    .viscous_Nms_rad = 10.0,
                    .coulomb_Nm = 6.0,
                    .rated_current_A = 5.0,
                    .peak_current_A = 10.0,
                    .current_time_constant_s = 0.5e-3,
                    .supply_V = 48.0,
                    .resistance_Ohm = 0.5},
          .stiffness_Nm_rad = 10.0 * torsio::deg_from_rad(1.0),  // 10 Nm per degree
          .joint_inertia_kg_m2 = 0.15,
          .joint_viscous_Nms_rad = 0.05};
}

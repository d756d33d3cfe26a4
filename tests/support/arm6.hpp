#pragma once

#include <array>
#include <cstddef>
#include <string>

#include "torsio/arm/arm_model.hpp"

namespace torsio::test {

inline constexpr std::size_t kArm6Joints = 6;
using Arm6Joints = std::array<double, kArm6Joints>;

/// The arm of share/torsio/arm6.urdf: two joints of 300 Nm, one of 120 Nm, three of 28 Nm.
inline ArmModel arm6() {
  struct Row {
    Vector3 axis;
    Vector3 position_m;
    double mass_kg;
    Vector3 com_m;
    Vector3 moments_kg_m2;
    double effort_Nm;
    double speed_rad_s;
  };
  const std::array<Row, 6> rows = {{
      {{0, 0, 1}, {0, 0, 0.12}, 5.6, {0, 0, 0.1457}, {0.02041, 0.02053, 0.01316}, 300, 1.0},
      {{0, 1, 0}, {0, 0, 0.16}, 5.5, {0.4273, 0, 0}, {0.01024, 0.11302, 0.1132}, 300, 1.0},
      {{0, 1, 0}, {0.5, 0, 0}, 1.8, {0.165, 0, 0}, {0.00199, 0.00944, 0.00944}, 120, 1.66},
      {{1, 0, 0}, {0.25, 0, 0}, 1.3, {0.1692, 0, 0}, {0.00112, 0.00483, 0.00504}, 28, 5.24},
      {{0, 1, 0}, {0.2, 0, 0}, 1.1, {0.0464, 0, 0}, {0.00075, 0.00102, 0.00102}, 28, 5.24},
      {{1, 0, 0}, {0.09, 0, 0}, 0.2, {0.02, 0, 0}, {0.00012, 0.00008, 0.00008}, 28, 5.24},
  }};
  ArmModel arm{.name = "arm6", .flange = {{0.03, 0.0, 0.0}}};
  for (std::size_t j = 0; j < rows.size(); ++j) {
    const Row& row = rows[j];
    arm.joints.push_back(
        {.name = "joint" + std::to_string(j + 1),
         .link = "link" + std::to_string(j + 1),
         .origin = {row.position_m},
         .axis = row.axis,
         .body = {row.mass_kg,
                  row.com_m,
                  {row.moments_kg_m2[0], row.moments_kg_m2[1], row.moments_kg_m2[2]}},
         .lowest_rad = -2.8,
         .highest_rad = 2.8,
         .speed_rad_s = row.speed_rad_s,
         .effort_Nm = row.effort_Nm});
  }
  return arm;
}

/// 8 kg with the centre of mass 80 mm before the flange.
inline BodyInertia payload_of_8_kg() { return {8.0, {0.08, 0.0, 0.0}, {0.0136, 0.0136, 0.0136}}; }

}  // namespace torsio::test

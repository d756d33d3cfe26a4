#pragma once

#include <optional>

#include "torsio/design/spring.hpp"

namespace torsio {

constexpr double kLeverWidth_m = 6e-3;  // along the circle, for each spring or stack (assumed)

inline double allowed_shear_Pa(const SpringDemand& d) {
  return d.material.allowed_shear_Pa / d.safety;
}
inline double wanted_stiffness(const SpringDemand& d) { return d.torque_Nm / d.angle_rad; }
/// Mass [kg] of a ring of the material.
[[nodiscard]] double ring_mass_kg(const SpringDemand& d, double outer_m, double inner_m,
                                  double length_m);

// The spring of a kind that meets the demand: of coils and discs the lightest, of rods and tubes the
// thinnest. None if there is none.
[[nodiscard]] std::optional<SpringDesign> best_rod(const SpringDemand& d);
[[nodiscard]] std::optional<SpringDesign> best_tube(const SpringDemand& d);
[[nodiscard]] std::optional<SpringDesign> best_coils(const SpringDemand& d);
[[nodiscard]] std::optional<SpringDesign> best_discs(const SpringDemand& d);
[[nodiscard]] std::optional<SpringDesign> best_of(const SpringDemand& d, SpringKind kind);

}  // namespace torsio

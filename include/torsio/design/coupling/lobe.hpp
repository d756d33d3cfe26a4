#pragma once

#include <string_view>
#include <vector>

namespace torsio::design {

/// One rubber lobe of a jaw coupling, symmetric about the x axis, with the coupling's axis at the
/// origin (specification of paper 003, section 3). Lengths are in millimetres, as in the solver.
///
/// The half width on the chord of a flank is `half_width_mm + (x - root_radius_mm) tan(angle / 2)`;
/// the flank is the arc of `flank_radius_mm` through the chord's ends on both radii. Paper 003
/// prints the outer radius, the angles and the flank radii; all other defaults are assumed.
struct LobeShape {
  double outer_radius_mm = 10.0;
  double root_radius_mm = 5.5;   ///< radius of the jaw's tip; assumed
  double half_width_mm = 1.7;    ///< half of the slot at `root_radius_mm`; assumed
  double slot_angle_deg = 0.0;   ///< included angle of the two flanks of a slot
  double flank_radius_mm = 0.0;  ///< 0: straight; > 0: concave jaw, < 0: convex jaw
  double taper_mm = 0.0;         ///< recess of the free outer face; assumed where it is not 0
  /// Inner radius of the ring of rubber that joins the lobes, bonded to the tips of the jaws; 0: no ring.
  double ring_radius_mm = 0.0;
};

struct NamedLobe {
  std::string_view name;
  LobeShape shape;
};

/// The seven geometries of paper 003, Figure 3: alpha, beta, gamma, delta, epsilon, zeta, eta.
[[nodiscard]] const std::vector<NamedLobe>& paper_lobes();

/// @throws UsageError if the name is none of the seven.
[[nodiscard]] const LobeShape& paper_lobe(std::string_view name);

/// Angle [rad] between the lobe's axis and its flank at a radius from the coupling's axis, exact
/// for straight and circular flanks.
[[nodiscard]] double flank_angle_rad(const LobeShape& shape, double radius_mm);

/// Smallest thickness [mm] of the jaw between two of the six lobes.
[[nodiscard]] double thinnest_jaw_mm(const LobeShape& shape);

/// @throws UsageError for a shape that cannot be built: radii or widths that are not positive or
///         not finite, flanks that cross the lobe's axis, an arc shorter than its chord, jaws
///         thinner than `least_jaw_mm`, a taper deeper than half of the lobe.
void check_lobe(const LobeShape& shape, double least_jaw_mm = 1.0);

}  // namespace torsio::design

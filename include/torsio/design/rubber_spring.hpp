#pragma once

#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "torsio/design/report.hpp"

namespace torsio {

/// Shear modulus [Pa] of rubber from its hardness: 0.117 exp(0.034 HS) MPa. Source: paper 002, which
/// prints no unit; the rule holds for 30 to 80 Shore A (assumed). @throws UsageError beyond it.
[[nodiscard]] double shear_modulus_of_hardness(double shore_A);

/// What a ring of rubber, bonded on its two flat ends and twisted, has to do. SI. Paper 002
/// prints the defaults of stress, bounds, weights.
struct RubberSpringDemand {
  double torque_Nm = 0.0;
  double angle_rad = 0.0;  ///< deflection under the torque
  double shear_modulus_Pa = 0.0;
  double correction = 1.0;  ///< measured stiffness over that of the formula
  double allowed_stress_Pa = 0.7e6;
  double safety = 1.0;             ///< the stress may be `allowed_stress_Pa / safety`
  double largest_outer_m = 0.010;  ///< radius
  double least_inner_m = 0.0;      ///< radius, of a shaft
  double least_length_m = 0.004;
  double largest_length_m = 0.010;
  double least_wall_m = 0.001;
  double weight_volume = 0.8;  ///< a, on mm^3/Nm
  double weight_length = 0.2;  ///< b, on mm
  double grid_m = 0.0001;
  double hardness_tolerance = 5.0;  ///< Shore
  double dimension_tolerance_m = 0.05e-3;
  /// Further ones, `length <= 0.6 * outer_radius`: expressions of outer_radius, inner_radius, wall,
  /// length [m], volume [m³], stress [Pa], strain, stiffness [Nm/rad].
  std::vector<std::string> constraints = {};
};

struct RubberRing {
  double outer_m = 0.0;  ///< radius
  double inner_m = 0.0;  ///< radius
  double length_m = 0.0;
};

/// A bound that the optimum lies on.
struct ActiveConstraint {
  std::string name;
  double multiplier = 0.0;  ///< change of the objective per `unit` of the bound
  std::string unit = {};    ///< "mm", "unit of its logarithm"
};

struct RubberSpringDesign {
  bool is_feasible = false;
  std::string infeasible;  ///< which bound would have to move to where
  RubberRing exact;
  RubberRing rounded;      ///< on the grid, and within the bounds again
  double objective = 0.0;  ///< at the exact optimum: a V/T + b L in mm^3/Nm and mm
  std::vector<ActiveConstraint> active;
  /// Outer radius [m] and the objective of the best ring with it, where there is one.
  std::vector<std::pair<double, double>> search = {};
};

/// Stiffness κ π G (r1⁴ − r2⁴) / (2 L) [Nm/rad]: torsion of a ring (St Venant). Source: 002 (1).
[[nodiscard]] double stiffness(const RubberRing& ring, double shear_modulus_Pa);
/// Largest shear stress 2 T r1 / (π (r1⁴ − r2⁴)) [Pa]. Source: 002 (2).
[[nodiscard]] double shear_stress(const RubberRing& ring, double torque_Nm);
/// a V/T + b L, V/T in mm³/Nm and L in mm. Source: 002 (4), whose unit is not printed.
[[nodiscard]] double objective(const RubberRing& ring, const RubberSpringDemand& demand);
/// Standard deviation of ln k from hardness and dimensions, independent of each other.
[[nodiscard]] double stiffness_tolerance(const RubberRing& ring, const RubberSpringDemand& demand);

/// The ring of the least objective (002 (1) to (4)).
///
/// With (1) as an equality, r2⁴ = r1⁴ − c L with c = 2 T / (π G θ), and (2) is a least length
/// L >= G θ r1 / [s]. For a given r1 the objective rises with L, so that the shortest allowed ring is
/// the best and r1 remains, which is searched. Where further constraints do not hold for that ring, L
/// is searched as well for each r1. Decision 0024.
/// @throws UsageError for a demand that is not finite, or bounds that contradict each other.
[[nodiscard]] RubberSpringDesign design_rubber_spring(const RubberSpringDemand& demand);

/// The design with all that follows from it.
[[nodiscard]] DesignReport rubber_spring_report(const RubberSpringDemand& demand);

/// A row of Table I of paper 002.
struct PublishedTorqueSensor {
  std::string_view name;
  std::string_view principle;
  double weight_g;      ///< NaN: not printed
  double volume_cm3;    ///< from the printed size
  double torque_Nm;     ///< NaN: not printed
  double ratio_cm3_Nm;  ///< printed; NaN: none
};
[[nodiscard]] std::span<const PublishedTorqueSensor> torque_sensors_002() noexcept;
/// Volume [cm³] of a sensor around a ring: a box that exceeds the ring as the printed one of 002
/// (29.5 x 18 x 24 mm) exceeds its ring (assumed).
[[nodiscard]] double sensor_volume_cm3(const RubberRing& ring);

}  // namespace torsio

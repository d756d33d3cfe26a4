#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include "powers.hpp"
#include "preferred_sizes.hpp"
#include "spring_kinds.hpp"

namespace torsio {
namespace {

using std::numbers::pi;
constexpr double kTurned_m = 0.1e-3;  // steps of outer diameters and lengths, which are turned
constexpr double kThinnestWall_m = 0.5e-3;
constexpr double kBuckling = 2.0;  // least buckling stress over the stress (assumed)
constexpr double kThinWall =
    0.1;  // wall over mean radius below which the formula of buckling holds
constexpr double kSolidFriction = 0.003;  // over the torque (assumed)

double turned_up(double value_m) { return std::ceil(value_m / kTurned_m - 1e-9) * kTurned_m; }
double turned(double value_m) { return std::round(value_m / kTurned_m) * kTurned_m; }

double buckling_of(const SpringDemand& d, double outer_m, double inner_m) {
  return buckling_stress(outer_m, inner_m, d.material.elastic_modulus_Pa, d.material.poisson);
}

/// The largest drill that leaves a wall which carries the torque and does not buckle; 0: none.
double widest_bore_m(const SpringDemand& d, double outer_m) {
  const double inner_fourth =
      fourth(outer_m) - 16.0 * d.torque_Nm * outer_m / (pi * allowed_shear_Pa(d));
  if (!(inner_fourth > 0.0)) return 0.0;
  double bore_m =
      drill_at_most_m(std::min(std::pow(inner_fourth, 0.25), outer_m - 2.0 * kThinnestWall_m));
  while (bore_m > 0.0 &&
         buckling_of(d, outer_m, bore_m) < kBuckling * rod_stress(outer_m, bore_m, d.torque_Nm))
    bore_m = drill_below_m(bore_m);
  return bore_m;
}

/// The buckling stress of a thin wall; of a thicker one the formula has no meaning, since it yields first.
DesignFigure buckling_figure(const SpringDemand& d, double outer_m, double inner_m) {
  const double wall_over_radius = 2.0 * (outer_m - inner_m) / (outer_m + inner_m);
  if (wall_over_radius > kThinWall)
    return {"buckling_stress", kNotMeasured, "MPa",
            "does not apply: the wall is thicker than a tenth of its radius and yields first"};
  return {"buckling_stress", buckling_of(d, outer_m, inner_m) * 1e-6, "MPa",
          "at least twice the shear stress"};
}

/// A rod or tube of these diameters; its length, which is turned, gives the stiffness.
SpringDesign rod_of(const SpringDemand& d, SpringKind kind, double outer_m, double inner_m) {
  const double modulus_Pa = d.material.shear_modulus_Pa;
  SpringDesign design{.kind = kind, .outer_m = outer_m, .inner_m = inner_m};
  design.length_m = turned(rod_stiffness(outer_m, inner_m, 1.0, modulus_Pa) / wanted_stiffness(d));
  design.envelope_m = outer_m;
  design.stress_Pa = rod_stress(outer_m, inner_m, d.torque_Nm);
  design.fatigue_margin = d.material.fatigue_shear_Pa / design.stress_Pa;
  design.is_feasible = design.stress_Pa <= allowed_shear_Pa(d) * (1.0 + 1e-9) &&
                       inner_m >= d.bore_m * (1.0 - 1e-9) &&
                       outer_m <= d.largest_diameter_m + 1e-12 && design.length_m > 0.0 &&
                       design.length_m <= d.largest_length_m + 1e-12;
  if (!design.is_feasible) return design;
  design.stiffness_Nm_rad = rod_stiffness(outer_m, inner_m, design.length_m, modulus_Pa);
  design.mass_kg = ring_mass_kg(d, outer_m, inner_m, design.length_m);
  design.friction_share = kSolidFriction;
  design.dimensions = {
      "spring",
      {{"outer_diameter", outer_m * 1e3, "mm", "turned, in steps of 0.1 mm"},
       {"inner_diameter", inner_m * 1e3, "mm", inner_m > 0.0 ? "a drill of ISO 235" : "solid"},
       {"length", design.length_m * 1e3, "mm", "between its ends, in steps of 0.1 mm"},
       {"shear_stress", design.stress_Pa * 1e-6, "MPa"},
       {"fatigue_margin", design.fatigue_margin, "",
        "fully reversed torque; below 1 it does not last"}}};
  if (kind == SpringKind::tube)
    design.dimensions.figures.push_back(buckling_figure(d, outer_m, inner_m));
  return design;
}

double thinnest_solid_m(const SpringDemand& d) {
  return turned_up(std::cbrt(16.0 * d.torque_Nm / (pi * allowed_shear_Pa(d))));
}

}  // namespace

double ring_mass_kg(const SpringDemand& d, double outer_m, double inner_m, double length_m) {
  return d.material.density_kg_m3 * pi / 4.0 * (outer_m * outer_m - inner_m * inner_m) * length_m;
}

std::optional<SpringDesign> best_rod(const SpringDemand& d) {
  // A thicker one is longer.
  SpringDesign design = rod_of(d, SpringKind::rod, thinnest_solid_m(d), 0.0);
  if (!design.is_feasible) return std::nullopt;
  return design;
}

std::optional<SpringDesign> best_tube(const SpringDemand& d) {
  const double first_m = thinnest_solid_m(d);
  for (int i = 0; first_m + i * kTurned_m <= d.largest_diameter_m + 1e-12; ++i) {
    const double outer_m = first_m + i * kTurned_m;
    // The stress alone demands this length, and the next one more.
    const double least_length_m =
        d.material.shear_modulus_Pa * d.angle_rad * outer_m / (2.0 * allowed_shear_Pa(d));
    if (least_length_m > d.largest_length_m + kTurned_m) break;
    const double bore_m = widest_bore_m(d, outer_m);
    if (!(bore_m > 0.0)) continue;
    SpringDesign design = rod_of(d, SpringKind::tube, outer_m, bore_m);
    if (design.is_feasible) return design;
  }
  return std::nullopt;
}

}  // namespace torsio

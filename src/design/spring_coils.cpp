#include <fmt/format.h>

#include <cmath>
#include <numbers>
#include <optional>

#include "preferred_sizes.hpp"
#include "spring_kinds.hpp"

namespace torsio {
namespace {

using std::numbers::pi;
constexpr double kPreload = 1.1;        // over the largest travel
constexpr double kSlender = 5.2;        // free length over coil diameter, ends guided
constexpr double kCoilFriction = 0.01;  // at the ends of the springs (assumed)

/// n springs of wire d and index c at a radius; none if they do not fit.
std::optional<SpringDesign> coils_of(const SpringDemand& d, int n, double wire, double index,
                                     double radius) {
  const double coil = wire * index;
  const double across = coil + wire;
  const double x = radius * std::sin(d.angle_rad);
  const double rate = d.torque_Nm / (n * radius * x * std::cos(d.angle_rad));
  const double active =
      d.material.shear_modulus_Pa * std::pow(wire, 4) / (8.0 * std::pow(coil, 3) * rate);
  if (active < 3.0 || active > 15.0) return std::nullopt;
  const double force = rate * (kPreload + 1.0) * x;
  const double stress = coil_stress(wire, coil, force);
  const double amplitude = coil_stress(wire, coil, rate * x);
  const double solid = (active + 2.0) * wire;
  const double installed = 1.1 * solid + x;
  const double free = installed + kPreload * x;
  const double envelope = 2.0 * std::hypot(radius + 0.5 * across, 0.5 * installed);
  if (stress > allowed_shear_Pa(d) || free > kSlender * coil || across > d.largest_length_m ||
      2.0 * radius - across < d.bore_m || installed + kLeverWidth_m > 2.0 * pi * radius / n ||
      envelope > d.largest_diameter_m)
    return std::nullopt;
  SpringDesign design{.kind = SpringKind::coils, .is_feasible = true};
  design.stiffness_Nm_rad = wanted_stiffness(d);
  design.mass_kg =
      n * d.material.density_kg_m3 * pi / 4.0 * wire * wire * pi * coil * (active + 2.0);
  design.length_m = across;
  design.envelope_m = envelope;
  design.stress_Pa = stress;
  design.fatigue_margin = d.material.fatigue_shear_Pa / amplitude;
  design.friction_share = kCoilFriction;
  design.dimensions = {
      "spring",
      {{"springs", static_cast<double>(n), "", "in opposed pairs, all in contact"},
       {"radius", radius * 1e3, "mm", "of the circle on which they act"},
       {"wire_diameter", wire * 1e3, "mm", "preferred size, R'20 of ISO 497"},
       {"coil_diameter", coil * 1e3, "mm", "in the middle of the wire"},
       {"active_coils", active},
       {"rate", rate * 1e-3, "N/mm", "of one spring"},
       {"free_length", free * 1e3, "mm"},
       {"installed_length", installed * 1e3, "mm"},
       {"preload_travel", kPreload * x * 1e3, "mm"},
       {"travel", x * 1e3, "mm"},
       {"largest_force", force, "N"},
       {"shear_stress", stress * 1e-6, "MPa", "with the factor of Wahl"},
       {"fatigue_margin", design.fatigue_margin, "", "of the amplitude"},
       {"slenderness", free / coil, "", fmt::format("buckling beyond {:g}", kSlender)}}};
  return design;
}

}  // namespace

std::optional<SpringDesign> best_coils(const SpringDemand& d) {
  std::optional<SpringDesign> best;
  for (const int n : {2, 4, 6, 8})
    for (const double wire_mm : preferred_wires_mm())
      for (int twice_index = 8; twice_index <= 24; ++twice_index)
        for (int percent = 40; percent < 99; percent += 2) {
          const double radius = 0.005 * percent * d.largest_diameter_m;
          auto design = coils_of(d, n, wire_mm * 1e-3, 0.5 * twice_index, radius);
          if (design && (!best || design->mass_kg < best->mass_kg)) best = std::move(design);
        }
  return best;
}

}  // namespace torsio

#include <cmath>
#include <optional>

#include "spring_kinds.hpp"

namespace torsio {
namespace {

constexpr double kDiscPreload = 0.375;  // share of h0: discs move from 0 to 0.75 h0
constexpr double kDiscFriction = 0.02;  // for each pair of sliding faces (assumed)

/// Two stacks; their radius gives the torque. None if they do not fit.
std::optional<SpringDesign> discs_of(const SpringDemand& d, const BellevilleWasher& w, int parallel,
                                     int series) {
  const double preload = kDiscPreload * w.cone_height_m;
  const auto torque = [&](double radius, double angle) {
    return disc_lever_torque(w, radius, preload, parallel, series, angle);
  };
  double low = 0.0;
  double high = preload * series / std::sin(d.angle_rad);  // where a disc loses its preload
  if (torque(high, d.angle_rad) < d.torque_Nm) return std::nullopt;
  for (int i = 0; i < 60; ++i) {
    const double middle = 0.5 * (low + high);
    (torque(middle, d.angle_rad) < d.torque_Nm ? low : high) = middle;
  }
  const double radius = high;
  const double stack = series * (w.cone_height_m - preload + parallel * w.thickness_m);
  const double travel = radius * std::sin(d.angle_rad) / series;
  const double envelope =
      2.0 * std::hypot(radius + 0.5 * w.outer_diameter_m, stack + 0.5 * kLeverWidth_m);
  if (2.0 * radius - w.outer_diameter_m < d.bore_m || w.outer_diameter_m > d.largest_length_m ||
      envelope > d.largest_diameter_m)
    return std::nullopt;
  SpringDesign design{.kind = SpringKind::discs, .is_feasible = true};
  design.stiffness_Nm_rad = torque(radius, d.angle_rad) / d.angle_rad;
  design.length_m = w.outer_diameter_m;
  design.envelope_m = envelope;
  design.stress_Pa = stress(w, preload + travel);
  design.mass_kg = 2 * series * parallel *
                   ring_mass_kg(d, w.outer_diameter_m, w.inner_diameter_m, w.thickness_m);
  design.friction_share = kDiscFriction * parallel;
  constexpr int kPoints = 10;
  for (int i = -kPoints; i <= kPoints; ++i) {
    const double angle = d.angle_rad * i / kPoints;
    if (i != 0) design.curve.emplace_back(angle, torque(radius, angle));
  }
  design.dimensions = {
      "spring",
      {{"washer", kNotMeasured, "", w.source, w.name},
       {"parallel", static_cast<double>(parallel)},
       {"series", static_cast<double>(series), "", "packs on each side of the lever"},
       {"radius", radius * 1e3, "mm", "of the lever"},
       {"stack_length", stack * 1e3, "mm", "on each side"},
       {"preload_travel", preload * 1e3, "mm", "of each disc"},
       {"travel", travel * 1e3, "mm", "of each disc"},
       {"stress", design.stress_Pa * 1e-6, "MPa", "sigma_OM"},
       {"friction_share", design.friction_share, "", "of the torque, assumed"}}};
  return design;
}

}  // namespace

std::optional<SpringDesign> best_discs(const SpringDemand& d) {
  std::optional<SpringDesign> best;
  for (const BellevilleWasher& washer : d.washers)
    for (int parallel = 1; parallel <= 6; ++parallel)
      for (int series = 2; series <= 60; ++series) {
        auto design = discs_of(d, washer, parallel, series);
        if (design && (!best || design->mass_kg < best->mass_kg)) best = std::move(design);
      }
  return best;
}

}  // namespace torsio

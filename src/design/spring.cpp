#include "torsio/design/spring.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>

#include "bound_search.hpp"
#include "core/did_you_mean.hpp"
#include "torsio/core/error.hpp"

namespace torsio {
namespace {

using std::numbers::pi;
constexpr std::array<std::string_view, 4> kShapeNames{"rod", "tube", "coils", "discs"};
constexpr std::array kKinds{SpringKind::rod, SpringKind::tube, SpringKind::coils,
                            SpringKind::discs};
constexpr double kGrid_m = 0.1e-3;  // for diameters and lengths
constexpr double kThinnestWall_m = 0.5e-3;
constexpr double kBuckling = 2.0;         // margin of a tube (assumed)
constexpr double kPreload = 1.1;          // for coil springs, over their largest travel
constexpr double kSlender = 5.2;          // free length over coil diameter, ends guided
constexpr double kLever_m = 6e-3;         // along the circle, for each spring (assumed)
constexpr double kDiscPreload = 0.375;    // share of h0: discs move from 0 to 0.75 h0
constexpr double kSolidFriction = 0.003;  // metal rod, over its torque (assumed)
constexpr double kCoilFriction = 0.01;    // at the ends of the springs (assumed)
constexpr double kDiscFriction = 0.02;    // for each pair of sliding faces (assumed)

double allowed(const SpringDemand& d) { return d.material.allowed_shear_Pa / d.safety; }
double wanted(const SpringDemand& d) { return d.torque_Nm / d.angle_rad; }
double ring_mass(const SpringDemand& d, double outer, double inner, double length) {
  return d.material.density_kg_m3 * pi / 4.0 * (outer * outer - inner * inner) * length;
}
double up(double value) { return std::ceil(value / kGrid_m - 1e-9) * kGrid_m; }

/// A rod or tube of an outer diameter: at least as long as the stress demands.
SpringDesign rod_of(const SpringDemand& d, SpringKind kind, double outer) {
  const double length = up(d.material.shear_modulus_Pa * d.angle_rad * outer / (2.0 * allowed(d)));
  const double inner_fourth =
      std::pow(outer, 4) - 32.0 * wanted(d) * length / (pi * d.material.shear_modulus_Pa);
  SpringDesign design{.kind = kind, .outer_m = outer, .length_m = length};
  design.inner_m = inner_fourth > 0.0 ? std::pow(inner_fourth, 0.25) : 0.0;
  if (kind == SpringKind::rod) {
    design.inner_m = 0.0;  // the length gives the stiffness
    design.length_m = rod_stiffness(outer, 0.0, 1.0, d.material.shear_modulus_Pa) / wanted(d);
  }
  const double stress = rod_stress(outer, design.inner_m, d.torque_Nm);
  const double buckling =
      buckling_stress(outer, design.inner_m, d.material.elastic_modulus_Pa, d.material.poisson);
  const bool is_shape = kind == SpringKind::rod ||
                        (inner_fourth > 0.0 && outer - design.inner_m >= 2.0 * kThinnestWall_m &&
                         buckling >= kBuckling * stress);
  design.is_feasible = is_shape && stress <= allowed(d) * (1.0 + 1e-9) &&
                       design.inner_m >= d.bore_m && outer <= d.largest_diameter_m &&
                       design.length_m <= d.largest_length_m;
  design.stiffness_Nm_rad =
      rod_stiffness(outer, design.inner_m, design.length_m, d.material.shear_modulus_Pa);
  design.mass_kg = ring_mass(d, outer, design.inner_m, design.length_m);
  design.friction_share = kSolidFriction;
  design.dimensions = {"spring",
                       {{"outer_diameter", outer * 1e3, "mm"},
                        {"inner_diameter", design.inner_m * 1e3, "mm"},
                        {"length", design.length_m * 1e3, "mm", "between its ends"},
                        {"shear_stress", stress * 1e-6, "MPa"},
                        {"fatigue_margin", d.material.fatigue_shear_Pa / stress, "",
                         "fully reversed torque; below 1 it does not last"}}};
  if (kind == SpringKind::tube)
    design.dimensions.figures.push_back({"buckling_stress", buckling * 1e-6, "MPa"});
  return design;
}

std::optional<SpringDesign> best_rod(const SpringDemand& d, SpringKind kind) {
  const double solid = std::cbrt(16.0 * d.torque_Nm / (pi * allowed(d)));
  const double first = up(solid);
  for (int i = 0; first + i * kGrid_m <= d.largest_diameter_m + 1e-12; ++i) {
    const double outer = first + i * kGrid_m;
    SpringDesign design = rod_of(d, kind, outer);
    if (design.is_feasible) return design;
    // A thicker one is longer.
    if (kind == SpringKind::rod || design.length_m > d.largest_length_m) break;
  }
  return std::nullopt;
}

constexpr auto kWires_mm = std::to_array<double>(
    {0.5, 0.63, 0.8, 1.0, 1.25, 1.6, 2.0, 2.5, 3.2, 4.0, 5.0, 6.3, 8.0, 10.0, 12.5});

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
  if (stress > allowed(d) || free > kSlender * coil || across > d.largest_length_m ||
      2.0 * radius - across < d.bore_m || installed + kLever_m > 2.0 * pi * radius / n ||
      2.0 * std::hypot(radius + 0.5 * across, 0.5 * installed) > d.largest_diameter_m)
    return std::nullopt;
  SpringDesign design{.kind = SpringKind::coils, .is_feasible = true};
  design.stiffness_Nm_rad = wanted(d);
  design.mass_kg =
      n * d.material.density_kg_m3 * pi / 4.0 * wire * wire * pi * coil * (active + 2.0);
  design.length_m = across;
  design.friction_share = kCoilFriction;
  design.dimensions = {
      "spring",
      {{"springs", static_cast<double>(n), "", "in opposed pairs, all in contact"},
       {"radius", radius * 1e3, "mm", "of the circle on which they act"},
       {"wire_diameter", wire * 1e3, "mm"},
       {"coil_diameter", coil * 1e3, "mm", "in the middle of the wire"},
       {"active_coils", active},
       {"rate", rate * 1e-3, "N/mm", "of one spring"},
       {"free_length", free * 1e3, "mm"},
       {"installed_length", installed * 1e3, "mm"},
       {"preload_travel", kPreload * x * 1e3, "mm"},
       {"travel", x * 1e3, "mm"},
       {"largest_force", force, "N"},
       {"shear_stress", stress * 1e-6, "MPa", "with the factor of Wahl"},
       {"fatigue_margin", d.material.fatigue_shear_Pa / amplitude, "", "of the amplitude"},
       {"slenderness", free / coil, "", fmt::format("buckling beyond {:g}", kSlender)}}};
  return design;
}

std::optional<SpringDesign> best_coils(const SpringDemand& d) {
  std::optional<SpringDesign> best;
  for (const int n : {2, 4, 6, 8})
    for (const double wire_mm : kWires_mm)
      for (int twice_index = 8; twice_index <= 24; ++twice_index)
        for (int percent = 40; percent < 99; percent += 2) {
          const double radius = 0.005 * percent * d.largest_diameter_m;
          auto design = coils_of(d, n, wire_mm * 1e-3, 0.5 * twice_index, radius);
          if (design && (!best || design->mass_kg < best->mass_kg)) best = std::move(design);
        }
  return best;
}

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
  if (2.0 * radius - w.outer_diameter_m < d.bore_m || w.outer_diameter_m > d.largest_length_m ||
      2.0 * std::hypot(radius + 0.5 * w.outer_diameter_m, stack + 0.5 * kLever_m) >
          d.largest_diameter_m)
    return std::nullopt;
  SpringDesign design{.kind = SpringKind::discs, .is_feasible = true};
  design.stiffness_Nm_rad = torque(radius, d.angle_rad) / d.angle_rad;
  design.length_m = w.outer_diameter_m;
  design.mass_kg =
      2 * series * parallel * ring_mass(d, w.outer_diameter_m, w.inner_diameter_m, w.thickness_m);
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
       {"stress", stress(w, preload + travel) * 1e-6, "MPa", "sigma_OM"},
       {"friction_share", design.friction_share, "", "of the torque, assumed"}}};
  return design;
}

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

std::optional<SpringDesign> best_of(const SpringDemand& d, SpringKind kind) {
  if (kind == SpringKind::coils) return best_coils(d);
  if (kind == SpringKind::discs) return best_discs(d);
  return best_rod(d, kind);
}

std::string infeasible(const SpringDemand& d, SpringKind kind) {
  using D = SpringDemand;
  std::vector<DesignBound<D>> bounds{
      {"largest diameter", &D::largest_diameter_m, 5.0 * d.largest_diameter_m, 1e3, "mm"},
      {"largest length", &D::largest_length_m, 5.0 * d.largest_length_m, 1e3, "mm"},
      {"torque", &D::torque_Nm, 0.01 * d.torque_Nm, 1.0, "Nm"},
      {"angle", &D::angle_rad, 0.01 * d.angle_rad, 180.0 / pi, "deg"}};
  if (d.bore_m > 0.0) bounds.push_back({"bore", &D::bore_m, 0.0, 1e3, "mm"});
  if (d.safety > 1.0) bounds.push_back({"safety factor", &D::safety, 1.0, 1.0, ""});
  return bounds_to_move<D>(d, bounds,
                           [kind](const D& moved) { return best_of(moved, kind).has_value(); });
}

void check(const SpringDemand& d) {
  const auto positive = [](const char* name, double value) {
    if (!(value > 0.0) || !std::isfinite(value))
      throw UsageError({.place = fmt::format("spring: {}", name),
                        .expected = "a finite number above 0",
                        .found = fmt::format("{}", value)});
  };
  positive("torque", d.torque_Nm);
  positive("angle", d.angle_rad);
  positive("largest diameter", d.largest_diameter_m);
  positive("largest length", d.largest_length_m);
  positive("load inertia", d.load_inertia_kg_m2);
  positive("allowed stress", d.material.allowed_shear_Pa);
  if (!(d.angle_rad <= 0.5 * pi / 2.0))
    throw UsageError({.place = "spring: angle",
                      .expected = "at most 45 deg",
                      .found = fmt::format("{:.4g} deg", d.angle_rad * 180.0 / pi)});
  if (!(d.largest_diameter_m <= 10.0 && d.largest_length_m <= 10.0))
    throw UsageError(
        {.place = "spring: envelope",
         .expected = "at most 10 m",
         .found = fmt::format("{:g} and {:g} m", d.largest_diameter_m, d.largest_length_m)});
  if (!(d.bore_m >= 0.0 && d.bore_m < d.largest_diameter_m))
    throw UsageError({.place = "spring: bore",
                      .expected = fmt::format("less than the largest diameter of {:g} mm",
                                              d.largest_diameter_m * 1e3),
                      .found = fmt::format("{:g} mm", d.bore_m * 1e3),
                      .advice = "The bounds contradict each other."});
  if (!(d.safety >= 1.0 && d.safety <= 100.0))
    throw UsageError({.place = "spring: safety factor",
                      .expected = "1 to 100",
                      .found = fmt::format("{}", d.safety)});
  if (!(d.encoder_bits >= 8.0 && d.encoder_bits <= 32.0))
    throw UsageError({.place = "spring: encoder",
                      .expected = "8 to 32 bits",
                      .found = fmt::format("{}", d.encoder_bits)});
}

}  // namespace

std::string_view name_of(SpringKind kind) noexcept {
  return kShapeNames.at(static_cast<std::size_t>(kind));
}

SpringKind spring_kind(std::string_view name) {
  const auto* const found = std::ranges::find(kShapeNames, name);
  if (found != kShapeNames.end())
    return kKinds.at(static_cast<std::size_t>(found - kShapeNames.begin()));
  throw UsageError({.place = "spring kind",
                    .expected = fmt::format("one of {}", fmt::join(kShapeNames, ", ")),
                    .found = "'" + std::string(name) + "'",
                    .advice = did_you_mean(name, kShapeNames)});
}

SpringDesign design_spring(const SpringDemand& demand, SpringKind kind) {
  check(demand);
  if (auto best = best_of(demand, kind)) return *best;
  return {.kind = kind,
          .infeasible = fmt::format("{}: {}", name_of(kind), infeasible(demand, kind))};
}

SpringDesign design_lightest_spring(const SpringDemand& demand) {
  check(demand);
  std::optional<SpringDesign> best;
  for (const SpringKind kind : kKinds) {
    auto design = best_of(demand, kind);
    if (design && (!best || design->mass_kg < best->mass_kg)) best = std::move(design);
  }
  if (best) return *best;
  SpringDesign none;
  for (const SpringKind kind : kKinds)
    none.infeasible += fmt::format("{}{}: {}", none.infeasible.empty() ? "" : "; ", name_of(kind),
                                   infeasible(demand, kind));
  return none;
}

}  // namespace torsio

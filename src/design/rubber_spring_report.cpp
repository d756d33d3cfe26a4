#include <fmt/format.h>

#include <array>
#include <cmath>
#include <numbers>

#include "torsio/core/units.hpp"
#include "torsio/design/rubber_spring.hpp"

namespace torsio {
namespace {

using std::numbers::pi;

// Table I of 002 as printed: the volume is that of the printed box or cylinder.
constexpr double kNone = kNotMeasured;
const std::array kSensors002{
    PublishedTorqueSensor{"Jo", "linear compression", 30.0, 18.0 * 77.0 * 36.0 * 1e-3, kNone,
                          kNone},
    PublishedTorqueSensor{"Agarwal1 (LC-sensor)", "linear compression", 30.0,
                          44.0 * 36.0 * 17.0 * 1e-3, 0.5, 53.86},
    PublishedTorqueSensor{"Agarwal2 (HT-sensor)", "helical torsion", 40.0,
                          38.0 * 38.0 * 24.0 * 1e-3, 0.3, 115.52},
    PublishedTorqueSensor{"Baldoni3", "linear compression", kNone,
                          pi / 4.0 * 17.0 * 17.0 * 28.0 * 1e-3, 0.2, 31.78},
    PublishedTorqueSensor{"Baldoni4", "linear compression", kNone,
                          pi / 4.0 * 16.0 * 16.0 * 30.0 * 1e-3, 0.2, 30.16},
    PublishedTorqueSensor{"Refour", "linear compression", kNone, kNone, kNone, kNone},
    PublishedTorqueSensor{"Guo", "wave spring", kNone, 56.0 * 19.0 * 19.0 * 1e-3, kNone, kNone},
    PublishedTorqueSensor{"Bianchi", "structural", kNone, kNone, 0.99, kNone},
    PublishedTorqueSensor{"Proposed", "rubber", 23.0, 29.5 * 18.0 * 24.0 * 1e-3, 0.5, 25.49}};

DesignSection ring_section(const std::string& name, const RubberRing& ring,
                           const RubberSpringDemand& demand) {
  const double k = stiffness(ring, demand.correction * demand.shear_modulus_Pa);
  const double angle = demand.torque_Nm / k;
  const double gamma = angle * ring.outer_m / ring.length_m;
  const double volume =
      pi * (ring.outer_m * ring.outer_m - ring.inner_m * ring.inner_m) * ring.length_m;
  const double wanted = demand.torque_Nm / demand.angle_rad;
  return {
      name,
      {{"outer_radius", ring.outer_m * 1e3, "mm"},
       {"inner_radius", ring.inner_m * 1e3, "mm"},
       {"length", ring.length_m * 1e3, "mm"},
       {"objective", objective(ring, demand), "", "mm^3/Nm and mm"},
       {"stiffness", k, "Nm/rad", fmt::format("{:+.2f} % of the demand", 100 * (k / wanted - 1))},
       {"deflection", deg_from_rad(angle), "deg", "under the torque"},
       {"shear_stress", shear_stress(ring, demand.torque_Nm) * 1e-6, "MPa"},
       {"shear_strain", gamma, ""},
       {"principal_stretch", 0.5 * gamma + std::sqrt(1.0 + 0.25 * gamma * gamma), ""},
       {"volume", volume * 1e9, "mm^3"},
       {"volume_per_torque", volume * 1e9 / demand.torque_Nm, "mm^3/Nm"}}};
}

DesignSection sensitivity_section(const RubberRing& ring, const RubberSpringDemand& demand) {
  const double area = std::pow(ring.outer_m, 4) - std::pow(ring.inner_m, 4);
  return {"sensitivity",
          {{"hardness", 3.4, "%", "of the stiffness per point Shore A"},
           {"outer_radius", 0.4 * std::pow(ring.outer_m, 3) / area, "%", "per mm"},
           {"inner_radius", -0.4 * std::pow(ring.inner_m, 3) / area, "%", "per mm"},
           {"length", -0.1 / ring.length_m, "%", "per mm"},
           {"tolerance", 100.0 * stiffness_tolerance(ring, demand), "%",
            fmt::format("+-{:g} Shore, +-{:g} mm, root of the sum of squares",
                        demand.hardness_tolerance, demand.dimension_tolerance_m * 1e3)}}};
}

XyFigure outline_figure(const RubberRing& ring) {
  const double length = ring.length_m * 1e3;
  const double outer = ring.outer_m * 1e3;
  const double inner = ring.inner_m * 1e3;
  const double gap = kNotMeasured;  // between the halves of the section
  return {.title = "Section of the ring along its axis",
          .x = {"along the axis [mm]"},
          .y = {"radius [mm]"},
          .series = {{.label = "rubber",
                      .x = {0.0, length, length, 0.0, 0.0, gap, 0.0, length, length, 0.0, 0.0},
                      .y = {inner, inner, outer, outer, inner, gap, -inner, -inner, -outer, -outer,
                            -inner}}},
          .is_equal = true};
}

XyFigure torque_figure(const RubberRing& ring, const RubberSpringDemand& demand) {
  const double k = stiffness(ring, demand.correction * demand.shear_modulus_Pa);
  const double spread = std::exp(stiffness_tolerance(ring, demand));
  const double end_rad = demand.torque_Nm / k;
  const auto line = [&](const char* label, CurveRole role, double factor) {
    return XySeries{.label = label,
                    .role = role,
                    .x = {0.0, deg_from_rad(end_rad)},
                    .y = {0.0, k * factor * end_rad}};
  };
  return {.title = "Torque over deflection",
          .x = {"deflection [deg]"},
          .y = {"torque [Nm]"},
          .series = {line("rounded", CurveRole::model, 1.0),
                     line("stiff end of the tolerance", CurveRole::limit, spread),
                     line("soft end of the tolerance", CurveRole::limit, 1.0 / spread),
                     {.label = "demand",
                      .style = CurveStyle::points,
                      .role = CurveRole::measured,
                      .x = {deg_from_rad(demand.angle_rad)},
                      .y = {demand.torque_Nm}}}};
}

XyFigure search_figure(const RubberSpringDesign& design) {
  XySeries search{.label = "best ring of a radius", .x = {}, .y = {}};
  for (const auto& [outer_m, value] : design.search) {
    search.x.push_back(outer_m * 1e3);
    search.y.push_back(value);
  }
  return {.title = "Objective over the outer radius, where a ring is possible",
          .x = {"outer radius [mm]"},
          .y = {"objective"},
          .series = {search,
                     {.label = "optimum",
                      .style = CurveStyle::points,
                      .role = CurveRole::measured,
                      .x = {design.exact.outer_m * 1e3},
                      .y = {design.objective}}}};
}

}  // namespace

std::span<const PublishedTorqueSensor> torque_sensors_002() noexcept { return kSensors002; }

double sensor_volume_cm3(const RubberRing& ring) {
  // 29.5 x 24 mm across and 18 mm along a ring of 20 mm and 4 mm.
  const double diameter_mm = 2e3 * ring.outer_m;
  return (diameter_mm + 9.5) * (diameter_mm + 4.0) * (1e3 * ring.length_m + 14.0) * 1e-3;
}

DesignReport rubber_spring_report(const RubberSpringDemand& demand) {
  const RubberSpringDesign design = design_rubber_spring(demand);
  DesignReport report{.design = "rubber-spring",
                      .is_feasible = design.is_feasible,
                      .infeasible = design.infeasible};
  report.sections.push_back(
      {"demand",
       {{"torque", demand.torque_Nm, "Nm"},
        {"angle", deg_from_rad(demand.angle_rad), "deg"},
        {"stiffness", demand.torque_Nm / demand.angle_rad, "Nm/rad"},
        {"shear_modulus", demand.shear_modulus_Pa * 1e-6, "MPa"},
        {"correction", demand.correction, "", "measured over formula"},
        {"allowed_stress", demand.allowed_stress_Pa / demand.safety * 1e-6, "MPa"}}});
  if (!design.is_feasible) return report;
  report.sections.push_back(ring_section("exact", design.exact, demand));
  report.sections.push_back(ring_section("rounded", design.rounded, demand));
  DesignSection active{"active"};
  for (const ActiveConstraint& each : design.active)
    active.figures.push_back({each.name, each.multiplier, "", "objective per " + each.unit});
  report.sections.push_back(std::move(active));
  report.sections.push_back(sensitivity_section(design.rounded, demand));
  const RubberRing& ring = design.rounded;
  report.pictures = {outline_figure(ring), torque_figure(ring, demand), search_figure(design)};
  if (report.at("rounded", "shear_strain").value > 1.0)
    report.notes.emplace_back("The shear strain exceeds 1: the linear formula is not reliable.");
  if (ring.length_m < ring.outer_m - ring.inner_m)
    report.notes.emplace_back("The ring is shorter than its wall is thick: clamping stiffens it.");
  report.notes.emplace_back(
      "Springs of 002 were measured 1.19 to 1.31 times as stiff as the formula: --correction takes "
      "a measured factor.");
  return report;
}

}  // namespace torsio

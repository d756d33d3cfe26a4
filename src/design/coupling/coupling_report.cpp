#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <numbers>

#include "torsio/core/error.hpp"
#include "torsio/core/units.hpp"
#include "torsio/design/coupling/coupling.hpp"
#include "torsio/report/document/report_document.hpp"

namespace torsio::design {
namespace {

using Points = std::vector<std::pair<double, double>>;

constexpr double kFrictionShare = 0.05;

DesignSection shape_section(const CouplingDemand& d) {
  const LobeShape& s = d.shape;
  const LobeShape& paper = paper_lobe(d.geometry);
  const auto length = [](const char* name, const char* unit, double value, double of_paper,
                         const char* origin) {
    return DesignFigure{name, value, unit, value == of_paper ? origin : "given"};
  };
  return {"geometry",
          {{"name", kNotMeasured, "", "", d.geometry},
           length("outer_radius", "mm", s.outer_radius_mm, paper.outer_radius_mm,
                  "printed in paper 003"),
           {"length", d.length_mm, "mm"},
           length("slot_angle", "deg", s.slot_angle_deg, paper.slot_angle_deg,
                  "printed; that it is the included one: assumed"),
           length("flank_radius", "mm", s.flank_radius_mm, paper.flank_radius_mm,
                  "printed; 0: straight, > 0: concave jaw, < 0: convex jaw"),
           length("root_radius", "mm", s.root_radius_mm, paper.root_radius_mm, "assumed"),
           length("half_width", "mm", s.half_width_mm, paper.half_width_mm,
                  "assumed; chosen on Table 2 of paper 003"),
           length("taper", "mm", s.taper_mm, paper.taper_mm, "assumed"),
           length("ring_radius", "mm", s.ring_radius_mm, paper.ring_radius_mm,
                  "0: no ring; its radii are not printed"),
           {"thinnest_jaw", thinnest_jaw_mm(s), "mm"}}};
}

DesignSection mesh_section(const CouplingDemand& d, const CouplingTwist& twist) {
  DesignSection section{"mesh", {}};
  const MeshDensity& asked = coupling_meshes().at(d.finest_mesh);
  for (const auto& [name, lobe] :
       {std::pair{"compressed", &twist.compressed}, std::pair{"stretched", &twist.stretched}}) {
    const bool is_coarser = lobe->density.radial != asked.radial;
    const bool is_whole = lobe->curve.stopped_by.empty();
    section.figures.push_back(
        {name, static_cast<double>(lobe->mesh.triangles.size()), "",
         fmt::format("triangles, {} x {}{}{}{}", lobe->density.radial, lobe->density.across,
                     d.layers > 0 ? fmt::format(", {} layers of wedges on them", d.layers) : "",
                     is_coarser ? "; the finer mesh stopped earlier" : "",
                     is_whole ? "" : "; " + lobe->curve.stopped_by)});
  }
  return section;
}

DesignSection strain_section(const CouplingTwist& twist) {
  DesignSection section{"largest_strain", {}};
  for (const auto& [name, lobe] :
       {std::pair{"compressed", &twist.compressed}, std::pair{"stretched", &twist.stretched}}) {
    if (lobe->curve.steps.empty()) continue;
    const TwistStep& last = lobe->curve.steps.back();
    const std::string at = fmt::format("at {:.4g} deg", std::abs(last.twist_deg));
    const std::string lobe_name = name;
    section.figures.push_back({lobe_name + "_outside_0.8mm", 100.0 * last.strain_outside_800um, "%",
                               at + ", logarithmic; depends least on the mesh"});
    section.figures.push_back({lobe_name + "_outside_0.3mm", 100.0 * last.strain_outside_300um, "%",
                               at + "; depends on the mesh"});
    section.figures.push_back({lobe_name + "_all", 100.0 * last.strain, "%",
                               at + "; singular at the ends of a bond: compare on one mesh only"});
  }
  return section;
}

/// A lobe, not deformed, with the strain of its last step. @param highest_pct the strain of red
FieldFigure lobe_figure(const LobeCurve& lobe, const char* name, double highest_pct) {
  const auto& steps = lobe.curve.steps;
  FieldFigure figure{
      .title = fmt::format("Strain of the {} lobe{}", name,
                           steps.empty()
                               ? ", no converged step"
                               : fmt::format(" at {:.4g} deg", std::abs(steps.back().twist_deg))),
      .value_label = "%",
      .highest = highest_pct,
      .areas = {}};
  figure.areas.reserve(lobe.mesh.triangles.size());
  for (std::size_t i = 0; i < lobe.mesh.triangles.size(); ++i) {
    const auto& nodes = lobe.mesh.triangles[i];
    FieldFigure::Area area{
        .corners = {},
        .value = steps.empty() ? kNotMeasured : 100.0 * steps.back().element_strains[i]};
    // Around the triangle: corner, middle of the edge, corner.
    for (const std::size_t k : {0U, 3U, 1U, 4U, 2U, 5U}) {
      const MeshNode& node = lobe.mesh.nodes[static_cast<std::size_t>(nodes[k])];
      area.corners.push_back({node.x_mm, node.y_mm});
    }
    figure.areas.push_back(std::move(area));
  }
  return figure;
}

/// The largest strain in the last steps of both lobes.
double largest_strain_pct(const CouplingTwist& twist) {
  double strain = 1e-9;
  for (const LobeCurve* lobe : {&twist.compressed, &twist.stretched})
    if (!lobe->curve.steps.empty())
      strain = std::max(strain, lobe->curve.steps.back().strain_outside_300um);
  return 100.0 * strain;
}

XyFigure curve_figure(const Points& curve) {
  XySeries torque{.label = "coupling", .x = {}, .y = {}};
  for (const auto& [angle_deg, torque_Nm] : curve) {
    torque.x.push_back(angle_deg);
    torque.y.push_back(torque_Nm);
  }
  return {
      .title = "Torque over twist", .x = {"twist [deg]"}, .y = {"torque [Nm]"}, .series = {torque}};
}

XyFigure strain_figure(const CouplingTwist& twist) {
  XyFigure figure{.title = "Largest logarithmic strain over twist",
                  .x = {"twist [deg]"},
                  .y = {"strain [%]"},
                  .series = {}};
  for (const auto& [name, lobe] :
       {std::pair{"compressed", &twist.compressed}, std::pair{"stretched", &twist.stretched}})
    for (const auto& [metric, of] : {std::pair{StrainMetric::outside_800um, ", outside 0.8 mm"},
                                     std::pair{StrainMetric::outside_300um, ", outside 0.3 mm"}}) {
      XySeries series{
          .label = std::string(name) + of,
          .role = metric == StrainMetric::outside_800um ? CurveRole::model : CurveRole::limit,
          .x = {0.0},
          .y = {0.0}};
      for (const TwistStep& step : lobe->curve.steps) {
        series.x.push_back(std::abs(step.twist_deg));
        series.y.push_back(100.0 * strain_of(step, metric));
      }
      figure.series.push_back(std::move(series));
    }
  return figure;
}

}  // namespace

DesignReport coupling_report(const CouplingDemand& demand, const CouplingTwist& twist,
                             double shear_modulus_MPa, const std::string& calibration,
                             const std::optional<CouplingLimit>& limit) {
  DesignReport report{.design = "coupling"};
  report.sections.push_back(shape_section(demand));
  report.sections.push_back(
      {"material",
       {{"shear_modulus", shear_modulus_MPa, "MPa", calibration},
        {"bulk_modulus", demand.bulk_ratio * shear_modulus_MPa, "MPa", "assumed, by the ratio"},
        {"law", kNotMeasured, "", "assumed",
         demand.layers > 0 ? "neo-Hooke, solid, bonded" : "neo-Hooke, plane strain, bonded"}}});
  report.sections.push_back(mesh_section(demand, twist));
  const Points curve = torque_curve(twist, demand.length_mm, shear_modulus_MPa);
  DesignSection torques{"torque", {}};
  for (std::size_t i = 1; i < curve.size(); ++i)
    torques.figures.push_back({fmt::format("at_{:g}_deg", curve[i].first), curve[i].second, "Nm"});
  if (curve.back().first < demand.angle_deg - 1e-9)
    torques.figures.push_back(
        {fmt::format("at_{:g}_deg", demand.angle_deg), kNotMeasured, "Nm", "", "not reached"});
  report.sections.push_back(std::move(torques));
  report.sections.push_back(strain_section(twist));
  if (limit) {
    const auto angle_deg = angle_at_strain(twist, limit->strain, limit->metric);
    report.sections.push_back(
        {"at_strain_limit",
         {{"strain", 100.0 * limit->strain, "%"},
          {"angle", angle_deg.value_or(kNotMeasured), "deg", "", angle_deg ? "" : "not reached"},
          {"torque", angle_deg ? *torque_at(curve, *angle_deg) : kNotMeasured, "Nm", "",
           angle_deg ? "" : "not reached"}}});
    if (!angle_deg) {
      report.is_feasible = false;
      report.infeasible =
          fmt::format("the strain limit of {:.4g} % is not reached up to {:.4g} deg, {}",
                      100.0 * limit->strain, curve.back().first,
                      curve.back().first < demand.angle_deg - 1e-9
                          ? "the last twist that converged: use a coarser mesh"
                          : "the largest twist: a larger angle is needed");
    }
  }
  const double highest_pct = largest_strain_pct(twist);
  report.pictures = {lobe_figure(twist.compressed, "compressed", highest_pct),
                     lobe_figure(twist.stretched, "stretched", highest_pct), curve_figure(curve),
                     strain_figure(twist)};
  report.notes = {
      demand.layers > 0
          ? "The ends of the lobes are free: the torque is less than in plane strain."
          : "Plane strain overestimates the torque by 20 to 35 % where the length is about three "
            "slot "
            "widths: it is for the comparison of shapes; --layers 3 computes a solid.",
      "The hardness fixes the shear modulus only within a factor of 4 to 5; a measured torque "
      "fixes "
      "it for this model.",
      demand.shape.ring_radius_mm > 0.0
          ? "Six bonded lobes and their ring; nothing is extrapolated beyond the last converged "
            "step."
          : "Six bonded lobes without the inner ring; nothing is extrapolated beyond the last "
            "converged step."};
  return report;
}

DataSheet coupling_sheet(const Points& curve, const std::string& name) {
  if (curve.size() < 2)
    throw Error({.place = "data sheet of the coupling", .problem = "no step converged"});
  const SpringDemand demand{.torque_Nm = curve.back().second,
                            .angle_rad = rad_from_deg(curve.back().first)};
  SpringDesign design;
  design.is_feasible = true;
  design.stiffness_Nm_rad = demand.torque_Nm / demand.angle_rad;
  design.friction_share = kFrictionShare;
  for (std::size_t i = curve.size(); i-- > 1;)  // the first point is 0
    design.curve.emplace_back(-rad_from_deg(curve[i].first), -curve[i].second);
  for (const auto& [angle_deg, torque_Nm] : curve)
    design.curve.emplace_back(rad_from_deg(angle_deg), torque_Nm);
  return spring_sheet(demand, design, name);
}

}  // namespace torsio::design

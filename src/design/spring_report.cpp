#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <string>
#include <utility>
#include <variant>

#include "spring_kinds.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/units.hpp"
#include "torsio/design/spring.hpp"

namespace torsio {
namespace {

XyFigure torque_figure(const SpringDemand& d, const SpringDesign& design) {
  XySeries spring{.label = "spring", .x = {}, .y = {}};
  const auto add = [&](double angle_rad, double torque_Nm) {
    spring.x.push_back(deg_from_rad(angle_rad));
    spring.y.push_back(torque_Nm);
  };
  const double end_rad = d.torque_Nm / design.stiffness_Nm_rad;
  if (design.curve.empty()) {
    add(-end_rad, -d.torque_Nm);
    add(end_rad, d.torque_Nm);
  }
  for (const auto& [angle, torque] : design.curve) add(angle, torque);
  const XySeries demand{.label = "demand",
                        .style = CurveStyle::points,
                        .role = CurveRole::measured,
                        .x = {deg_from_rad(d.angle_rad)},
                        .y = {d.torque_Nm}};
  return {.title = "Torque over deflection",
          .x = {"deflection [deg]"},
          .y = {"torque [Nm]"},
          .series = {spring, demand}};
}

double resonance_Hz(const SpringDemand& d, const SpringDesign& design) {
  return std::sqrt(design.stiffness_Nm_rad / d.load_inertia_kg_m2) / (2.0 * std::numbers::pi);
}

DesignTable kinds_table(const SpringDemand& d, const SpringDesign& design,
                        std::span<const SpringDesign> kinds) {
  DesignTable table{.name = "kinds", .row_name = "kind"};
  for (const SpringDesign& each : kinds) {
    DesignAlternative row{.name = std::string(name_of(each.kind)),
                          .is_chosen = design.is_feasible && each.kind == design.kind,
                          .infeasible = each.infeasible};
    if (each.is_feasible)
      row.figures = {
          {"mass", each.mass_kg * 1e3, "g"},         {"diameter", each.envelope_m * 1e3, "mm"},
          {"length", each.length_m * 1e3, "mm"},     {"stress", each.stress_Pa * 1e-6, "MPa"},
          {"fatigue_margin", each.fatigue_margin},   {"friction", 100.0 * each.friction_share, "%"},
          {"resonance", resonance_Hz(d, each), "Hz"}};
    table.rows.push_back(std::move(row));
  }
  return table;
}

/// The spring that a call with this demand designs.
std::optional<SpringDesign> designed(const SpringDemand& d, std::optional<SpringKind> kind) {
  if (kind) return best_of(d, *kind);
  const SpringDesign lightest = design_lightest_spring(d);
  return lightest.is_feasible ? std::optional(lightest) : std::nullopt;
}

bool lasts(const SpringDemand& d, std::optional<SpringKind> kind) {
  const auto design = designed(d, kind);
  return design && design->fatigue_margin >= 1.0;
}

constexpr double kFurthest = 5.0;  // times a bound, as the message of an infeasible design

/// The least bound in whole millimetres with which the spring lasts; none up to `kFurthest` times it.
std::optional<double> lasting_bound_mm(SpringDemand d, double SpringDemand::*bound,
                                       std::optional<SpringKind> kind) {
  auto low_mm = static_cast<int>(std::floor(d.*bound * 1e3));
  auto high_mm = static_cast<int>(std::floor(kFurthest * d.*bound * 1e3));
  const auto lasts_with = [&](int value_mm) {
    d.*bound = 1e-3 * value_mm;
    return lasts(d, kind);
  };
  if (!lasts_with(high_mm)) return std::nullopt;
  while (high_mm - low_mm > 1) {
    const int middle_mm = (low_mm + high_mm) / 2;
    (lasts_with(middle_mm) ? high_mm : low_mm) = middle_mm;
  }
  return high_mm;
}

/// The options that make a spring last which does not; empty: none were found.
std::string lasting_options(SpringDemand d, const SpringDesign& design,
                            std::optional<SpringKind> kind) {
  constexpr int kTries = 5;  // dimensions are rounded, so that the estimate can be too low
  const double first = std::ceil(10.0 * d.safety / design.fatigue_margin) / 10.0;
  std::string wider;
  for (int n = 0; n < kTries; ++n) {
    d.safety = first + 0.1 * n;
    const std::string safety = fmt::format("--safety {:.3g}", d.safety);
    if (lasts(d, kind)) return safety;
    if (!wider.empty()) continue;
    for (const auto& [option, bound] :
         {std::pair{"--max-length", &SpringDemand::largest_length_m},
          std::pair{"--max-diameter", &SpringDemand::largest_diameter_m}})
      if (const auto found_mm = lasting_bound_mm(d, bound, kind))
        wider +=
            fmt::format("{}{} {} {:g}mm", wider.empty() ? "" : " or ", safety, option, *found_mm);
  }
  return wider;
}

}  // namespace

void note_fatigue(DesignReport& report, const SpringDemand& d, const SpringDesign& design,
                  bool can_choose_kind) {
  if (!(design.fatigue_margin < 1.0)) return;
  std::string options = lasting_options(d, design, std::nullopt);
  if (options.empty() && can_choose_kind) {
    options = lasting_options(d, design, design.kind);
    if (!options.empty()) options += fmt::format(", with --kind {}", name_of(design.kind));
  }
  report.notes.push_back(
      "The spring does not last under this torque in both directions: " +
      (options.empty() ? fmt::format("neither --safety nor {:g} times the envelope makes it last; "
                                     "take less torque, more angle or another material.",
                                     kFurthest)
                       : options + " makes it last."));
}

DesignReport spring_report(const SpringDemand& d, const SpringDesign& design,
                           std::span<const SpringDesign> kinds) {
  DesignReport report{
      .design = "spring", .is_feasible = design.is_feasible, .infeasible = design.infeasible};
  report.sections.push_back(
      {"demand",
       {{"torque", d.torque_Nm, "Nm"},
        {"angle", deg_from_rad(d.angle_rad), "deg"},
        {"stiffness", d.torque_Nm / d.angle_rad, "Nm/rad"},
        {"largest_diameter", d.largest_diameter_m * 1e3, "mm"},
        {"largest_length", d.largest_length_m * 1e3, "mm"},
        {"bore", d.bore_m * 1e3, "mm"},
        {"material", kNotMeasured, "", d.material.source, d.material.name},
        {"allowed_shear", d.material.allowed_shear_Pa / d.safety * 1e-6, "MPa"}}});
  if (!kinds.empty()) report.tables.push_back(kinds_table(d, design, kinds));
  const auto discs = std::ranges::find(kinds, SpringKind::discs, &SpringDesign::kind);
  if (discs != kinds.end() && discs->is_feasible)
    report.notes.emplace_back(
        "The stress of discs is the compressive one at the middle of their section (sigma_OM), the "
        "others are shear stresses.");
  if (!design.is_feasible) return report;
  DesignSection section = design.dimensions;
  section.figures.insert(section.figures.begin(), DesignFigure{"kind", kNotMeasured, "", "",
                                                               std::string(name_of(design.kind))});
  report.sections.push_back(std::move(section));
  const double k = design.stiffness_Nm_rad;
  const double lsb_rad = 2.0 * std::numbers::pi / std::exp2(d.encoder_bits);
  report.sections.push_back(
      {"joint",
       {{"stiffness", k, "Nm/rad"},
        {"deflection", deg_from_rad(d.torque_Nm / k), "deg", "under the torque"},
        {"mass", design.mass_kg * 1e3, "g", "of the spring without its ends"},
        {"torque_resolution", k * lsb_rad, "Nm",
         fmt::format("one step of an encoder of {:g} bits", d.encoder_bits)},
        {"resonance", resonance_Hz(d, design), "Hz",
         fmt::format("with a load of {:g} kg m2, rotor held", d.load_inertia_kg_m2)}}});
  report.pictures.emplace_back(torque_figure(d, design));
  note_fatigue(report, d, design, true);
  const bool is_rod = design.kind == SpringKind::rod || design.kind == SpringKind::tube;
  if (is_rod && design.length_m < 2.0 * design.outer_m)
    report.notes.emplace_back(
        "The length is below two diameters: the ends determine the stiffness.");
  report.notes.emplace_back(
      "Formulae of slender springs without the ends: a measured stiffness replaces them.");
  return report;
}

void set_spring(DataSheet& sheet, const SpringDemand& d, const SpringDesign& design) {
  auto& spring = std::get<SpringSheet>(sheet.second);
  spring.stiffness_Nm_rad = derived(design.stiffness_Nm_rad);
  spring.stage_rad = assumed(0.0);
  spring.stage_stiffness_Nm_rad = assumed(0.0);
  spring.half_gap_rad = assumed(rad_from_deg(0.01));
  spring.asymmetry = assumed(0.0);
  // Half of the friction does not depend on the load.
  spring.friction_Nm = assumed(0.5 * design.friction_share * d.torque_Nm);
  spring.load_friction = assumed(0.5 * design.friction_share);
  spring.curve.clear();
  for (const auto& [angle, torque] : design.curve)
    spring.curve.push_back({derived(angle), derived(torque)});
  sheet.sensors.torque_range_Nm =
      assumed(std::max(sheet.sensors.torque_range_Nm.value, 1.5 * d.torque_Nm));
}

DataSheet spring_sheet(const SpringDemand& d, const SpringDesign& design, const std::string& name) {
  const DataSheet* base = nullptr;
  for (const DataSheet& each : data_sheets()) {
    if (each.family != ActuatorFamily::series_elastic) continue;
    if (base == nullptr || base->rating.torque_Nm.value < d.torque_Nm) base = &each;
  }
  if (base == nullptr) throw Error({.problem = "no series-elastic drive is known"});
  DataSheet sheet = *base;
  sheet.name = name;
  sheet.title = fmt::format("designed spring of {:.4g} Nm/rad in the drive of {}",
                            design.stiffness_Nm_rad, base->name);
  sheet.rating.torque_Nm = assumed(d.torque_Nm);
  set_spring(sheet, d, design);
  return sheet;
}

}  // namespace torsio

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

#include "paper_figures.hpp"
#include "studies.hpp"
#include "torsio/design/coupling/coupling.hpp"

namespace torsio {
namespace {

using design::StrainMetric;

constexpr double kLimit = 0.6;  // strain of Table 2

const PaperFigure& figure_of(std::string_view geometry, std::string_view quantity) {
  return *std::ranges::find_if(kPaperFigures, [&](const PaperFigure& each) {
    return each.paper == "003" && each.item == "Table 2" && each.condition == geometry &&
           each.quantity == quantity;
  });
}

struct Twisted {
  std::string geometry;
  PaperFigure torque;
  design::CouplingDemand demand;
  design::CouplingTwist twist;
  std::optional<double> unit_Nm;  ///< torque at the angle of Table 2 for G = 1 MPa

  /// Beta differs from eta in its tapering radius, whose size is not printed.
  [[nodiscard]] bool is_fitted() const { return unit_Nm && geometry != "beta"; }
};

/// The modulus [MPa] with the least sum of squared relative errors of the torques.
double fitted_modulus(const std::vector<Twisted>& all) {
  double sum = 0.0;
  double squares = 0.0;
  for (const Twisted& each : all) {
    if (!each.is_fitted()) continue;
    const double ratio = *each.unit_Nm / each.torque.value;
    sum += ratio;
    squares += ratio * ratio;
  }
  return sum / squares;
}

std::string remark_of(const Twisted& each, double torque_Nm) {
  if (!each.unit_Nm) return "not reached: " + each.twist.compressed.curve.stopped_by;
  return fmt::format("{:+.1f} %{}", 100.0 * (torque_Nm / each.torque.value - 1.0),
                     each.is_fitted() ? "" : ", not in the fit");
}

void add_rows(QuantityTable& table, const Twisted& each, double modulus_MPa) {
  const double torque_Nm = each.unit_Nm ? modulus_MPa * *each.unit_Nm : kNotMeasured;
  table.rows.push_back({each.geometry, fmt::format("torque at {:g} deg", each.demand.angle_deg),
                        torque_Nm, "Nm", each.torque, remark_of(each, torque_Nm)});
  for (const auto& [metric, name] : {std::pair{StrainMetric::outside_800um, "0.8 mm"},
                                     std::pair{StrainMetric::outside_300um, "0.3 mm"}}) {
    double strain = kNotMeasured;
    if (each.unit_Nm)
      strain = 100.0 * std::max(strain_of(each.twist.compressed.curve.steps.back(), metric),
                                strain_of(each.twist.stretched.curve.steps.back(), metric));
    table.rows.push_back({each.geometry,
                          fmt::format("largest strain there, outside {}", name),
                          strain,
                          "%",
                          {},
                          ""});
  }
  const auto angle_deg = angle_at_strain(each.twist, kLimit, StrainMetric::outside_300um);
  table.rows.push_back({each.geometry, "twist at 60 % strain, outside 0.3 mm",
                        angle_deg.value_or(kNotMeasured), "deg", figure_of(each.geometry, "twist"),
                        angle_deg ? "" : "not reached up to the printed twist"});
}

/// The strains of Figure 5 reach 15 degrees for both lobes: as far as the solver converges, on the coarse mesh.
void add_curve(QuantityTable& table, const std::string& geometry,
               const design::CouplingTwist& twist, double length_mm, double modulus_MPa) {
  constexpr double kWanted_deg = 15.0;
  const auto reached = [&](const design::LobeCurve& lobe) {
    return lobe.curve.steps.empty() ? 0.0 : std::abs(lobe.curve.steps.back().twist_deg);
  };
  for (const auto& [name, lobe] :
       {std::pair{"compressed", &twist.compressed}, std::pair{"stretched", &twist.stretched}})
    table.rows.push_back({geometry,
                          fmt::format("twist reached, {}", name),
                          reached(*lobe),
                          "deg",
                          {},
                          reached(*lobe) < kWanted_deg ? "Figure 5: 15 deg" : "as in Figure 5"});
  const auto curve = torque_curve(twist, length_mm, modulus_MPa);
  for (const double angle_deg : {3.0, 6.0, 9.0, 12.0, 15.0}) {
    const auto torque_Nm = design::torque_at(curve, angle_deg);
    if (!torque_Nm) continue;
    table.rows.push_back(
        {geometry, fmt::format("torque at {:g} deg, coarse", angle_deg), *torque_Nm, "Nm", {}, ""});
  }
}

}  // namespace

Study coupling_003(const StudyOptions& options, const Progress& progress) {
  Study study{.protocol =
                  "one lobe, bonded, neo-Hooke, plane strain, without the inner ring, "
                  "compressed and stretched up to the twist that Table 2 prints",
              .unit = "",
              .options = options};
  std::vector<Twisted> all;
  std::vector<design::CouplingTwist> curves;  // up to 15 degrees
  const auto& lobes = design::paper_lobes();
  for (std::size_t i = 0; i < lobes.size(); ++i) {
    Twisted each{.geometry = std::string(lobes[i].name),
                 .torque = figure_of(lobes[i].name, "torque"),
                 .demand = {.geometry = std::string(lobes[i].name), .shape = lobes[i].shape},
                 .twist = {},
                 .unit_Nm = {}};
    each.demand.angle_deg = figure_of(lobes[i].name, "twist").value;
    each.demand.finest_mesh = options.is_quick ? 2 : 1;
    const auto count = static_cast<double>(lobes.size());
    each.twist = design::twist_coupling(each.demand, [&](double fraction, std::string_view) {
      return !progress ||
             progress((static_cast<double>(i) + 0.5 * fraction) / count, each.geometry);
    });
    each.unit_Nm = design::torque_at(torque_curve(each.twist, each.demand.length_mm, 1.0),
                                     each.demand.angle_deg);
    if (!options.is_quick) {
      design::CouplingDemand whole = each.demand;
      whole.angle_deg = 15.0;
      whole.finest_mesh = 2;
      curves.push_back(design::twist_coupling(whole, [&](double fraction, std::string_view) {
        return !progress ||
               progress((static_cast<double>(i) + 0.5 + 0.5 * fraction) / count, each.geometry);
      }));
    }
    all.push_back(std::move(each));
  }
  const double modulus_MPa = fitted_modulus(all);
  QuantityTable table;
  table.rows.push_back({"all",
                        "fitted shear modulus",
                        modulus_MPa,
                        "MPa",
                        {},
                        "on six torques of Table 2, without beta"});
  for (const Twisted& each : all) add_rows(table, each, modulus_MPa);
  for (std::size_t i = 0; i < curves.size(); ++i)
    add_curve(table, all[i].geometry, curves[i], all[i].demand.length_mm, modulus_MPa);
  study.table = std::move(table);
  study.notes.emplace_back(
      "This is a fit: the modulus is fitted on the torques beside which it is printed, and the "
      "assumed widths of the slots were chosen on the same table. Beta is excluded from the fit: "
      "it differs from eta in a tapering radius, whose size is not printed and is assumed here.");
  study.notes.emplace_back(
      "The strains near the ends of a bond are singular. The paper names neither its strain nor "
      "its "
      "mesh, so that the twists at 60 % have no target. Seed and repeats have no effect.");
  return study;
}

}  // namespace torsio

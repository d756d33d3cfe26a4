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
// The drawn curves of Figure 6 reach 15 deg.
constexpr double kTorqueStep_deg = 0.5;
constexpr int kTorquePoints = 30;

const PaperFigure& figure_of(std::string_view geometry, std::string_view quantity) {
  return *find_paper_figure("003", "Table 2", geometry, quantity);
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

/// Torques at the twists of Table 2 with the modulus that gives alpha its torque: a prediction of the others from
/// one number of the table.
void add_prediction(QuantityTable& table, const std::vector<Twisted>& all) {
  const auto alpha = std::ranges::find(all, "alpha", &Twisted::geometry);
  if (alpha == all.end() || !alpha->unit_Nm) return;
  const double modulus_MPa = alpha->torque.value / *alpha->unit_Nm;
  const auto rank = [&](const Twisted& of, const auto& torque_of) {
    return 1 + std::ranges::count_if(
                   all, [&](const Twisted& other) { return torque_of(other) > torque_of(of); });
  };
  const auto ours = [&](const Twisted& of) { return of.unit_Nm ? modulus_MPa * *of.unit_Nm : 0.0; };
  const auto papers = [](const Twisted& of) { return of.torque.value; };
  table.rows.push_back({"predicted", "shear modulus from alpha alone", modulus_MPa, "MPa", {}, ""});
  for (const Twisted& each : all)
    table.rows.push_back(
        {"predicted", fmt::format("torque of {} at {:g} deg", each.geometry, each.demand.angle_deg),
         each.unit_Nm ? ours(each) : kNotMeasured, "Nm", each.torque,
         fmt::format("place {} of {}, printed {}{}", rank(each, ours), all.size(),
                     rank(each, papers), each.geometry == "alpha" ? "; by definition" : "")});
}

/// By lines between converged steps; NaN beyond the last.
double strain_at(const design::LobeCurve& lobe, double angle_deg) {
  double before_deg = 0.0;
  double before = 0.0;
  for (const design::TwistStep& step : lobe.curve.steps) {
    const double now_deg = std::abs(step.twist_deg);
    const double now = strain_of(step, StrainMetric::outside_300um);
    if (now_deg >= angle_deg)
      return before + (now - before) * (angle_deg - before_deg) / (now_deg - before_deg);
    before_deg = now_deg;
    before = now;
  }
  return kNotMeasured;
}

/// Figures 4 and 5: the strains of both lobes at 9 and 12 degrees, on the coarse mesh.
void add_strains(QuantityTable& table, const std::string& geometry,
                 const design::CouplingTwist& twist) {
  for (const double angle_deg : {9.0, 12.0})
    for (const auto& [name, lobe] :
         {std::pair{"compressed", &twist.compressed}, std::pair{"stretched", &twist.stretched}}) {
      std::optional<PaperFigure> published;
      const bool is_compressed = lobe == &twist.compressed;
      if (is_compressed && geometry == "delta" && angle_deg == 9.0)
        published = paper_figure("003", "Fig. 4", "delta at 9 deg", "strain");
      if (is_compressed && geometry == "zeta" && angle_deg == 12.0)
        published = paper_figure("003", "Fig. 4", "zeta at 12 deg", "strain");
      table.rows.push_back(
          {geometry, fmt::format("strain at {:g} deg, {}, outside 0.3 mm, coarse", angle_deg, name),
           100.0 * strain_at(*lobe, angle_deg), "%", published,
           published && geometry == "zeta" ? "printed: below 60 %" : ""});
    }
}

/// Figures 5 and 6 drawn: strain and torque over the twist.
void add_figures(Study& study, const std::vector<Twisted>& all,
                 const std::vector<design::CouplingTwist>& curves, double modulus_MPa) {
  XyFigure strains{.title = "Figure 5", .x = {"twist [deg]"}, .y = {"strain [%]"}, .series = {}};
  XyFigure torques{.title = "Figure 6", .x = {"twist [deg]"}, .y = {"torque [Nm]"}, .series = {}};
  for (std::size_t i = 0; i < curves.size(); ++i) {
    XySeries strain{.label = all[i].geometry, .x = {}, .y = {}};
    for (const auto& [lobe, sign] :
         {std::pair{&curves[i].stretched, -1.0}, std::pair{&curves[i].compressed, 1.0}}) {
      std::vector<std::pair<double, double>> points;
      for (const design::TwistStep& step : lobe->curve.steps)
        points.emplace_back(sign * std::abs(step.twist_deg),
                            100.0 * strain_of(step, StrainMetric::outside_300um));
      std::ranges::sort(points);
      for (const auto& [x, y] : points) {
        strain.x.push_back(x);
        strain.y.push_back(y);
      }
    }
    strains.series.push_back(std::move(strain));
    XySeries torque{.label = all[i].geometry, .x = {}, .y = {}};
    const auto curve = torque_curve(curves[i], all[i].demand.length_mm, modulus_MPa);
    for (int n = 1; n <= kTorquePoints; ++n) {
      const double angle_deg = kTorqueStep_deg * n;
      if (const auto torque_Nm = design::torque_at(curve, angle_deg)) {
        torque.x.push_back(angle_deg);
        torque.y.push_back(*torque_Nm);
      }
    }
    torques.series.push_back(std::move(torque));
  }
  study.figures = {std::move(strains), std::move(torques)};
  study.figure_columns = 2;
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
  add_prediction(table, all);
  for (std::size_t i = 0; i < curves.size(); ++i) {
    add_curve(table, all[i].geometry, curves[i], all[i].demand.length_mm, modulus_MPa);
    add_strains(table, all[i].geometry, curves[i]);
  }
  if (!curves.empty()) add_figures(study, all, curves, modulus_MPa);
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

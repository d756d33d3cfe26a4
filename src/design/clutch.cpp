#include "torsio/design/clutch.hpp"

#include <fmt/format.h>

#include <cmath>
#include <numbers>

#include "core/checks.hpp"

namespace torsio {
namespace {

constexpr double kLeastSlip_Nm = 1e-3;
constexpr double kLargestSlip_Nm = 1e5;

void check(const ClutchDemand& d) {
  require<UsageError>(d.slip_Nm >= kLeastSlip_Nm && d.slip_Nm <= kLargestSlip_Nm,
                      {"clutch", "slip torque"},
                      fmt::format("{} to {} Nm", kLeastSlip_Nm, kLargestSlip_Nm), d.slip_Nm);
  require<UsageError>(d.inner_m >= 0.0 && d.outer_m > d.inner_m && std::isfinite(d.outer_m),
                      {"clutch", "outer radius"}, "more than the inner radius, in m", d.outer_m);
  require<UsageError>(d.least_friction > 0.0 && d.least_friction <= d.friction,
                      {"clutch", "least friction"}, "above 0, at most the nominal friction",
                      d.least_friction);
  require<UsageError>(d.largest_friction >= d.friction && d.largest_friction < 2.0,
                      {"clutch", "largest friction"}, "at least the nominal friction, below 2",
                      d.largest_friction);
  require<UsageError>(d.surfaces >= 1 && d.surfaces <= 100, {"clutch", "surfaces"}, "1 to 100",
                      d.surfaces);
  require<UsageError>(d.parallel >= 1 && d.parallel <= 100, {"clutch", "washers in parallel"},
                      "1 to 100", d.parallel);
  require<UsageError>(d.series >= 1 && d.series <= 100, {"clutch", "packs in series"}, "1 to 100",
                      d.series);
  check(d.washer);
}

XyFigure force_figure(const ClutchDemand& d, double travel_m) {
  constexpr int kPoints = 60;
  XySeries stack{.label = "stack of washers", .x = {}, .y = {}};
  for (int i = 0; i <= kPoints; ++i) {
    const double s = d.washer.cone_height_m * i / kPoints;
    stack.x.push_back(s * d.series * 1e3);
    stack.y.push_back(force(d.washer, s) * d.parallel);
  }
  return {.title = "Axial force over the travel of the stack",
          .x = {"travel [mm]"},
          .y = {"force [N]"},
          .series = {stack,
                     {.label = "in use",
                      .style = CurveStyle::points,
                      .role = CurveRole::measured,
                      .x = {travel_m * d.series * 1e3},
                      .y = {force(d.washer, travel_m) * d.parallel}}}};
}

XyFigure friction_figure(const ClutchDemand& d, double axial_N) {
  const auto torque = [&](double friction) { return effective_arm(d, friction) * axial_N; };
  return {.title = "Slip torque over the coefficient of friction",
          .x = {"friction"},
          .y = {"slip torque [Nm]"},
          .series = {{.label = "at this axial force",
                      .x = {d.least_friction, d.largest_friction},
                      .y = {torque(d.least_friction), torque(d.largest_friction)}},
                     {.label = "nominal",
                      .style = CurveStyle::points,
                      .role = CurveRole::measured,
                      .x = {d.friction},
                      .y = {torque(d.friction)}}}};
}

}  // namespace

double effective_arm(const ClutchDemand& d, double friction) {
  const double cubes = std::pow(d.outer_m, 3) - std::pow(d.inner_m, 3);
  const double squares = d.outer_m * d.outer_m - d.inner_m * d.inner_m;
  return 2.0 * friction * d.surfaces * cubes / (3.0 * squares);
}

DesignReport design_clutch(const ClutchDemand& d) {
  check(d);
  DesignReport report{.design = "clutch"};
  const double arm = effective_arm(d, d.friction);
  const double axial_N = d.slip_Nm / arm;
  const double wear_arm = 0.5 * d.friction * d.surfaces * (d.outer_m + d.inner_m);
  const double area = std::numbers::pi * (d.outer_m * d.outer_m - d.inner_m * d.inner_m);
  const double flat_N = force(d.washer, d.washer.cone_height_m) * d.parallel;
  report.sections.push_back(
      {"clutch",
       {{"slip_torque", d.slip_Nm, "Nm"},
        {"effective_arm", arm * 1e3, "mm", "slip torque over axial force, uniform pressure"},
        {"axial_force", axial_N, "N"},
        {"axial_force_uniform_wear", d.slip_Nm / wear_arm, "N"},
        {"mean_pressure", axial_N / area * 1e-6, "MPa"},
        {"torque_at_least_friction", effective_arm(d, d.least_friction) * axial_N, "Nm",
         fmt::format("friction {:g}", d.least_friction)},
        {"torque_at_largest_friction", effective_arm(d, d.largest_friction) * axial_N, "Nm",
         fmt::format("friction {:g}", d.largest_friction)},
        {"torque_at_flat", flat_N * arm, "Nm", "the bolt tightened until the washers are flat"}}});
  if (axial_N > flat_N) {
    report.is_feasible = false;
    report.infeasible = fmt::format(
        "infeasible: {} washer{} {} in parallel are flat at {:.4g} N: the washers in parallel "
        "would "
        "have to move from {} to {}, or the slip torque of {:.4g} Nm to {:.4g} Nm",
        d.parallel, d.parallel == 1 ? "" : "s", d.washer.name, flat_N, d.parallel,
        static_cast<int>(std::ceil(axial_N / flat_N * d.parallel)), d.slip_Nm, flat_N * arm);
    return report;
  }
  const double s = travel(d.washer, axial_N / d.parallel);
  const double stack_rate = rate(d.washer, s) * d.parallel / d.series;
  report.sections.push_back(
      {"washers",
       {{"washer", kNotMeasured, "", d.washer.source, d.washer.name},
        {"parallel", static_cast<double>(d.parallel)},
        {"series", static_cast<double>(d.series)},
        {"travel", s * 1e3, "mm", "of one washer"},
        {"travel_of_height", s / d.washer.cone_height_m, "", "share of the travel to flat"},
        {"stack_travel", s * d.series * 1e3, "mm"},
        {"rate", stack_rate * 1e-3, "N/mm", "of the stack"},
        {"torque_per_10_um", stack_rate * 10e-6 * arm, "Nm", "of travel of the bolt"},
        {"force_at_flat", flat_N, "N"},
        {"stress", stress(d.washer, s) * 1e-6, "MPa", "sigma_OM"}}});
  report.pictures = {force_figure(d, s), friction_figure(d, axial_N)};
  if (s > 0.75 * d.washer.cone_height_m)
    report.notes.emplace_back("The washers are beyond 0.75 of their travel, the usual limit.");
  if (stack_rate * 10e-6 * arm > 0.05 * d.slip_Nm)
    report.notes.push_back(fmt::format(
        "10 um of the bolt change the slip torque by {:.1f} %: more washers in series make it "
        "easier to adjust.",
        100.0 * stack_rate * 10e-6 * arm / d.slip_Nm));
  return report;
}

}  // namespace torsio

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "drive_load.hpp"
#include "torsio/actuator/joint_parameters.hpp"
#include "torsio/control/deflection_controller.hpp"
#include "torsio/control/design/drive.hpp"
#include "torsio/core/units.hpp"
#include "torsio/design/actuator.hpp"

namespace torsio {
namespace {

constexpr double kZero_K = 273.15;  // 0 degC

DesignSection demand_section(const ActuatorDemand& d) {
  return {"demand",
          {{"continuous_torque", d.continuous_Nm, "Nm"},
           {"peak_torque", d.peak_Nm, "Nm"},
           {"speed", deg_from_rad(d.speed_rad_s), "deg/s", "under the continuous torque"},
           {"deflection", deg_from_rad(d.deflection_rad), "deg", "under the peak torque"},
           {"bandwidth", d.bandwidth_rad_s / (2.0 * std::numbers::pi), "Hz",
            "-3 dB of the torque loop, output locked"},
           {"stiffest_impedance", d.impedance_Nm_rad, "Nm/rad", "passive up to 1 Hz"},
           {"softest_impedance", d.softest_Nm_rad, "Nm/rad", "at 1 Hz"},
           {"collision_force", d.collision_N, "N"},
           {"reach", d.reach_m, "m"},
           {"link_inertia", d.link_inertia_kg_m2, "kg m^2"}}};
}

DesignSection limits_section(const DriveCandidate& c) {
  DesignSection section{"limits"};
  for (const DriveLimit& limit : c.limits)
    section.figures.push_back({limit.name, limit.reached, limit.unit,
                               fmt::format("{} {:.4g}{}", limit.is_upper ? "at most" : "at least",
                                           limit.wanted, limit.is_met() ? "" : ": not met")});
  return section;
}

double reached_speed_deg_s(const DriveCandidate& c, double torque_Nm) {
  return deg_from_rad(std::max(0.0, supply_speed(c.sheet, torque_Nm)));
}

/// Speed under shares of the peak torque at the peak current, and where the supply ends it.
DesignSection map_section(const ActuatorDemand& d, const DriveCandidate& c) {
  DesignSection section{"torque_speed"};
  for (const double share : {0.0, 0.25, 0.5, 0.75, 1.0}) {
    const double torque = share * d.peak_Nm;
    const double current = current_under(c.sheet, torque);
    section.figures.push_back(
        {fmt::format("speed_at_{:.4g}_Nm", torque), reached_speed_deg_s(c, torque), "deg/s",
         fmt::format("{:.3g} A at rest{}", current,
                     current > c.motor.continuous_A ? ", for a time" : ", continuous")});
  }
  return section;
}

/// Mass against bandwidth: the drives that meet the demand, the Pareto front, the choice.
XyFigure pareto_figure(const ActuatorDesign& design) {
  XySeries all{
      .label = "drives that meet the demand", .style = CurveStyle::points, .x = {}, .y = {}};
  XySeries front{.label = "Pareto front", .role = CurveRole::limit, .x = {}, .y = {}};
  XySeries choice{.label = "choice",
                  .style = CurveStyle::points,
                  .role = CurveRole::measured,
                  .x = {},
                  .y = {}};
  for (const DriveCandidate& c : design.candidates) {  // by mass
    if (!c.is_feasible()) continue;
    all.x.push_back(c.mass_kg);
    all.y.push_back(c.loop_Hz);
    all.names.push_back(c.gear.name + " with " + c.motor.name);
    if (!front.y.empty() && c.loop_Hz <= front.y.back()) continue;
    front.x.push_back(c.mass_kg);
    front.y.push_back(c.loop_Hz);
  }
  if (design.is_feasible) {
    const DriveCandidate& c = design.candidates[design.chosen];
    choice.x = {c.mass_kg};
    choice.y = {c.loop_Hz};
    choice.names = {c.gear.name + " with " + c.motor.name};
  }
  return {.title = "Drives for the demand",
          .x = {"mass [kg]"},
          .y = {"largest -3 dB frequency of the torque loop [Hz]"},
          .series = {all, front, choice}};
}

/// Speed over torque that the supply permits, the torque that the motor holds for any time, and the demand.
XyFigure map_figure(const ActuatorDemand& d, const DriveCandidate& c) {
  constexpr int kPoints = 50;
  const double peak_Nm = c.limits[1].reached;
  XySeries most{.label = "at the peak current", .role = CurveRole::limit, .x = {}, .y = {}};
  for (int i = 0; i <= kPoints; ++i) {
    most.x.push_back(peak_Nm * i / kPoints);
    most.y.push_back(reached_speed_deg_s(c, most.x.back()));
  }
  most.x.push_back(peak_Nm);
  most.y.push_back(0.0);
  const double continuous_Nm = c.limits[0].reached;
  const XySeries thermal{.label = "for any time",
                         .x = {continuous_Nm, continuous_Nm},
                         .y = {0.0, reached_speed_deg_s(c, continuous_Nm)}};
  const XySeries demand{.label = "demand",
                        .style = CurveStyle::points,
                        .role = CurveRole::measured,
                        .x = {d.continuous_Nm, d.peak_Nm},
                        .y = {deg_from_rad(d.speed_rad_s), 0.0},
                        .names = {"continuous", "peak"}};
  return {.title = "Torque and speed at the joint",
          .x = {"torque [Nm]"},
          .y = {"speed [deg/s]"},
          .series = {most, thermal, demand}};
}

/// Amplitude of the deflection over that of the wanted one, with the tuning of the demand.
XyFigure loop_figure(const ActuatorDemand& d, const DriveCandidate& c) {
  constexpr int kPoints = 120;
  const double turn = 2.0 * std::numbers::pi;
  const DeflectionController loop(
      {.joint = series_elastic_joint(c.sheet), .bandwidth_rad_s = c.tune_Hz * turn}, 1000.0);
  XySeries gain{.label = "torque loop, output locked", .x = {}, .y = {}};
  for (int i = 0; i <= kPoints; ++i) {
    gain.x.push_back(0.1 * std::pow(1000.0, static_cast<double>(i) / kPoints));
    gain.y.push_back(20.0 * std::log10(std::abs(loop.tracking(gain.x.back() * turn))));
  }
  const XySeries demand{.label = "demand",
                        .style = CurveStyle::points,
                        .role = CurveRole::measured,
                        .x = {d.bandwidth_rad_s / turn},
                        .y = {-3.01}};
  return {.title = "Torque over wanted torque",
          .x = {"frequency [Hz]", true},
          .y = {"amplitude [dB]"},
          .series = {gain, demand}};
}

}  // namespace

DesignReport actuator_report(const ActuatorDemand& d, const ActuatorDesign& design) {
  DesignReport report{
      .design = "actuator", .is_feasible = design.is_feasible, .infeasible = design.infeasible};
  report.sections.push_back(demand_section(d));
  if (!design.spring.is_feasible) return report;
  const DriveCandidate& c = design.candidates[design.chosen];
  report.sections.push_back(
      {"choice",
       {{"gear", kNotMeasured, "", c.gear.source, c.gear.name},
        {"motor", kNotMeasured, "", c.motor.source, c.motor.name},
        {"spring", kNotMeasured, "", c.sheet.title, std::string(name_of(design.spring.kind))},
        {"stiffness", design.spring.stiffness_Nm_rad, "Nm/rad"},
        {"mass", c.mass_kg, "kg", "gear, motor, spring"},
        {"reflected_inertia", drive_of(c.sheet).inertia(), "kg m^2"},
        {"peak_time", c.peak_s, "s", "of the peak torque from cold; none: no limit"},
        {"collision_force", c.collision_N, "N", "upper estimate at the full speed"},
        {"torque_resolution",
         design.spring.stiffness_Nm_rad * 2.0 * std::numbers::pi /
             std::exp2(d.envelope.encoder_bits),
         "Nm", "one step of the encoder"},
        {"tune_loop", c.tune_Hz, "Hz", "--bandwidth of tune-loop and track for the demand"},
        {"slowest_loop", c.lowest_loop_Hz, "Hz", "bandwidths below: the spring alone is faster"}}});
  report.sections.push_back(limits_section(c));
  if (c.loop_Hz > 0.0)
    report.sections.push_back(
        {"impedance",
         {{"softest", c.softest_Nm_rad, "Nm/rad",
           "|torque / angle| at 1 Hz with the wanted torque 0, without dry friction"},
          {"stiffest", c.stiffest_Nm_rad, "Nm/rad", "passive up to 1 Hz"}}});
  report.sections.push_back(map_section(d, c));
  DesignSection spring = design.spring.dimensions;
  spring.name = "spring";
  report.sections.push_back(std::move(spring));
  note_fatigue(report, spring_demand(d), design.spring, false);
  report.pictures = {pareto_figure(design), map_figure(d, c)};
  if (design.is_feasible) {
    report.pictures.push_back(loop_figure(d, c));
    const DriveTrial trial = try_drive(c.sheet, d.continuous_Nm);
    report.sections.push_back(
        {"simulated",
         {{"speed", deg_from_rad(trial.speed_rad_s), "deg/s",
           "rated current against the continuous torque"},
          {"peak_torque", trial.peak_Nm, "Nm", "peak current, output locked"},
          {"copper", trial.copper_K - kZero_K, "degC",
           "with --electrical, under the continuous torque for any time"},
          {"stator", trial.stator_K - kZero_K, "degC",
           fmt::format("the current is reduced from {:g} degC on", trial.derating_K - kZero_K)}}});
    if (trial.speed_rad_s < d.speed_rad_s)
      report.notes.emplace_back("The simulated drive does not reach the speed of the demand.");
    if (trial.stator_K > trial.derating_K)
      report.notes.emplace_back(
          "Under the continuous torque the simulated motor becomes too hot: its current is "
          "reduced.");
    if (trial.peak_Nm < d.peak_Nm)
      report.notes.emplace_back("The simulated drive does not reach the peak torque.");
  }
  const auto feasible = std::ranges::count_if(design.candidates, &DriveCandidate::is_feasible);
  report.notes.push_back(
      fmt::format("{} of {} drives of the table meet the demand; the lightest is "
                  "chosen.",
                  feasible, design.candidates.size()));
  return report;
}

}  // namespace torsio

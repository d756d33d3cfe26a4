#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "torsio/control/drive.hpp"
#include "torsio/core/units.hpp"
#include "torsio/design/actuator.hpp"
#include "torsio/report/plots.hpp"

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

/// Speed under shares of the peak torque at the peak current, and where the supply ends it.
DesignSection map_section(const ActuatorDemand& d, const DriveCandidate& c) {
  DesignSection section{"torque_speed"};
  const Drive drive = drive_of(c.sheet);
  for (const double share : {0.0, 0.25, 0.5, 0.75, 1.0}) {
    const FrictionSheet& f = c.sheet.friction;
    const double torque = share * d.peak_Nm;
    const double load = torque * (1.0 + f.static_ratio.value * f.load_factor.value) +
                        f.static_ratio.value * f.coulomb_Nm.value;
    const double current = load / drive.torque_per_current();
    const double speed = std::max(
        0.0, (drive.supply_V - drive.resistance_Ohm * current) /
                 (drive.torque_per_current() +
                  drive.resistance_Ohm * f.viscous_Nms_rad.value / drive.torque_per_current()));
    section.figures.push_back(
        {fmt::format("speed_at_{:.4g}_Nm", torque), deg_from_rad(speed), "deg/s",
         fmt::format("{:.3g} A at rest{}", current,
                     current > c.motor.continuous_A ? ", for a time" : ", continuous")});
  }
  return section;
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
  if (design.is_feasible) {
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

std::string pareto_svg(const ActuatorDesign& design) {
  std::vector<double> mass;
  std::vector<double> loop;
  std::vector<double> front_mass;
  std::vector<double> front_loop;
  for (const DriveCandidate& c : design.candidates) {  // by mass
    if (!c.is_feasible()) continue;
    mass.push_back(c.mass_kg);
    loop.push_back(c.loop_Hz);
    if (!front_loop.empty() && c.loop_Hz <= front_loop.back()) continue;
    front_mass.push_back(c.mass_kg);
    front_loop.push_back(c.loop_Hz);
  }
  std::vector<double> mark_mass;
  std::vector<double> mark_loop;
  if (design.is_feasible) {
    const DriveCandidate& c = design.candidates[design.chosen];
    for (const auto& [x, y] :
         {std::pair{-1.0, 0.0}, {0.0, 1.0}, {1.0, 0.0}, {0.0, -1.0}, {-1.0, 0.0}}) {
      mark_mass.push_back(c.mass_kg * (1.0 + 0.01 * x));
      mark_loop.push_back(c.loop_Hz * (1.0 + 0.01 * y));
    }
  }
  return svg_plot({{"drives that meet the demand", mass, loop},
                   {"Pareto front", front_mass, front_loop},
                   {"choice", mark_mass, mark_loop}},
                  {"mass [kg]", "largest -3 dB frequency of the torque loop [Hz]"},
                  "Drives for the demand");
}

}  // namespace torsio

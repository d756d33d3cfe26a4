#include "torsio/design/actuator.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "sim/plant/plant.hpp"
#include "torsio/control/joint_impedance.hpp"
#include "torsio/control/torque_controller.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/units.hpp"

namespace torsio {
namespace {

constexpr double kRate_Hz = 1000.0;
constexpr double kTurn = 2.0 * std::numbers::pi;
constexpr double kSpeedCutoff_Hz = 40.0;
constexpr double kFastestLoop_Hz = 40.0;
// Copper above its stator and the stator above its surroundings, as `ElectricalSheet`.
constexpr double kCopperShare = 0.3;
constexpr double kCopper_s = 10.0;
constexpr double kStator_s = 600.0;

DataSheet sheet_of(const ActuatorDemand& d, const SpringDesign& spring, const GearChoice& gear,
                   const MotorChoice& motor, const std::string& name) {
  SpringDemand load = d.envelope;
  load.torque_Nm = d.peak_Nm;
  DataSheet sheet = spring_sheet(load, spring, name);
  sheet.title = fmt::format("{} with {} and a spring of {:.4g} Nm/rad", gear.name, motor.name,
                            spring.stiffness_Nm_rad);
  sheet.rating = {assumed(d.continuous_Nm), assumed(motor.continuous_A), assumed(d.speed_rad_s)};
  sheet.motor.torque_constant_Nm_A = assumed(motor.torque_constant_Nm_A);
  sheet.motor.rotor_inertia_kg_m2 = assumed(motor.rotor_inertia_kg_m2);
  sheet.motor.winding_resistance_Ohm = assumed(motor.resistance_Ohm);
  sheet.motor.supply_V = assumed(motor.supply_V);
  sheet.motor.peak_current_ratio = assumed(motor.peak_A / motor.continuous_A);
  auto& first = std::get<GearSheet>(sheet.first);
  first.ratio = assumed(gear.ratio);
  first.stiffness_Nm_rad = assumed(gear.stiffness_Nm_rad);
  sheet.friction.coulomb_Nm = assumed(gear.friction_Nm);
  sheet.friction.viscous_Nms_rad = assumed(gear.viscous_Nms_rad);
  sheet.joint.inertia_kg_m2 = assumed(d.link_inertia_kg_m2);
  sheet.sensors.middle_encoder_bits = assumed(d.envelope.encoder_bits);
  sheet.sensors.joint_encoder_bits = assumed(d.envelope.encoder_bits);
  return sheet;
}

/// What the friction of gear and drive adds to a torque at the joint, starting from rest.
double with_friction(const DataSheet& sheet, double torque_Nm) {
  const FrictionSheet& f = sheet.friction;
  return torque_Nm + f.static_ratio.value * (f.coulomb_Nm.value + f.load_factor.value * torque_Nm);
}

/// Torque at the joint that a current holds against the friction.
double torque_of(const DataSheet& sheet, double current_A) {
  const FrictionSheet& f = sheet.friction;
  const double motor = drive_of(sheet).torque_per_current() * current_A;
  return (motor - f.static_ratio.value * f.coulomb_Nm.value) /
         (1.0 + f.static_ratio.value * f.load_factor.value);
}

/// Speed under a torque that supply and current allow: U = R i + k_t N ω, N k_t i = T + friction.
double speed_of(const DataSheet& sheet, double torque_Nm, double largest_A) {
  const Drive drive = drive_of(sheet);
  const double per_A = drive.torque_per_current();
  const double load = with_friction(sheet, torque_Nm);
  const double viscous = sheet.friction.viscous_Nms_rad.value;
  const double by_voltage = (drive.supply_V - drive.resistance_Ohm * load / per_A) /
                            (per_A + drive.resistance_Ohm * viscous / per_A);
  const double by_current = (per_A * largest_A - load) / viscous;
  return std::max(0.0, std::min(by_voltage, by_current));
}

/// How long a current may flow from cold until the copper has the temperature that the continuous
/// current gives it; infinite for the continuous one.
double time_at(double ratio) {
  const auto heat = [&](double time_s) {
    return ratio * ratio *
           (kCopperShare * (1.0 - std::exp(-time_s / kCopper_s)) +
            (1.0 - kCopperShare) * (1.0 - std::exp(-time_s / kStator_s)));
  };
  if (ratio <= 1.0) return std::numeric_limits<double>::infinity();
  double low = 0.0;
  double high = 10.0 * kStator_s;
  for (int i = 0; i < 60; ++i) {
    const double middle = 0.5 * (low + high);
    (heat(middle) < 1.0 ? low : high) = middle;
  }
  return low;
}

DeflectionController::Settings loop_settings(const DataSheet& sheet, double bandwidth_Hz) {
  return {.joint = series_elastic_joint(sheet), .bandwidth_rad_s = bandwidth_Hz * kTurn};
}

bool is_stable(const DataSheet& sheet, double bandwidth_Hz) {
  try {
    const TorqueLoopCore core({.deflection = loop_settings(sheet, bandwidth_Hz)}, kRate_Hz);
    return true;
  } catch (const Error&) {
    return false;
  }
}

/// The largest bandwidth of stable margins, by `tune-loop`'s own check; 0 if there is none.
double largest_loop_Hz(const DataSheet& sheet, double lowest_Hz) {
  double low = 1.02 * lowest_Hz;
  if (!is_stable(sheet, low)) return 0.0;
  double high = std::max(kFastestLoop_Hz, 2.0 * low);
  if (is_stable(sheet, high)) return high;
  for (int i = 0; i < 12; ++i) {
    const double middle = 0.5 * (low + high);
    (is_stable(sheet, middle) ? low : high) = middle;
  }
  return low;
}

/// Upper estimate of the force of a collision without control: link and rotor each give their
/// momentum to a spring, v √(k m), at the same time (docs/design/actuator.md).
double collision_force(const ActuatorDemand& d, const DataSheet& sheet) {
  const SeriesElasticJoint joint = series_elastic_joint(sheet);
  const double squared = d.reach_m * d.reach_m;
  const double speed = d.speed_rad_s * d.reach_m;
  const double spring = joint.stiffness_Nm_rad / squared;
  const double soft = spring * d.contact_stiffness_N_m / (spring + d.contact_stiffness_N_m);
  return speed * (std::sqrt(d.contact_stiffness_N_m * d.link_inertia_kg_m2 / squared) +
                  std::sqrt(soft * joint.drive.inertia() / squared));
}

DriveCandidate candidate_of(const ActuatorDemand& d, const SpringDesign& spring,
                            const GearChoice& gear, const MotorChoice& motor,
                            const std::string& name) {
  DriveCandidate c{.gear = gear, .motor = motor, .sheet = sheet_of(d, spring, gear, motor, name)};
  const DataSheet& sheet = c.sheet;
  c.mass_kg = gear.mass_kg + motor.mass_kg + spring.mass_kg;
  const double stiffness = spring.stiffness_Nm_rad;
  const Drive drive = drive_of(sheet);
  c.lowest_loop_Hz = std::sqrt(stiffness / drive.inertia()) / kTurn;
  c.peak_s =
      time_at(with_friction(sheet, d.peak_Nm) / drive.torque_per_current() / motor.continuous_A);
  c.collision_N = collision_force(d, sheet);
  const auto add = [&](const char* of, double wanted, double reached, const char* unit,
                       bool is_upper = false) {
    c.limits.push_back({of, wanted, reached, unit, is_upper});
  };
  add("continuous torque (thermal limit)", d.continuous_Nm,
      std::min(gear.continuous_Nm, torque_of(sheet, motor.continuous_A)), "Nm");
  add("peak torque", d.peak_Nm, std::min(gear.peak_Nm, torque_of(sheet, motor.peak_A)), "Nm");
  add("speed at the continuous torque", deg_from_rad(d.speed_rad_s),
      deg_from_rad(speed_of(sheet, d.continuous_Nm, motor.continuous_A)), "deg/s");
  if (std::isfinite(d.collision_N)) add("collision force", d.collision_N, c.collision_N, "N", true);
  if (std::isfinite(d.torque_resolution_Nm))
    add("torque resolution", d.torque_resolution_Nm,
        stiffness * kTurn / std::exp2(d.envelope.encoder_bits), "Nm", true);
  // The loop is analysed only for a drive that is strong enough.
  if (!c.is_feasible()) return c;
  c.is_loop_analysed = true;
  c.loop_Hz = largest_loop_Hz(sheet, c.lowest_loop_Hz);
  add("bandwidth of the torque loop", d.bandwidth_rad_s / kTurn, c.loop_Hz, "Hz");
  if (d.impedance_Nm_rad > 0.0 && c.loop_Hz > 0.0) {
    const double loop_Hz = std::max(d.bandwidth_rad_s / kTurn, 1.05 * c.lowest_loop_Hz);
    const double reached =
        loop_Hz > c.loop_Hz
            ? 0.0
            : passive_stiffness(DeflectionController(loop_settings(sheet, loop_Hz), kRate_Hz), 0.0,
                                kTurn, kSpeedCutoff_Hz);
    add("passive stiffness up to 1 Hz", d.impedance_Nm_rad, reached, "Nm/rad");
  }
  return c;
}

void check(const ActuatorDemand& d) {
  const auto positive = [](const char* name, double value) {
    if (!(value > 0.0) || !std::isfinite(value))
      throw UsageError({.place = fmt::format("actuator: {}", name),
                        .expected = "a finite number above 0",
                        .found = fmt::format("{}", value)});
  };
  positive("continuous torque", d.continuous_Nm);
  positive("peak torque", d.peak_Nm);
  positive("speed", d.speed_rad_s);
  positive("deflection", d.deflection_rad);
  positive("bandwidth", d.bandwidth_rad_s);
  positive("reach", d.reach_m);
  positive("link inertia", d.link_inertia_kg_m2);
  positive("contact stiffness", d.contact_stiffness_N_m);
  if (d.continuous_Nm > d.peak_Nm)
    throw UsageError(
        {.place = "actuator: peak torque",
         .expected = fmt::format("at least the continuous torque of {:g} Nm", d.continuous_Nm),
         .found = fmt::format("{:g} Nm", d.peak_Nm),
         .advice = "The demands contradict each other."});
  if (!(d.collision_N > 0.0 && d.torque_resolution_Nm > 0.0 && d.impedance_Nm_rad >= 0.0))
    throw UsageError({.place = "actuator: collision force, resolution, impedance",
                      .expected = "numbers that are not negative",
                      .found = fmt::format("{:g} N, {:g} Nm, {:g} Nm/rad", d.collision_N,
                                           d.torque_resolution_Nm, d.impedance_Nm_rad)});
}

}  // namespace

bool DriveCandidate::is_feasible() const noexcept {
  return std::ranges::all_of(limits, [](const DriveLimit& limit) { return limit.is_met(); });
}

const DriveLimit& DriveCandidate::binding() const {
  return *std::ranges::min_element(limits, {}, [](const DriveLimit& of) { return of.share(); });
}

ActuatorDesign design_actuator(const ActuatorDemand& demand, const DriveTable& drives,
                               const std::string& name) {
  check(demand);
  SpringDemand of_spring = demand.envelope;
  of_spring.torque_Nm = demand.peak_Nm;
  of_spring.angle_rad = demand.deflection_rad;
  of_spring.load_inertia_kg_m2 = demand.link_inertia_kg_m2;
  ActuatorDesign design{.spring = design_lightest_spring(of_spring), .candidates = {}};
  if (!design.spring.is_feasible) {
    design.infeasible = design.spring.infeasible;
    return design;
  }
  for (const GearChoice& gear : drives.gears)
    for (const MotorChoice& motor : drives.motors)
      design.candidates.push_back(candidate_of(demand, design.spring, gear, motor, name));
  std::ranges::stable_sort(design.candidates, {}, &DriveCandidate::mass_kg);
  const auto found = std::ranges::find_if(design.candidates, &DriveCandidate::is_feasible);
  design.is_feasible = found != design.candidates.end();
  // A drive whose loop was analysed meets all other limits, and is nearer than one that does not.
  const auto nearest = std::ranges::max_element(design.candidates, {}, [](const DriveCandidate& c) {
    return std::pair(c.is_loop_analysed, c.binding().share());
  });
  const auto chosen = design.is_feasible ? found : nearest;
  design.chosen = static_cast<std::size_t>(chosen - design.candidates.begin());
  if (!design.is_feasible) {
    const DriveLimit& limit = chosen->binding();
    design.infeasible = fmt::format(
        "infeasible: no drive of the table meets the demand; {} with {} is nearest, and its {} "
        "binds: the {:.4g} {} would have to move to {:.4g} {}",
        chosen->gear.name, chosen->motor.name, limit.name, limit.wanted, limit.unit, limit.reached,
        limit.unit);
  }
  return design;
}

DriveTrial try_drive(const DataSheet& sheet, double continuous_Nm) {
  constexpr double kStep_s = 1e-3;
  DriveTrial trial;
  const double rated_A = sheet.rating.current_A.value;
  Plant plant(plant_parameters(sheet));
  const Load pull{.external_torque_Nm = -continuous_Nm};
  const Load locked{.is_locked = true};
  plant.reset(0.0, pull);
  constexpr int kSteps = 6000;
  constexpr int kLast = 200;  // the mean over the last steps is the speed
  double first_rad = 0.0;
  for (int i = 0; i < kSteps; ++i) {
    if (i == kSteps - kLast) first_rad = plant.state().joint_angle_rad;
    if (plant.step({.current_A = rated_A}, pull, kStep_s) != Fault::none) return trial;
  }
  trial.speed_rad_s = (plant.state().joint_angle_rad - first_rad) / (kLast * kStep_s);
  plant.reset(0.0, locked);
  const double peak_A = rated_A * sheet.motor.peak_current_ratio.value;
  constexpr int kRamp = 2000;
  for (int i = 0; i < 2 * kRamp; ++i) {
    const double share = std::min(1.0, static_cast<double>(i) / kRamp);
    if (plant.step({.current_A = share * peak_A}, locked, kStep_s) != Fault::none) return trial;
  }
  trial.peak_Nm = plant.torques().second_Nm;
  return trial;
}

}  // namespace torsio

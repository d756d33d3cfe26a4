#include "torsio/design/actuator.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>
#include <utility>

#include "core/checks.hpp"
#include "drive_load.hpp"
#include "sim/plant/plant.hpp"
#include "torsio/actuator/electrical_sheet.hpp"
#include "torsio/actuator/joint_parameters.hpp"
#include "torsio/control/design/series_elastic_joint.hpp"
#include "torsio/control/joint_impedance.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/units.hpp"

namespace torsio {
namespace {

constexpr double kRate_Hz = 1000.0;
constexpr double kTurn = 2.0 * std::numbers::pi;
constexpr double kContact_rad_s = kTurn;  // up to 1 Hz
constexpr double kSpeedCutoff_Hz = 40.0;
constexpr double kLeastPhase_rad = rad_from_deg(30.0);  // margins of a loop
constexpr double kLeastGain = 2.0;
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

/// Torque at the joint that a current holds against the friction.
double torque_of(const DataSheet& sheet, double current_A) {
  const FrictionSheet& f = sheet.friction;
  const double motor = drive_of(sheet).torque_per_current() * current_A;
  return (motor - f.static_ratio.value * f.coulomb_Nm.value) /
         (1.0 + f.static_ratio.value * f.load_factor.value);
}

/// Speed under a torque that supply and current allow.
double speed_of(const DataSheet& sheet, double torque_Nm, double largest_A) {
  const double by_current =
      (drive_of(sheet).torque_per_current() * largest_A - with_friction(sheet, torque_Nm)) /
      sheet.friction.viscous_Nms_rad.value;
  return std::max(0.0, std::min(supply_speed(sheet, torque_Nm), by_current));
}

/// The current that may flow for any time: at most the motor's continuous one, and the stator stays below
/// the temperature from which on the current is reduced (`ElectricalSheet`, 20 degC around it).
double thermal_current_A(const DataSheet& sheet) {
  const ElectricalDrive::Parameters of = electrical_parameters(sheet, 1);
  const double loss_W = (of.derating_begins_K - of.ambient_K) / of.thermal.stator_ambient_K_W;
  const double copper_rise_K =
      loss_W * (of.thermal.copper_stator_K_W + of.thermal.stator_ambient_K_W);
  const double resistance_Ohm =
      sheet.motor.winding_resistance_Ohm.value * (1.0 + kCopperResistanceRise_1_K * copper_rise_K);
  return std::min(sheet.rating.current_A.value, std::sqrt(loss_W / resistance_Ohm));
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

/// The loop that `tune-loop` proposes for a bandwidth, if it has margins with its output locked and free.
std::optional<DeflectionController> sound_loop(const DataSheet& sheet, double bandwidth_Hz) {
  try {
    DeflectionController loop(loop_settings(sheet, bandwidth_Hz), kRate_Hz);
    for (const JointOutput output : {JointOutput::locked, JointOutput::free}) {
      const Margins found = loop.margins_of(loop.gains(), output);
      if (found.phase_rad < kLeastPhase_rad || found.gain < kLeastGain) return std::nullopt;
    }
    return loop;
  } catch (const Error&) {
    return std::nullopt;
  }
}

/// Largest number between two where a property holds that holds at `low`, and not beyond some number.
template <class Holds>
double largest_with(double low, double high, const Holds& holds) {
  constexpr int kHalvings = 9;
  if (holds(high)) return high;
  for (int i = 0; i < kHalvings; ++i) {
    const double middle = 0.5 * (low + high);
    (holds(middle) ? low : high) = middle;
  }
  return low;
}

double cutoff_Hz(const DataSheet& sheet, double bandwidth_Hz) {
  const auto loop = sound_loop(sheet, bandwidth_Hz);
  return loop ? loop->cutoff_rad_s() / kTurn : 0.0;
}

/// Least and largest bandwidth for `tune-loop` at which the loop has margins, if there are any.
struct LoopRange {
  double least_Hz = 0.0;
  double largest_Hz = 0.0;
};
std::optional<LoopRange> loop_range(const DriveCandidate& c) {
  const double least_Hz = 1.02 * c.lowest_loop_Hz;
  if (!sound_loop(c.sheet, least_Hz)) return std::nullopt;
  return LoopRange{least_Hz,
                   largest_with(least_Hz, std::max(kFastestLoop_Hz, 2.0 * least_Hz),
                                [&](double Hz) { return sound_loop(c.sheet, Hz).has_value(); })};
}

/// The least bandwidth for `tune-loop` that reaches the demand, and the impedances of that loop.
void tune(DriveCandidate& c, const LoopRange& range, double wanted_Hz) {
  const auto is_slow = [&](double Hz) { return cutoff_Hz(c.sheet, Hz) < wanted_Hz; };
  c.tune_Hz = range.least_Hz;
  // `largest_with` ends below the demand: 1 % more reaches it.
  if (is_slow(range.least_Hz))
    c.tune_Hz =
        std::min(1.01 * largest_with(range.least_Hz, range.largest_Hz, is_slow), range.largest_Hz);
  const auto loop = sound_loop(c.sheet, c.tune_Hz);
  if (!loop) return;
  c.softest_Nm_rad = std::abs(impedance(loop->settings().joint, loop->feedback(), kContact_rad_s)) *
                     kContact_rad_s;
  c.stiffest_Nm_rad = passive_stiffness(*loop, 0.0, kContact_rad_s, kSpeedCutoff_Hz);
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
  c.peak_s = time_at(current_under(sheet, d.peak_Nm) / motor.continuous_A);
  c.collision_N = collision_force(d, sheet);
  const auto add = [&](const char* of, double wanted, double reached, const char* unit,
                       bool is_upper = false) {
    c.limits.push_back({of, wanted, reached, unit, is_upper});
  };
  const double thermal_A = thermal_current_A(sheet);
  add("continuous torque (thermal limit)", d.continuous_Nm,
      std::min(gear.continuous_Nm, torque_of(sheet, thermal_A)), "Nm");
  add("peak torque", d.peak_Nm, std::min(gear.peak_Nm, torque_of(sheet, motor.peak_A)), "Nm");
  add("speed at the continuous torque", deg_from_rad(d.speed_rad_s),
      deg_from_rad(speed_of(sheet, d.continuous_Nm, thermal_A)), "deg/s");
  if (std::isfinite(d.collision_N)) add("collision force", d.collision_N, c.collision_N, "N", true);
  if (std::isfinite(d.torque_resolution_Nm))
    add("torque resolution", d.torque_resolution_Nm,
        stiffness * kTurn / std::exp2(d.envelope.encoder_bits), "Nm", true);
  // The loop is analysed only for a drive that is strong enough.
  if (!c.is_feasible()) return c;
  c.is_loop_analysed = true;
  const double wanted_Hz = d.bandwidth_rad_s / kTurn;
  const auto range = loop_range(c);
  if (range) c.loop_Hz = cutoff_Hz(sheet, range->largest_Hz);
  add("-3 dB of the torque loop", wanted_Hz, c.loop_Hz, "Hz");
  if (!c.is_feasible()) return c;
  tune(c, *range, wanted_Hz);
  if (d.impedance_Nm_rad > 0.0)
    add("passive stiffness up to 1 Hz", d.impedance_Nm_rad, c.stiffest_Nm_rad, "Nm/rad");
  if (std::isfinite(d.softest_Nm_rad))
    add("softest impedance at 1 Hz", d.softest_Nm_rad, c.softest_Nm_rad, "Nm/rad", true);
  return c;
}

constexpr double kLeastLink_kg_m2 = 1e-4;
constexpr double kLargestLink_kg_m2 = 1e4;

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
  // A lighter link oscillates faster than a control loop, and a simulation of it takes minutes.
  require<UsageError>(
      d.link_inertia_kg_m2 >= kLeastLink_kg_m2 && d.link_inertia_kg_m2 <= kLargestLink_kg_m2,
      {"actuator", "link inertia"},
      fmt::format("{} to {} kg m2", kLeastLink_kg_m2, kLargestLink_kg_m2), d.link_inertia_kg_m2);
  positive("contact stiffness", d.contact_stiffness_N_m);
  if (d.continuous_Nm > d.peak_Nm)
    throw UsageError(
        {.place = "actuator: peak torque",
         .expected = fmt::format("at least the continuous torque of {:g} Nm", d.continuous_Nm),
         .found = fmt::format("{:g} Nm", d.peak_Nm),
         .advice = "The demands contradict each other."});
  if (!(d.collision_N > 0.0 && d.torque_resolution_Nm > 0.0 && d.impedance_Nm_rad >= 0.0 &&
        d.softest_Nm_rad > 0.0))
    throw UsageError(
        {.place = "actuator: collision force, resolution, impedance",
         .expected = "numbers that are not negative",
         .found = fmt::format("{:g} N, {:g} Nm, {:g} to {:g} Nm/rad", d.collision_N,
                              d.torque_resolution_Nm, d.softest_Nm_rad, d.impedance_Nm_rad)});
  if (d.impedance_Nm_rad > 0.0 && std::isfinite(d.softest_Nm_rad) &&
      d.softest_Nm_rad >= d.impedance_Nm_rad)
    throw UsageError({.place = "actuator: impedance",
                      .expected = fmt::format("a stiffest one above the softest of {:g} Nm/rad",
                                              d.softest_Nm_rad),
                      .found = fmt::format("{:g} Nm/rad", d.impedance_Nm_rad),
                      .advice = "The demands contradict each other."});
}

}  // namespace

bool DriveCandidate::is_feasible() const noexcept {
  return std::ranges::all_of(limits, [](const DriveLimit& limit) { return limit.is_met(); });
}

const DriveLimit& DriveCandidate::binding() const {
  return *std::ranges::min_element(limits, {}, [](const DriveLimit& of) { return of.share(); });
}

SpringDemand spring_demand(const ActuatorDemand& demand) {
  SpringDemand of_spring = demand.envelope;
  of_spring.torque_Nm = demand.peak_Nm;
  of_spring.angle_rad = demand.deflection_rad;
  of_spring.load_inertia_kg_m2 = demand.link_inertia_kg_m2;
  return of_spring;
}

ActuatorDesign design_actuator(const ActuatorDemand& demand, const DriveTable& drives,
                               const std::string& name) {
  check(demand);
  ActuatorDesign design{.spring = design_lightest_spring(spring_demand(demand)), .candidates = {}};
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

namespace {

/// Temperatures after any length of time under a current, from the copper loss of a second with the
/// output locked; the resistance rises with the temperature.
void find_temperatures(const DataSheet& sheet, double current_A, DriveTrial& trial) {
  constexpr double kStep_s = 1e-3;
  constexpr int kSettle = 1000;
  constexpr int kSteps = 2000;
  constexpr int kIterations = 100;
  const ElectricalDrive::Parameters parameters = electrical_parameters(sheet, 1);
  Plant plant(plant_parameters(sheet));
  plant.use(parameters);
  const Load locked{.is_locked = true};
  plant.reset(0.0, locked);
  double first_J = 0.0;
  for (int i = 0; i < kSteps; ++i) {
    if (i == kSettle) first_J = plant.electrical()->energy().copper_J;
    if (plant.step({.current_A = current_A}, locked, kStep_s) != Fault::none) return;
  }
  const double cold_W =
      (plant.electrical()->energy().copper_J - first_J) / ((kSteps - kSettle) * kStep_s);
  const MotorThermal& thermal = parameters.thermal;
  double copper_K = parameters.ambient_K;
  for (int i = 0; i < kIterations; ++i) {
    const double loss_W =
        cold_W * (1.0 + kCopperResistanceRise_1_K * (copper_K - parameters.ambient_K));
    trial.stator_K = parameters.ambient_K + loss_W * thermal.stator_ambient_K_W;
    copper_K = trial.stator_K + loss_W * thermal.copper_stator_K_W;
  }
  trial.copper_K = copper_K;
  trial.derating_K = parameters.derating_begins_K;
}

}  // namespace

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
  find_temperatures(
      sheet, with_friction(sheet, continuous_Nm) / drive_of(sheet).torque_per_current(), trial);
  return trial;
}

}  // namespace torsio

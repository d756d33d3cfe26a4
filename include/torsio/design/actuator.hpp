#pragma once

#include <limits>
#include <string>
#include <vector>

#include "torsio/actuator/data_sheet.hpp"
#include "torsio/design/report.hpp"
#include "torsio/design/spring.hpp"
#include "torsio/design/tables.hpp"

namespace torsio {

/// What a joint has to do, SI.
struct ActuatorDemand {
  double continuous_Nm = 0.0;
  double peak_Nm = 0.0;
  double speed_rad_s = 0.0;       ///< under the continuous torque
  double deflection_rad = 0.0;    ///< spring, under the peak torque
  double bandwidth_rad_s = 0.0;   ///< -3 dB of the torque loop, output locked
  double impedance_Nm_rad = 0.0;  ///< stiffest impedance that must be passive up to 1 Hz
  /// Softest impedance that must be rendered at 1 Hz.
  double softest_Nm_rad = std::numeric_limits<double>::infinity();
  double collision_N = std::numeric_limits<double>::infinity();  ///< at the tip of the link
  double reach_m = 0.5;                                          ///< length of the link
  double link_inertia_kg_m2 = 0.15;
  double contact_stiffness_N_m = 75e3;  ///< obstacle (assumed: a hand)
  double torque_resolution_Nm = std::numeric_limits<double>::infinity();
  SpringDemand envelope = {};  ///< envelope, bore, material, safety, encoder of the spring
};

/// What the spring of such an actuator has to do.
[[nodiscard]] SpringDemand spring_demand(const ActuatorDemand& demand);

/// A requirement of a demand beside what a drive reaches.
struct DriveLimit {
  std::string name;
  double wanted = 0.0;
  double reached = 0.0;
  std::string unit;
  bool is_upper = false;  ///< the reached value may be at most the wanted one
  [[nodiscard]] bool is_met() const noexcept {
    return is_upper ? reached <= wanted : reached >= wanted;
  }
  /// How far it is from the demand: 1 or more where it is met.
  [[nodiscard]] double share() const noexcept {
    return is_upper ? wanted / reached : reached / wanted;
  }
};

/// A gear with a motor and the spring.
struct DriveCandidate {
  GearChoice gear;
  MotorChoice motor;
  DataSheet sheet;
  double mass_kg = 0.0;
  bool is_loop_analysed = false;  ///< only if all other limits are met
  double loop_Hz = 0.0;           ///< largest -3 dB frequency of the torque loop with margins
  double tune_Hz = 0.0;         ///< the bandwidth of tune-loop with which the loop meets the demand
  double lowest_loop_Hz = 0.0;  ///< bandwidth of tune-loop below which the spring alone is faster
  double softest_Nm_rad =
      0.0;  ///< |torque / angle| at 1 Hz with the wanted torque 0, no dry friction
  double stiffest_Nm_rad = 0.0;  ///< impedance that is passive up to 1 Hz
  double collision_N = 0.0;
  double peak_s = 0.0;  ///< how long the peak torque lasts from cold
  std::vector<DriveLimit> limits = {};
  [[nodiscard]] bool is_feasible() const noexcept;
  /// The limit that is furthest from the demand.
  [[nodiscard]] const DriveLimit& binding() const;
};

struct ActuatorDesign {
  SpringDesign spring;
  std::vector<DriveCandidate> candidates;  ///< by mass
  std::size_t chosen = 0;                  ///< the lightest that meets all, else the nearest
  bool is_feasible = false;
  std::string infeasible = {};
};

/// Tries all gears and motors of a table with the spring of the demand. Equations: docs/design.
/// @throws UsageError for a demand that is impossible or contradicts itself.
[[nodiscard]] ActuatorDesign design_actuator(const ActuatorDemand& demand, const DriveTable& drives,
                                             const std::string& name);

/// What the simulated plant of a sheet reaches: the speed under the continuous torque with the rated
/// current, the spring's torque with the peak current, output locked, and, with inverter and current
/// control (`ElectricalDrive`), the final temperatures under the current of the continuous torque.
struct DriveTrial {
  double speed_rad_s = 0.0;
  double peak_Nm = 0.0;
  double copper_K = 0.0;
  double stator_K = 0.0;
  double derating_K = 0.0;  ///< temperature of the stator at which the current is reduced
};
[[nodiscard]] DriveTrial try_drive(const DataSheet& sheet, double continuous_Nm);

[[nodiscard]] DesignReport actuator_report(const ActuatorDemand& demand,
                                           const ActuatorDesign& design);
}  // namespace torsio

#include "arm_collision_run.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>

#include "arm/vector3.hpp"
#include "sim/arm/arm_plant.hpp"
#include "sim/plant/plant_parameters.hpp"
#include "sim/sensors/sensor_set.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/units.hpp"

namespace torsio {
namespace {

constexpr double kSpeed_m_s = 0.5;
constexpr double kSpeedUp_s = 0.3;  // from rest, and back to it
constexpr double kSteady_m = 0.08;  // at full speed before the plate
constexpr double kBeyond_m = 0.1;
constexpr double kPlate_N_m = 75e3;
constexpr double kAfter_s = 1.0;
constexpr double kRest_s = 1.0;
constexpr std::size_t kFirstTicks = 40;
// The loop on the rotors, over the stiffness of the joint's own spring.
constexpr double kProportional = 2.0;
constexpr double kDerivative_s = 0.15;
constexpr std::array kBent_deg{0.0, -70.0, 110.0, 0.0, 50.0, 0.0};
/// Towards the plate: outwards, sideways, down.
constexpr std::array kWays{Vector3{1.0, 0.0, 0.0}, Vector3{0.0, 1.0, 0.0}, Vector3{0.0, 0.0, -1.0}};

/// The way along the line after this time, and whether it has ended: sin² ramps of the speed at both ends.
double speed_at(double time_s, double steady_s) {
  const auto ramp = [](double share) {
    const double sine = std::sin(0.5 * std::numbers::pi * std::clamp(share, 0.0, 1.0));
    return sine * sine;
  };
  return kSpeed_m_s * ramp(time_s / kSpeedUp_s) *
         (1.0 - ramp((time_s - kSpeedUp_s - steady_s) / kSpeedUp_s));
}

/// Angles of a straight motion of the flange that keeps its orientation, tick by tick.
std::vector<std::vector<double>> straight_path(const ArmModel& arm, const Vector3& way,
                                               double steady_s) {
  const ArmDynamics dynamics(arm);
  const std::size_t n = dynamics.size();
  std::vector<double> angle_rad;
  for (const double angle_deg : kBent_deg) angle_rad.push_back(rad_from_deg(angle_deg));
  std::vector<std::vector<double>> path(n);
  const auto ticks =
      static_cast<std::size_t>((2.0 * kSpeedUp_s + steady_s + kAfter_s) * kBenchRate_Hz);
  for (std::size_t tick = 0; tick < ticks; ++tick) {
    for (std::size_t j = 0; j < n; ++j) path[j].push_back(angle_rad[j]);
    ArmDynamics::Jacobian jacobian;
    dynamics.jacobian(angle_rad, jacobian);
    // Jᵀ (J Jᵀ)⁻¹ v, the pose being far from a singular one.
    std::array<double, 36> square = {};
    std::array<double, 6> rate = {};
    const double speed_m_s = speed_at(static_cast<double>(tick) / kBenchRate_Hz, steady_s);
    for (std::size_t i = 0; i < 3; ++i) rate[i] = speed_m_s * way[i];
    for (std::size_t i = 0; i < 6; ++i)
      for (std::size_t k = 0; k < 6; ++k)
        for (std::size_t j = 0; j < n; ++j)
          square[6 * i + k] += jacobian[i * n + j] * jacobian[k * n + j];
    if (!solve_positive(square, rate))
      throw Error({.place = arm.name, .problem = "the line leads to a singular configuration"});
    for (std::size_t j = 0; j < n; ++j)
      for (std::size_t i = 0; i < 6; ++i)
        angle_rad[j] += jacobian[i * n + j] * rate[i] / kBenchRate_Hz;
  }
  return path;
}

}  // namespace

ArmSetup collision_setup(double payload_kg) {
  ArmSetup setup = arm6_setup();
  BodyInertia& payload = setup.arm.payload;
  for (double& moment : payload.inertia_kg_m2) moment *= payload_kg / payload.mass_kg;
  payload.mass_kg = payload_kg;
  return setup;
}

namespace {

struct Line {
  std::vector<std::vector<double>> path_rad;
  ArmPlate plate;  ///< from where the flange is at the beginning
};

Line line_of(const ArmSetup& setup, const ArmCollision& collision) {
  const Vector3 way = kWays.at(collision.axis);
  const double to_plate_m = 0.5 * kSpeed_m_s * kSpeedUp_s + kSteady_m;
  // The ramp down takes half of its way at full speed.
  const double steady_s = (kSteady_m + kBeyond_m) / kSpeed_m_s - 0.5 * kSpeedUp_s;
  return {.path_rad = straight_path(setup.arm, way, steady_s),
          .plate = {.at_m = to_plate_m * way,
                    .normal = -1.0 * way,
                    .stiffness_N_m = kPlate_N_m,
                    .mass_kg = collision.plate_kg}};
}

std::vector<double> start_of(const Line& line) {
  std::vector<double> start_rad;
  for (const std::vector<double>& angle_rad : line.path_rad) start_rad.push_back(angle_rad.front());
  return start_rad;
}

}  // namespace

ArmRun collide(const ArmCollision& collision) {
  const ArmSetup setup = collision_setup(collision.payload_kg);
  const Line line = line_of(setup, collision);
  ArmRunSpec spec{.program = {.start_rad = start_of(line)}};
  spec.contacts = collision.contacts;
  spec.seed = collision.seed;
  spec.has_gear_stage = false;
  spec.program.reaction = collision.reaction;
  ArmStep rest;  // the detector settles
  rest.duration_s = kRest_s;
  spec.program.steps.push_back(rest);
  ArmStep motion;
  motion.task = ArmTask::follow;
  motion.path_rad = line.path_rad;
  motion.plate = line.plate;
  spec.program.steps.push_back(motion);
  ArmRun run = run_arm(setup, spec);
  if (!run.impact)
    throw Error({.place = setup.arm.name,
                 .problem = fmt::format("it does not reach the plate: {} at {:.3f} s",
                                        name(run.cause), run.stopped_s)});
  return run;
}

double first_peak(const ArmCollision& collision, double stiffness_factor) {
  const ArmSetup setup = collision_setup(collision.payload_kg);
  const Line line = line_of(setup, collision);
  const std::vector<double> start_rad = start_of(line);
  std::vector<PlantParameters> drives;
  std::vector<double> stiffness_Nm_rad;
  for (const ArmJointSetup& joint : setup.joints) {
    DataSheet sheet = joint.sheet;
    auto& spring = std::get<SpringSheet>(sheet.second);
    stiffness_Nm_rad.push_back(spring.stiffness_Nm_rad.value);
    spring.stiffness_Nm_rad.value *= stiffness_factor;
    spring.stage_stiffness_Nm_rad.value *= stiffness_factor;
    drives.push_back(plant_parameters(sheet));
  }
  ArmPlant plant(setup.arm, drives, FirstStageForm::rigid);
  if (plant.reset(start_rad) != Fault::none)
    throw Error({.place = setup.arm.name, .problem = "the arm refuses its start"});
  ArmPlate plate = line.plate;
  plate.at_m = plate.at_m + plant.dynamics().flange(start_rad).position_m;
  plant.use(plate);
  const std::size_t n = drives.size();
  std::vector<PlantCommand> commands(n);
  ArmDynamics::PerJoint gravity_Nm = {};
  ArmDynamics::PerJoint reference_rad = {};
  std::vector<double> offset_rad(n);  // the springs under the weight
  for (std::size_t j = 0; j < n; ++j)
    offset_rad[j] =
        plant.state(j).rotor_angle_rad / total_ratio(drives[j]) - plant.state(j).joint_angle_rad;
  std::size_t since_touch = 0;
  for (std::size_t tick = 0; tick + 1 < line.path_rad.front().size(); ++tick) {
    for (std::size_t j = 0; j < n; ++j) reference_rad[j] = line.path_rad[j][tick];
    plant.dynamics().gravity_torque(reference_rad, gravity_Nm);
    for (std::size_t j = 0; j < n; ++j) {
      const double ratio = total_ratio(drives[j]);
      const PlantState& state = plant.state(j);
      const double speed_rad_s =
          (line.path_rad[j][tick + 1] - line.path_rad[j][tick]) * kBenchRate_Hz;
      const double torque_Nm =
          gravity_Nm[j] +
          stiffness_Nm_rad[j] *
              (kProportional * (reference_rad[j] + offset_rad[j] - state.rotor_angle_rad / ratio) +
               kDerivative_s * (speed_rad_s - state.rotor_speed_rad_s / ratio));
      commands[j].current_A = torque_Nm / (ratio * drives[j].motor.torque_constant_Nm_A);
    }
    if (plant.step(commands, {}, 1.0 / kBenchRate_Hz) != Fault::none)
      throw Error({.place = setup.arm.name, .problem = "the arm refuses its commands"});
    if (plant.plate()->force_N() > 0.0 || since_touch > 0) ++since_touch;
    if (since_touch == kFirstTicks) return plant.plate()->take_largest_N();
  }
  throw Error({.place = setup.arm.name, .problem = "it does not reach the plate"});
}

}  // namespace torsio

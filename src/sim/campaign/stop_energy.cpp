#include "stop_energy.hpp"

#include <algorithm>
#include <cmath>

#include "duty_plants.hpp"
#include "sim/experiments/experiment_table.hpp"
#include "torsio/actuator/joint_parameters.hpp"
#include "torsio/control/design/drive.hpp"
#include "torsio/control/joint_stop.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/estimate.hpp"

namespace torsio {
namespace {

constexpr int kStopTicks = 500;

}  // namespace

double stop_energy_gain(const DataSheet& sheet, const PlantState& state, const Load& at_stop) {
  const Brake::Parameters brake = brake_parameters(sheet);
  Load load = at_stop;
  load.external_torque_Nm = 0.0;
  const PlantParameters parameters = plant_parameters(sheet);
  Plant plant(parameters, braked_step_s(parameters));
  plant.use(brake);
  plant.set_brake(false);
  if (plant.reset(state) != Fault::none) return kNotMeasured;
  JointStop stop(joint_stop_settings(sheet), kBenchRate_Hz);
  stop.trigger(StopCategory::power_off);
  const double ratio = total_ratio(plant.parameters());
  const double first_J = plant.stored_energy(load).all_J;
  const double moving_J =
      first_J - load.gravity_Nm * (1.0 - std::cos(plant.state().joint_angle_rad));
  double largest_J = first_J;
  for (int tick = 0; tick < kStopTicks; ++tick) {
    const JointState measured = {.angle_rad = plant.state().rotor_angle_rad / ratio,
                                 .speed_rad_s = plant.state().rotor_speed_rad_s / ratio,
                                 .torque_Nm = plant.torques().second_Nm};
    static_cast<void>(stop.reference({}, measured));
    const JointStop::Output output = stop.step(0.0, measured);
    if (plant.step({.current_A = output.current_A,
                    .is_powered = output.is_powered,
                    .brake_V = output.is_brake_open ? brake.activation_V : 0.0},
                   load, 1.0 / kBenchRate_Hz) != Fault::none)
      return kNotMeasured;
    largest_J = std::max(largest_J, plant.stored_energy(load).all_J);
  }
  return moving_J > 0.0 ? (largest_J - first_J) / moving_J : kNotMeasured;
}

}  // namespace torsio

// Steps per second of MuJoCo, one thread, Euler, 0.1 ms, no contacts, without hysteresis, friction, play,
// ripple, gear error or current loop, which a MuJoCo joint does not have.
//
// simulate_single: a plain motor, spring and link, without the elasticity of the gear. Reads
// commands_A.f64, the motor current at each step.
// arm_simulate, arm_simulate_gears: six joints of a rotor and a plain spring; of a rotor, a gear and a
// plain spring. Reads arm.xml, and arm_commands_A.f64, the currents of all motors at each step.
//
// Usage: peer_mujoco ROW FOLDER; prints steps/s.

#include <mujoco/mujoco.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <cstdio>
#include <fstream>
#include <stdexcept>
#include <string>
#include <vector>

namespace {

// dfki-120: rotor inertia times ratio squared as the armature of the gear's output, whose angle is
// the first joint; the spring is the second joint, which turns the lever of 0.4 m with 9 kg against
// it. The motor's gear is ratio times torque constant.
constexpr auto kModel = R"(<mujoco>
  <compiler angle="radian" inertiafromgeom="false"/>
  <option timestep="1e-4" integrator="Euler" gravity="0 0 -9.81"><flag contact="disable"/></option>
  <worldbody>
    <body>
      <inertial pos="0 0 0" mass="0.1" diaginertia="0.02 0.02 0.02"/>
      <joint name="gear" type="hinge" axis="0 1 0" armature="1.728" damping="15"/>
      <body>
        <inertial pos="0 0 -0.4" mass="9" diaginertia="0.001 0.001 0.001"/>
        <joint name="spring" type="hinge" axis="0 1 0" stiffness="1134.5" damping="0.1"/>
      </body>
    </body>
  </worldbody>
  <actuator><motor joint="gear" gear="21.6"/></actuator>
</mujoco>)";

std::vector<double> read(const std::string& file) {
  std::ifstream in(file, std::ios::binary | std::ios::ate);
  if (!in) throw std::runtime_error(file + ": cannot be read");
  std::vector<double> values(static_cast<std::size_t>(in.tellg()) / sizeof(double));
  in.seekg(0);
  in.read(reinterpret_cast<char*>(values.data()),
          static_cast<std::streamsize>(values.size() * sizeof(double)));
  return values;
}

mjModel* load(const std::string& file) {
  char message[1000] = "";
  mjModel* const model = mj_loadXML(file.c_str(), nullptr, message, sizeof(message));
  if (model == nullptr) throw std::runtime_error(message);
  return model;
}

}  // namespace

int main(int argc, char** argv) try {
  if (argc != 3) throw std::runtime_error("usage: peer_mujoco ROW FOLDER");
  const bool is_arm = std::string(argv[1]) != "simulate_single";
  const std::string folder = std::string(argv[2]) + "/";
  const std::string file = folder + (is_arm ? "arm.xml" : "motor_spring_link.xml");
  if (!is_arm) std::ofstream(file) << kModel;
  const std::vector<double> commands =
      read(folder + (is_arm ? "arm_commands_A.f64" : "commands_A.f64"));
  mjModel* const model = load(file);
  mjData* const data = mj_makeData(model);
  const auto motors = static_cast<std::size_t>(model->nu);
  double best = 1e300;
  for (int run = 0; run < 60; ++run) {
    if (is_arm) mj_resetData(model, data);
    const auto begin = std::chrono::steady_clock::now();
    for (std::size_t at = 0; at < commands.size(); at += motors) {
      std::copy_n(commands.data() + at, motors, data->ctrl);
      mj_step(model, data);
    }
    const std::chrono::duration<double> span = std::chrono::steady_clock::now() - begin;
    best = std::min(best, span.count());
  }
  if (!std::isfinite(data->qpos[1]) || data->qpos[1] == 0.0)
    throw std::runtime_error("MuJoCo's spring does not move");
  std::printf("%.6g\n", static_cast<double>(commands.size() / motors) / best);
  mj_deleteData(data);
  mj_deleteModel(model);
} catch (const std::exception& error) {
  std::fprintf(stderr, "peer_mujoco: %s\n", error.what());
  return 1;
}

// Steps per second of MuJoCo on a plain motor, spring and link, one thread: what simulate_single does
// without hysteresis, friction, play, ripple, gear error, gear elasticity or current loop, which a
// MuJoCo joint does not have. Euler, 0.1 ms, no contacts.
//
// Usage: peer_mujoco FOLDER; prints steps/s. Reads commands_A.f64, the motor current at each step.

#include <mujoco/mujoco.h>

#include <chrono>
#include <cmath>
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
  std::ofstream(file) << kModel;
  char message[1000] = "";
  mjModel* const model = mj_loadXML(file.c_str(), nullptr, message, sizeof(message));
  if (model == nullptr) throw std::runtime_error(message);
  return model;
}

}  // namespace

int main(int argc, char** argv) try {
  if (argc != 2) throw std::runtime_error("usage: peer_mujoco FOLDER");
  const std::string folder = std::string(argv[1]) + "/";
  const std::vector<double> commands = read(folder + "commands_A.f64");
  mjModel* const model = load(folder + "motor_spring_link.xml");
  mjData* const data = mj_makeData(model);
  double best = 1e300;
  for (int run = 0; run < 20; ++run) {
    const auto begin = std::chrono::steady_clock::now();
    for (const double current_A : commands) {
      data->ctrl[0] = current_A;
      mj_step(model, data);
    }
    const std::chrono::duration<double> span = std::chrono::steady_clock::now() - begin;
    best = std::min(best, span.count());
  }
  if (!std::isfinite(data->qpos[1]) || data->qpos[1] == 0.0)
    throw std::runtime_error("MuJoCo's spring does not move");
  std::printf("%.6g\n", static_cast<double>(commands.size()) / best);
  mj_deleteData(data);
  mj_deleteModel(model);
} catch (const std::exception& error) {
  std::fprintf(stderr, "peer_mujoco: %s\n", error.what());
  return 1;
}

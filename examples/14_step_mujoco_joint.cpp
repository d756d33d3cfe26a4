// A joint of MuJoCo whose spring is a model of torsio, wound by a rising motor current while the joint is held: links torsio::mujoco and
// torsio::files.
//   torsio export joint.safetensors --mjcf --actuator dfki-50 -o elbow.xml
//   14_step_mujoco_joint joint.safetensors elbow.xml
// The model of MuJoCo needs the names of that file: elbow_spring, elbow_motor, elbow_joint.
#include <mujoco/mujoco.h>

#include <array>
#include <cstdio>
#include <exception>
#include <memory>
#include <stdexcept>
#include <string>

#include "torsio/files.hpp"
#include "torsio/mujoco/mujoco_springs.hpp"

namespace {

using Model = std::unique_ptr<mjModel, decltype(&mj_deleteModel)>;
using Data = std::unique_ptr<mjData, decltype(&mj_deleteData)>;

Model load(const char* file) {
  std::array<char, 1000> message{};
  Model model(mj_loadXML(file, nullptr, message.data(), static_cast<int>(message.size())),
              mj_deleteModel);
  if (!model) throw std::runtime_error(message.data());
  return model;
}

void run(const char* model_file, const char* xml_file) {
  const Model model = load(xml_file);
  const Data data(mj_makeData(model.get()), mj_deleteData);
  const torsio::MujocoSprings springs(*model, {{.actuator = "elbow_spring",
                                                .estimator = torsio::load_estimator(model_file),
                                                .gear_ratio = 120.0}});
  springs.settle(*data);  // at rest for long enough: without it the first ticks are warming_up
  const int motor = mj_name2id(model.get(), mjOBJ_ACTUATOR, "elbow_motor");
  const int joint = model->jnt_dofadr[mj_name2id(model.get(), mjOBJ_JOINT, "elbow_joint")];
  torsio::Fault last = torsio::Fault::none;
  for (int step = 0; step < 1000; ++step) {
    data->ctrl[motor] = 2e-3 * step;                                                     // A
    data->qfrc_applied[joint] = -2000.0 * data->qpos[joint] - 20.0 * data->qvel[joint];  // held
    mj_step(model.get(), data.get());
    springs.commit(*data);  // once after each step
    const torsio::Estimate torque = springs.estimate(*data, 0);
    if (torque.fault != last)
      std::printf("t = %.3f s: fault %s\n", data->time, torsio::name(torque.fault).data());
    last = torque.fault;
    if (step % 100 == 99)
      std::printf("t = %.1f s: gear %7.4f rad, joint %7.4f rad, spring %6.2f Nm +- %.2f\n",
                  data->time, data->qpos[0], data->qpos[1], torque.value, torque.std_dev);
  }
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 3) {
    std::fprintf(stderr,
                 "usage: %s MODEL.safetensors elbow.xml (torsio export --mjcf writes one)\n",
                 argv[0]);
    return 2;
  }
  try {
    run(argv[1], argv[2]);
    return 0;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
}

#include <cstdio>
#include <exception>

#include "torsio/files.hpp"
#include "torsio/mujoco/mujoco_springs.hpp"

int main(int argc, char** argv) {
  if (argc != 3) return 2;
  char message[1000] = "";
  mjModel* const model = mj_loadXML(argv[2], nullptr, message, sizeof message);
  if (model == nullptr) return std::puts(message), 1;
  mjData* const data = mj_makeData(model);
  try {
    const torsio::MujocoSprings springs(
        *model, {{.actuator = "elbow_spring", .estimator = torsio::load_estimator(argv[1])}});
    mj_step(model, data);
    springs.commit(*data);
    std::printf("a torque of %.3f Nm\n", springs.estimate(*data, 0).value);
  } catch (const std::exception& error) {
    std::puts(error.what());
    return 1;
  }
  mj_deleteData(data);
  mj_deleteModel(model);
}

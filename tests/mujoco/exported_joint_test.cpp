#include <gtest/gtest.h>

#include <string>

#include "mujoco/simulated_spring.hpp"
#include "support/example_model_file.hpp"
#include "torsio/actuator/joint_parameters.hpp"
#include "torsio/export/mjcf.hpp"

namespace torsio::test {
namespace {

ModelFile file_of_grey_box() {
  ModelFile file = example_model_file(AnyModel(example<GreyBox>()));
  file.settings = simulated_settings();
  return file;
}

/// The angle to which a current of half the peak winds the spring against a fixed joint, after two seconds.
double wound_rad(const MujocoModel& joint, const MujocoSprings* springs) {
  mjData* const data = joint.data.get();
  data->ctrl[0] = 0.5 * joint.model->actuator_ctrlrange[1];
  const int steps = static_cast<int>(2.0 / joint.model->opt.timestep);
  for (int step = 0; step < steps; ++step) {
    data->qpos[1] = 0.0;
    data->qvel[1] = 0.0;
    mj_step(joint.model.get(), data);
    if (springs != nullptr) springs->commit(*data);
  }
  EXPECT_EQ(data->warning[mjWARN_BADQACC].number, 0);
  return data->qpos[0];
}

TEST(ExportedJoint, RunsInMujocoForEachActuator) {
  const ModelFile file = file_of_grey_box();
  for (const DataSheet& sheet : data_sheets()) {
    SCOPED_TRACE(sheet.name);
    const MujocoModel joint(mjcf_text(file, {.name = "elbow", .actuator = sheet}, "a.safetensors"));
    const double ratio = series_elastic_joint(sheet).drive.ratio;
    const MujocoSprings springs(
        *joint.model,
        {{.actuator = "elbow_spring", .estimator = make_estimator(file), .gear_ratio = ratio}});
    springs.settle(*joint.data);
    EXPECT_TRUE(std::isfinite(wound_rad(joint, &springs)));
    // The sensor is the torque on the joint.
    mj_forward(joint.model.get(), joint.data.get());
    const int sensor = mj_name2id(joint.model.get(), mjOBJ_SENSOR, "elbow_torque_Nm");
    ASSERT_GE(sensor, 0);
    EXPECT_NEAR(joint.data->sensordata[joint.model->sensor_adr[sensor]],
                springs.estimate(*joint.data, 0).value, 1e-12);
    EXPECT_NEAR(joint.data->qfrc_actuator[1], springs.estimate(*joint.data, 0).value, 1e-12);
  }
}

TEST(ExportedJoint, HasTheInertiasOfTheDataSheet) {
  const DataSheet sheet = data_sheet("dfki-50");
  const MujocoModel joint(mjcf_text(file_of_grey_box(), {.actuator = sheet}, "a.safetensors"));
  mj_forward(joint.model.get(), joint.data.get());
  EXPECT_NEAR(joint.data->qM[joint.model->dof_Madr[0]], 6e-5 * 120.0 * 120.0 + 0.01, 1e-12);
  EXPECT_NEAR(joint.data->qM[joint.model->dof_Madr[1]], 0.15, 1e-12);
  EXPECT_DOUBLE_EQ(joint.model->opt.timestep, 0.001);
  EXPECT_DOUBLE_EQ(joint.model->actuator_gear[0], 120.0 * 0.104);
  EXPECT_DOUBLE_EQ(joint.model->actuator_ctrlrange[1], 10.0);
}

TEST(ExportedJoint, HasALinearSpringForMujocoAlone) {
  // 0.5 Nm + 100 Nm/rad, the fallback of the example.
  const MujocoModel joint(mjcf_text(
      file_of_grey_box(), {.actuator = data_sheet("dfki-28"), .is_linear = true}, "a.safetensors"));
  joint.data->qpos[0] = 0.3;
  joint.data->qpos[1] = 0.1;
  mj_forward(joint.model.get(), joint.data.get());
  EXPECT_NEAR(joint.data->qfrc_actuator[1], 20.5, 1e-9);
  EXPECT_NEAR(joint.data->qfrc_actuator[0], -20.5, 1e-9);
  EXPECT_NEAR(wound_rad(joint, nullptr), (0.5 * 9.6 * 5.7 - 0.5) / 100.0, 0.02);
}

}  // namespace
}  // namespace torsio::test

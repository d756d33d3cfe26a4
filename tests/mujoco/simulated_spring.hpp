#pragma once

#include <fmt/format.h>
#include <mujoco/mujoco.h>

#include <array>
#include <cmath>
#include <cstddef>
#include <string>
#include <vector>

#include "support/example_models.hpp"
#include "support/example_settings.hpp"
#include "support/mujoco_model.hpp"
#include "torsio/estimate/torque_estimator.hpp"
#include "torsio/mujoco/mujoco_springs.hpp"

namespace torsio::test {

/// What a test changes in the model of a joint.
struct SpringXml {
  std::string integrator = "Euler";
  double timestep_s = 0.001;
  std::size_t userdata = 2000;
  std::string actuator = R"(gear="-1" gaintype="fixed" gainprm="0" biastype="user")";
  std::string tendon = {};
  std::string joint_type = "hinge";
  std::string coefficients = R"("1" "-1")";
  double damping_Nms_rad = 0.0;
};

inline std::string spring_xml(const SpringXml& is = {}) {
  const std::string gear = is.coefficients.substr(0, is.coefficients.find(' '));
  const std::string joint = is.coefficients.substr(is.coefficients.find(' ') + 1);
  const std::string body =
      R"(<body name="{0}"><joint name="{0}" type="{1}" axis="0 0 1" damping="{2}"/>)"
      R"(<inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/></body>)";
  const auto pair = [&](const std::string& prefix) {
    return fmt::format(fmt::runtime(body), prefix + "gear", "hinge", is.damping_Nms_rad) +
           fmt::format(fmt::runtime(body), prefix + "joint", is.joint_type, is.damping_Nms_rad);
  };
  const auto tendon = [&](const std::string& prefix) {
    return fmt::format(
        R"(<fixed name="{0}twist" {1}><joint joint="{0}gear" coef={2}/><joint joint="{0}joint" coef={3}/></fixed>)",
        prefix, is.tendon, gear, joint);
  };
  const auto actuator = [&](const std::string& prefix) {
    return fmt::format(R"(<general name="{0}spring" tendon="{0}twist" {1}/>)", prefix, is.actuator);
  };
  return fmt::format(
      R"(<mujoco><compiler angle="radian"/><option timestep="{}" integrator="{}"/><size nuserdata="{}"/>)"
      R"(<worldbody>{}{}</worldbody><tendon>{}{}</tendon>)"
      R"(<actuator>{}{}<motor name="drive" joint="gear"/></actuator></mujoco>)",
      is.timestep_s, is.integrator, is.userdata, pair(""), pair("b_"), tendon(""), tendon("b_"),
      actuator(""), actuator("b_"));
}

inline EstimatorSettings simulated_settings() {
  EstimatorSettings settings = example_settings();
  settings.disturbances.warm_up_s = 0.05;
  return settings;
}

template <class Family>
Estimator simulated_estimator() {
  return Estimator(simulated_settings(), AnyModel(example<Family>()));
}

/// A joint with its springs, driven on the gear side.
struct SimulatedSpring {
  explicit SimulatedSpring(const Estimator& estimator, const SpringXml& xml = {},
                           MujocoOptions options = {})
      : mujoco(spring_xml(xml)),
        springs(*mujoco.model,
                {{.actuator = "spring", .estimator = estimator},
                 {.actuator = "b_spring", .estimator = estimator}},
                options) {}

  [[nodiscard]] mjModel* model() const { return mujoco.model.get(); }
  [[nodiscard]] mjData* data() const { return mujoco.data.get(); }

  /// Angles of gear and joint at which the step began.
  static std::array<double, 2> step(const MujocoSprings& springs, const mjModel* model,
                                    mjData* data, double torque_Nm = 0.0) {
    const std::array angles{data->qpos[0], data->qpos[1]};
    data->qfrc_applied[0] = torque_Nm;
    data->qfrc_applied[2] = -0.5 * torque_Nm;
    mj_step(model, data);
    springs.commit(*data);
    return angles;
  }
  std::array<double, 2> step(double torque_Nm = 0.0) const {
    return step(springs, model(), data(), torque_Nm);
  }

  MujocoModel mujoco;
  MujocoSprings springs;
};

inline double driving_torque(double time_s) {
  return 8.0 * std::sin(9.0 * time_s) + 5.0 * std::sin(23.0 * time_s);
}

inline std::vector<double> numbers_of(const SimulatedSpring& of, const mjData* data) {
  std::vector<double> all(data->qpos, data->qpos + of.model()->nq);
  all.insert(all.end(), data->qvel, data->qvel + of.model()->nv);
  return all;
}

}  // namespace torsio::test

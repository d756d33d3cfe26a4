#pragma once

#include <mujoco/mujoco.h>

#include <cstddef>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "torsio/core/estimate.hpp"
#include "torsio/core/realtime.hpp"
#include "torsio/estimate/torque_estimator.hpp"

namespace torsio {

/// A channel of a model that is the angle or the speed (by its unit, rad or rad_s) of a hinge of MuJoCo, times a factor.
struct MujocoChannel {
  std::string channel;
  std::string joint;  ///< name of the hinge
  double factor = 1.0;
};

/// An actuator of a MuJoCo model whose force is the estimated torque of a spring:
///
///     <tendon> <fixed name="elbow_deflection"> <joint joint="elbow_gear" coef="1"/>
///                                              <joint joint="elbow" coef="-1"/> </fixed> </tendon>
///     <actuator> <general name="elbow_spring" tendon="elbow_deflection" gear="-1"
///                         gaintype="fixed" gainprm="0" biastype="user"/> </actuator>
///
/// The tendon's length is the deflection gear - joint. The joint receives the torque, the gear side its negative; with
/// gear="-1" the force of the actuator is the torque on the joint, and with gear="1" its negative.
struct MujocoSpring {
  std::string actuator;  ///< its name
  /// At the rate of the ticks: 1 / timestep, or a whole part of that. Channels whose zero is not set have the zero 0.
  Estimator estimator;
  /// Motor angle over gear angle, for models that use the motor's angle or speed.
  double gear_ratio = kNotMeasured;
  /// Channels besides, or instead of, those of the two hinges: `gear_angle_rad`, `joint_angle_rad`,
  /// `spring_deflection_rad`, `motor_angle_rad`, and their speeds `gear_speed_rad_s`, `joint_speed_rad_s`,
  /// `spring_deflection_rate_rad_s`, `motor_speed_rad_s`.
  std::vector<MujocoChannel> channels = {};
};

struct MujocoOptions {
  /// Threads that step mjData of the model at the same time. With more than these a step waits for another one.
  std::size_t threads = 1;
  std::size_t first_userdata = 0;  ///< those before belong to others
};

/// The springs of one mjModel, driven by MuJoCo's callback `mjcb_act_bias`. What a step changes is in `mjData::userdata`:
/// mj_copyData makes a branch that continues with the same bits, mj_resetData a spring after a reset.
///
///     MujocoSprings springs(*model, {{.actuator = "elbow_spring", .estimator = load_estimator(path, {.rate_Hz = 1000})}});
///     springs.settle(*data);
///     while (...) { mj_step(model, data);  springs.commit(*data); }
///
/// A tick takes place in the evaluation of forces with which a step begins, with the angles at that time. mj_forward may
/// be repeated; RK4, which evaluates four times per step, receives a blend of the ticks before and after between two
/// ticks, and so do the steps between if a tick is several steps long.
///
/// The callback has no lock, no heap and no exception. With a fault the torque is what the estimator returns with it
/// (docs/robot/estimator.md), as a rule the linear fallback; it is finite always. A step without `commit` is
/// `Fault::wrong_rate`.
///
/// Global are only the callback, which calls the one that was registered before for all other actuators, and the list of
/// adapters that it searches. The model refers to its adapter by a number in `actuator_biasprm`, which mj_copyModel
/// copies: copies use the same adapter. Construct and destroy adapters while no thread steps; without its adapter the
/// force is 0.
class MujocoSprings {
 public:
  /// @throws UsageError for an unknown actuator, one that is not as above, a rate that does not fit to the timestep, a
  /// channel that MuJoCo does not have, a target that is not a torque in Nm, or too small a `nuserdata`; Error for a model
  /// whose state cannot be saved, or at more than 1024 adapters.
  MujocoSprings(mjModel& model, const std::vector<MujocoSpring>& springs,
                MujocoOptions options = {});
  MujocoSprings(MujocoSprings&& other) noexcept;
  MujocoSprings& operator=(MujocoSprings&& other) noexcept;
  ~MujocoSprings();

  /// The numbers that springs with these estimators need: `<size nuserdata="..."/>`.
  [[nodiscard]] static std::size_t userdata_size(std::span<const MujocoSpring> springs) noexcept;

  /// To be called after each mj_step, or after mj_step2: the state after the tick replaces that before.
  void commit(mjData& data) const noexcept TORSIO_REALTIME;
  /// What the last tick of a spring estimated, torque on the joint in Nm. @param spring as in the constructor
  [[nodiscard]] Estimate estimate(const mjData& data, std::size_t spring) const noexcept;
  /// Springs that have been at rest at the angles of `data` until filters and memory have settled, for at most
  /// `longest_s`: a simulation that begins without `Fault::warming_up`.
  void settle(mjData& data, double longest_s = 20.0) const noexcept;

  [[nodiscard]] std::size_t size() const noexcept;

 private:
  struct Adapter;
  std::unique_ptr<Adapter> adapter_;
};

}  // namespace torsio

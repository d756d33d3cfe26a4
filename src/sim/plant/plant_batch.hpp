#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <vector>

#include "sim/plant/plant.hpp"
#include "torsio/core/fault.hpp"
#include "torsio/core/realtime.hpp"

namespace torsio {

class PlantLanes;

/// Many plants of one kind side by side, a vector register full of them at a time, for parameter
/// studies and for learning in simulation.
///
/// The equations, their order and the division of long steps are those of Plant; the parameters may
/// differ from plant to plant. What a plant does depends neither on the others nor on how many
/// there are: its bits are the same in any batch on one instruction set. Against Plant, and between
/// instruction sets, rounding differs: sine, exponential and hyperbolic tangent are Highway's,
/// right to some 1e-15 of their range, and products are fused where the processor can. After a
/// second of random commands states and torques are within 1e-12 of their range. Sines are right up
/// to 4e8 (rotor angle times ripple order); beyond it ripple and kinematic error are wrong, but
/// finite.
class PlantBatch {
 public:
  /// All at rest at angle 0, unloaded.
  /// @param parameters one a plant; all with the same stages, the same friction in their springs,
  /// and all or none of their elastomers bonded
  /// @param longest_step_s a longer step is divided into equal ones; none: the shortest of those
  /// that the plants would take on their own
  /// @throws Error if there is no plant, if their kinds differ or this chain of stages has no
  /// kernel (the message lists those that have), or as Plant does.
  explicit PlantBatch(std::span<const PlantParameters> parameters, double longest_step_s = 0.0);
  PlantBatch(PlantBatch&& other) noexcept;
  PlantBatch& operator=(PlantBatch&& other) noexcept;
  ~PlantBatch();

  /// As Plant's: all plants, or one of them. Conditions stay. Everywhere `plant` < `size()` is a
  /// precondition that nothing checks.
  Fault reset(double joint_angle_rad = 0.0, const Load& load = {}) noexcept;
  Fault reset(std::size_t plant, double joint_angle_rad, const Load& load) noexcept;
  Fault reset(std::size_t plant, const PlantState& state) noexcept;
  Fault set_condition(std::size_t plant, const PlantCondition& condition) noexcept;

  /// Advances all plants, each under its own command and load, which are held while a step longer
  /// than `longest_step` is divided.
  /// @returns Fault::input_not_finite if a plant got inputs that Plant refuses: `fault` returns
  /// which, they are not changed, and the others move. Fault::model_not_finite if there is none of
  /// these, but one whose state is not finite any more: it is reset to rest, as in Plant. A dt that
  /// Plant refuses is a fault of all of them. Spans of another size than `size()` are
  /// Fault::input_count_wrong, and nothing moves.
  [[nodiscard]] Fault step(std::span<const PlantCommand> commands, std::span<const Load> loads,
                           double dt_s) noexcept TORSIO_REALTIME;

  [[nodiscard]] std::size_t size() const noexcept { return plants_.size(); }
  [[nodiscard]] double longest_step() const noexcept { return longest_step_s_; }  ///< [s]
  [[nodiscard]] const PlantParameters& parameters(std::size_t plant) const noexcept {
    return plants_[plant].parameters();
  }
  [[nodiscard]] PlantState state(std::size_t plant) const noexcept;
  [[nodiscard]] PlantTorques torques(std::size_t plant) const noexcept;
  [[nodiscard]] double current(std::size_t plant) const noexcept;  ///< [A]
  /// @returns twist [rad] of the second stage in the last step
  [[nodiscard]] double second_twist(std::size_t plant) const noexcept;
  /// @returns what the last step made of one plant's input
  [[nodiscard]] Fault fault(std::size_t plant) const noexcept { return faults_[plant]; }

 private:
  double longest_step_s_;
  double asked_dt_s_ = 0.0;
  std::vector<Plant> plants_;  ///< the parts of each; they find the states to which `reset` goes
  std::unique_ptr<PlantLanes> lanes_;
  std::vector<Fault> faults_;
};

}  // namespace torsio

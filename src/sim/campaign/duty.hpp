#pragma once

#include <cstddef>
#include <cstdint>

#include "signal/joint_move.hpp"
#include "sim/campaign/duty_recording.hpp"
#include "sim/plant/plant.hpp"
#include "torsio/actuator/data_sheet.hpp"
#include "torsio/actuator/wear.hpp"
#include "torsio/core/random.hpp"

namespace torsio {

/// Random work of one joint for hours, the same for any actuator: moves of least jerk between random
/// positions, rests, loads that change while it rests, a lubricant that warms, friction that ages, and
/// impacts. Everything is bounded (`DutyLimits`), and depends on the seed alone.
///
/// An impact is a half-sine of the external torque. On a spring of stiffness k with inertia J at its output
/// the torque of a pulse of amplitude A and duration T is at most A min(1.8, 2 T sqrt(k / J) / π), so that
/// A follows from the torque that is left below the limit.
class Duty {
 public:
  Duty(const DataSheet& sheet, const DutySettings& settings, std::uint64_t seed);

  /// The first move begins here: where a joint at rest under its load has its rotor.
  void start_at(double joint_rad) noexcept { wanted_rad_ = joint_rad; }
  /// Call once per tick, 1 kHz; afterwards the values below are those of this tick.
  void step();

  [[nodiscard]] double wanted_rad() const noexcept {
    return wanted_rad_;
  }  ///< reference of the joint
  [[nodiscard]] const Load& load() const noexcept { return load_; }
  [[nodiscard]] double temperature_K() const noexcept { return temperature_K_; }
  /// The factor from temperature and age.
  [[nodiscard]] double friction_factor() const noexcept { return friction_factor_; }
  /// The friction factor is a new one at this tick.
  [[nodiscard]] bool is_condition_new() const noexcept { return tick_ % kConditionTicks == 1; }
  /// Since the last impact began; infinity if there was none.
  [[nodiscard]] double since_impact_s() const noexcept;
  /// An impact has begun at this tick.
  [[nodiscard]] bool has_impact_begun() const noexcept {
    return impact_ticks_ != 0 && tick_ == impact_tick_ + 1;
  }
  [[nodiscard]] bool is_moving() const noexcept { return is_moving_; }

 private:
  static constexpr std::size_t kConditionTicks = 250;
  struct Weight {
    double gravity_Nm = 0.0;
    double inertia_kg_m2 = 0.0;
  };
  [[nodiscard]] std::size_t ticks_between(double shortest_s, double longest_s) noexcept;
  [[nodiscard]] Weight drawn_weight() noexcept;
  void begin_move();
  void begin_rest() noexcept;
  void change_weight() noexcept;
  void step_impact() noexcept;
  void begin_impact() noexcept;
  void step_condition() noexcept;

  DutyLimits limits_;
  DutySettings settings_;
  Random random_;
  double joint_inertia_kg_m2_;
  double stiffness_Nm_rad_;
  double top_speed_rad_s_;

  std::size_t tick_ = 0;
  double wanted_rad_ = 0.0;
  JointMove move_;
  bool is_moving_ = false;
  std::size_t rest_left_ = 0;
  Load load_;
  Weight from_;
  Weight to_;
  std::size_t weight_tick_ = 0;  ///< tick at which the change began
  std::size_t next_weight_ = 0;  ///< tick from which the next rest changes it
  std::size_t next_impact_ = 0;
  std::size_t impact_tick_ = 0;   ///< at which the last one began
  std::size_t impact_ticks_ = 0;  ///< its duration; 0: there was none
  double impact_Nm_ = 0.0;
  double temperature_K_ = OperatingConditions::kReference_K;
  double wanted_K_ = OperatingConditions::kReference_K;
  double wear_ = 1.0;
  double wanted_wear_ = 1.0;
  double friction_factor_ = 1.0;
};

}  // namespace torsio

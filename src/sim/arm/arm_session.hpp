#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "sim/arm/arm_bench.hpp"
#include "torsio/arm/arm_controller.hpp"
#include "torsio/sim/arm/arm_setup.hpp"

namespace torsio {

/// The simulated arm under its controller, tick by tick.
class ArmSession {
 public:
  /// At rest at these angles, stopped, the brakes closed.
  /// @param setup lives longer than the session
  /// @throws Error as `ArmBench` and `ArmController`.
  ArmSession(const ArmSetup& setup, ArmController::Settings settings, FirstStageForm form,
             std::span<const FaultSchedule> faults, std::uint64_t seed,
             std::span<const double> start_rad);

  /// Holds until the motors carry the arm, the brakes are open and every monitor watches; time begins then.
  /// @throws Error if that takes too long.
  void open_brakes();

  /// One tick is both: sensors and controller, then the arm moves on.
  const ArmController::Output& control(const ArmReference& wanted);
  void act(const ArmLoad& load) { bench_.act(commands_, load); }

  [[nodiscard]] ArmBench& bench() noexcept { return bench_; }
  [[nodiscard]] const ArmBench& bench() const noexcept { return bench_; }
  [[nodiscard]] ArmController& controller() noexcept { return controller_; }
  [[nodiscard]] const ArmController& controller() const noexcept { return controller_; }
  /// What was found in the joint that stopped the arm, in words.
  [[nodiscard]] std::string stop_reason(const ArmController::Output& output) const;
  [[nodiscard]] double time_s() const noexcept { return bench_.time_s(); }
  /// Measured, one per joint; the last ones of a joint without a measurement.
  [[nodiscard]] std::span<const double> angle_rad() const noexcept { return angle_rad_; }
  [[nodiscard]] std::span<const double> speed_rad_s() const noexcept { return speed_rad_s_; }

 private:
  const ArmSetup& setup_;
  ArmBench bench_;
  ArmController controller_;
  std::vector<ArmBench::Command> commands_;
  std::vector<double> angle_rad_;
  std::vector<double> speed_rad_s_;
};

}  // namespace torsio

#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "sim/arm/arm_plant.hpp"
#include "sim/faults/fault_injector.hpp"
#include "sim/sensors/sensor_set.hpp"
#include "torsio/estimate/joint_sample.hpp"
#include "torsio/sim/arm/arm_setup.hpp"

namespace torsio {

inline constexpr double kArmTick_s = 1.0 / kBenchRate_Hz;

/// An arm with its sensors, its brakes and whatever happens to them, tick by tick (`kBenchRate_Hz`).
///
/// A brake that has closed clamps its rotor; that it slides while it closes is left out.
class ArmBench {
 public:
  struct Command {
    double current_A = 0.0;
    bool is_powered = true;
    bool is_brake_open = true;
  };

  /// At rest at these angles, the brakes closed.
  /// @param faults one schedule per joint, or none
  /// @param longest_step_s of the integration, or shorter where the arm requires it; 0: that of `ArmPlant`
  /// @throws Error as `ArmPlant` does, UsageError as `FaultInjector`.
  ArmBench(const ArmSetup& setup, FirstStageForm form, std::span<const FaultSchedule> faults,
           std::uint64_t seed, std::span<const double> start_rad, double longest_step_s = 0.0);

  /// The signals of all joints at this tick, including faults.
  void sense();
  [[nodiscard]] const Measurement& measured(std::size_t joint) const {
    return joints_[joint].measured;
  }
  [[nodiscard]] std::span<const JointSample> samples() const noexcept { return samples_; }
  /// `time_s`, and with it the faults, counts from here; the clock of the samples does not jump.
  void start_clock() noexcept { start_tick_ = tick_; }
  /// Advances to the next tick. @throws Error if the arm refuses.
  void act(std::span<const Command> commands, const ArmLoad& load);

  /// Faults that are injected while it runs: first `FaultInjector::prepare`.
  [[nodiscard]] FaultInjector& faults(std::size_t joint) noexcept {
    joints_[joint].has_faults = true;
    return joints_[joint].faults;
  }
  [[nodiscard]] const ArmPlant& plant() const noexcept { return plant_; }
  /// From now on there is this plate.
  /// @param plate measured from the flange where it truly is, or in the frame of the base
  void use(ArmPlate plate);
  [[nodiscard]] Vector3 flange_m() const;  ///< where the flange truly is
  /// @returns the largest force of the plate since the last call [N]; 0 without one
  double take_largest_plate_N() noexcept {
    return plant_.plate() == nullptr ? 0.0 : plant_.plate()->take_largest_N();
  }
  [[nodiscard]] double time_s() const noexcept {
    return static_cast<double>(tick_ - start_tick_) / kBenchRate_Hz;
  }

 private:
  struct Joint {
    Joint(const DataSheet& sheet, const FaultSchedule& schedule, std::uint64_t seed);

    SensorSet sensors;
    FaultInjector faults;
    bool has_faults;
    double engage_s;
    double release_s;
    double since_s = 1e9;  ///< since the brake's command changed
    bool is_open = false;  ///< the brake's command
    bool is_held = true;   ///< the rotor, by the brake
    Measurement measured = {};
  };

  [[nodiscard]] SensedPlant sensed(std::size_t joint) const noexcept;

  ArmPlant plant_;
  std::vector<Joint> joints_;
  std::vector<JointSample> samples_;
  std::vector<PlantCommand> commands_;
  std::size_t tick_ = 0;
  std::size_t start_tick_ = 0;
};

}  // namespace torsio

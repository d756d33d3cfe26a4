#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "duty.hpp"
#include "duty_plants.hpp"
#include "sim/campaign/duty_recording.hpp"
#include "sim/faults/fault_injector.hpp"
#include "sim/loops/bench_position_loop.hpp"
#include "sim/sensors/sensor_set.hpp"
#include "torsio/sim/faults/fault_schedule.hpp"

namespace torsio {

/// One joint on a `DutyBench`.
struct DutyLane {
  DataSheet sheet;
  std::uint64_t seed = 1;  ///< seed of its work and of the noise of its sensors
  DutySettings settings = {};
  FaultSchedule faults = {};
  bool is_loop_sound = false;  ///< faults of its sensors do not reach the position loop
};

/// The sheet with the bench of `duty_recording`: a load cell of 1 kHz without latency, a log of 1 kHz.
[[nodiscard]] DataSheet with_duty_bench(DataSheet sheet);

/// The seed of the `Duty` of a lane with this seed.
[[nodiscard]] std::uint64_t duty_seed(std::uint64_t seed);

/// Joints at work side by side, 1 kHz, each with its own plant, sensors, position loop, work and faults.
/// What a joint does depends neither on the others nor on how many there are.
class DutyBench {
 public:
  struct Options {
    bool is_electrical = false;
    bool is_single = false;   ///< each a `Plant`, for what only that one has
    bool has_brakes = false;  ///< that a cut closes, as it removes the power
  };
  /// @param lanes of one kind, as `PlantBatch` requires
  /// @throws Error if a plant refuses its start, UsageError as `FaultInjector`.
  explicit DutyBench(const std::vector<DutyLane>& lanes, const Options& options);
  explicit DutyBench(const std::vector<DutyLane>& lanes) : DutyBench(lanes, Options{}) {}

  [[nodiscard]] std::size_t size() const noexcept { return lanes_.size(); }
  [[nodiscard]] double time_s() const noexcept;

  /// Reads the sensors of all joints at this tick.
  void sense() noexcept;
  /// With faults, and the same without, at the last `sense`.
  [[nodiscard]] const Measurement& measured(std::size_t lane) const noexcept {
    return lanes_[lane].measured;
  }
  [[nodiscard]] const Measurement& sound(std::size_t lane) const noexcept {
    return lanes_[lane].sound;
  }
  /// True torque between joint and load at the last `sense`.
  [[nodiscard]] double torque_Nm(std::size_t lane) const noexcept { return lanes_[lane].torque_Nm; }
  [[nodiscard]] const PlantCondition& condition(std::size_t lane) const noexcept {
    return lanes_[lane].condition;
  }
  [[nodiscard]] const DutyPlants& plants() const noexcept { return plants_; }
  [[nodiscard]] const Duty& duty(std::size_t lane) const noexcept { return lanes_[lane].duty; }

  /// Advances all joints to the next tick. A plant that refuses its input stays as it is; one whose
  /// state is not finite begins again at rest.
  void act();
  /// From now on the joint has no current; a brake closes.
  void cut(std::size_t lane) noexcept { lanes_[lane].is_cut = true; }

 private:
  struct Lane {
    Lane(const DutyLane& from, double run_s);
    SensorSet sensors;
    Duty duty;
    BenchPositionLoop loop;
    FaultInjector faults;
    bool has_faults;
    bool is_loop_sound;
    bool is_cut = false;
    double brake_V = 0.0;  ///< voltage that holds the brake open; 0: there is none
    double torque_Nm = 0.0;
    Measurement sound;
    Measurement measured;
    PlantCondition condition;
  };

  DutyPlants plants_;
  std::vector<Lane> lanes_;
  std::vector<PlantCommand> commands_;
  std::vector<Load> loads_;
  std::size_t tick_ = 0;
};

}  // namespace torsio

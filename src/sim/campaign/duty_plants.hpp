#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <variant>
#include <vector>

#include "sim/plant/plant.hpp"
#include "sim/plant/plant_batch.hpp"
#include "sim/sensors/sensor_set.hpp"

namespace torsio {

/// The step of a plant with a brake, whose bristle is stiffer than what the usual steps follow.
[[nodiscard]] double braked_step_s(const PlantParameters& parameters);

/// Plants side by side: a `PlantBatch`, or single ones where they have what a batch does not step (an
/// electrical drive, the table of a spring).
class DutyPlants {
 public:
  /// @param drive_seeds of the electrical drives, one a plant; empty: without
  /// @param has_brakes single plants with the brake of their data sheet, open until `set_brake`
  /// @throws Error as `PlantBatch` and `Plant`.
  DutyPlants(std::span<const DataSheet> sheets, std::span<const std::uint64_t> drive_seeds,
             bool is_single, bool has_brakes = false);

  Fault reset(std::size_t lane, double joint_angle_rad, const Load& load) noexcept;
  Fault set_condition(std::size_t lane, const PlantCondition& condition) noexcept;
  /// Without effect in a batch, and on a plant without a brake.
  void set_brake(std::size_t lane, bool is_closed) noexcept;
  /// @returns the worst fault
  Fault step(std::span<const PlantCommand> commands, std::span<const Load> loads,
             double dt_s) noexcept;

  [[nodiscard]] SensedPlant sensed(std::size_t lane) const noexcept;
  [[nodiscard]] PlantTorques torques(std::size_t lane) const noexcept;
  /// Null in a batch.
  [[nodiscard]] const Plant* single(std::size_t lane) const noexcept;

 private:
  std::variant<std::vector<Plant>, PlantBatch> plants_;
};

}  // namespace torsio

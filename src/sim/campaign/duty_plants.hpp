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

/// Plants side by side: a `PlantBatch`, or single ones where they have what a batch does not step (an
/// electrical drive, the table of a spring).
class DutyPlants {
 public:
  /// @param drive_seeds of the electrical drives, one a plant; empty: without
  /// @throws Error as `PlantBatch` and `Plant`.
  DutyPlants(std::span<const DataSheet> sheets, std::span<const std::uint64_t> drive_seeds,
             bool is_single);

  Fault reset(std::size_t lane, double joint_angle_rad, const Load& load) noexcept;
  Fault set_condition(std::size_t lane, const PlantCondition& condition) noexcept;
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

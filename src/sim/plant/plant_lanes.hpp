#pragma once

#include <cstddef>
#include <span>

#include "plant_rows.hpp"
#include "sim/plant/plant.hpp"
#include "torsio/core/fault.hpp"

namespace torsio {

/// The blocks of a PlantBatch, seen plant by plant: `at` is the number of one.
class PlantLanes {
 public:
  /// @throws Error if the kinds differ, or no kernel steps this one.
  explicit PlantLanes(std::span<const PlantParameters> parameters);

  /// Number of all lanes: the spare lanes of the last block are filled, too; their plants remain at
  /// rest.
  [[nodiscard]] std::size_t padded_size() const noexcept;

  void set_parts(std::size_t at, const Plant& plant) noexcept;
  void set_period(std::size_t at, const Plant& plant, double dt_s) noexcept;
  /// @param plant that was reset and has not moved since
  void start(std::size_t at, const Plant& plant) noexcept;
  void set_condition(std::size_t at, const PlantCondition& condition) noexcept;

  /// Reads inputs, steps, and writes to `faults` the refused inputs and the plants whose state is
  /// not finite any more.
  /// @returns whether there is no fault
  bool step(std::span<const PlantCommand> commands, std::span<const Load> loads, std::size_t steps,
            double dt_s, std::span<Fault> faults) noexcept;

  [[nodiscard]] PlantState state(std::size_t at) const noexcept;
  [[nodiscard]] PlantTorques torques(std::size_t at) const noexcept;
  [[nodiscard]] double current(std::size_t at) const noexcept;
  [[nodiscard]] double second_twist(std::size_t at) const noexcept;

 private:
  PlantBlocks blocks_;
};

}  // namespace torsio

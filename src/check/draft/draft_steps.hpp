#pragma once

#include <span>
#include <vector>

#include "check/draft/mapping_draft.hpp"
#include "check/draft/name_reading.hpp"

namespace torsio {

/// A draft while it is made.
struct DraftWork {
  const LogTable& table;
  std::span<const LogTable> others;  ///< further logs of the joint, with the same columns
  MappingDraft draft;
  std::vector<NameReading> readings;  ///< one for each column

  [[nodiscard]] std::size_t size() const { return draft.columns.size(); }
  [[nodiscard]] const std::vector<double>& values(std::size_t column) const {
    return table.columns[column].values;
  }
  /// In the SI unit of the guess, with its sign, before the gear.
  [[nodiscard]] std::vector<double> si_values(std::size_t column) const {
    return si_values(table, column);
  }
  [[nodiscard]] std::vector<double> si_values(const LogTable& of, std::size_t column) const;
  /// Columns of a quantity whose unit is known or guessed, measured ones.
  [[nodiscard]] std::vector<std::size_t> measured(Quantity quantity) const;
};

// The steps, in their order.
void guess_clock(DraftWork& work);       ///< by name, unit and rising values
void guess_quantities(DraftWork& work);  ///< by name and unit
void guess_units(DraftWork& work);       ///< by logger, values, and speeds that are derivatives
void guess_gear(DraftWork& work);        ///< sides, ratio and signs by the relation of the angles
void guess_sides_of_speeds(DraftWork& work);  ///< by the angle that each is the derivative of
void guess_held(DraftWork& work);             ///< masks, and sensors that are slower than the log
void settle_torques(DraftWork& work);         ///< the one of a sensor is that of the spring
void settle_twins(DraftWork& work);           ///< one column for each channel

}  // namespace torsio

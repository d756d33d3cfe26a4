#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "sim/plant/plant.hpp"
#include "torsio/sim/faults/fault_schedule.hpp"

namespace torsio {

/// Limit of one drift and of the product of all: with ten times the friction the plant's steps
/// still resolve its bristles, whose rate increases with the root.
constexpr double kLargestFactor = 10.0;

/// What can happen to whom: the one table that the reader and the injector go by.
struct FaultRule {
  std::string_view name;  ///< as a schedule writes it
  FaultKind kind = FaultKind::freeze;
  std::string_view part = {};         ///< empty: any sensor
  std::string_view amount_key = {};   ///< key of `amount` in a schedule; empty: none
  std::string_view amount_unit = {};  ///< empty: a sensor's amount has the unit of its channel
  double lowest = 0.0;                ///< lower limit of |amount|
  double highest = 0.0;               ///< upper limit of |amount|
  double PlantCondition::*factor = nullptr;  ///< factor that is set to the amount
};

/// The part's name in `FaultRule::part`, whatever this actuator calls it; empty: no part of it.
[[nodiscard]] std::string_view common_part_name(std::string_view part, const DataSheet& sheet);

/// The largest stiffness of a stop [Nm/rad] that the bench's steps follow.
[[nodiscard]] double stiffest_stop(const DataSheet& sheet);

/// Null if it has no such fault.
[[nodiscard]] const FaultRule* find_fault_rule(std::string_view name,
                                               std::string_view part) noexcept;
[[nodiscard]] const FaultRule* find_fault_rule(FaultKind kind, std::string_view part) noexcept;

/// The amount as `lowest` and `highest` limit it: without its sign for a sensor, where only a resolution has none.
[[nodiscard]] double limited_amount(const FaultRule& rule, double amount) noexcept;
/// The amount of a sensor's fault in the unit of the measurement, of which the channel has `scale` times the number.
[[nodiscard]] double measured_amount(FaultKind kind, double amount, double scale) noexcept;

/// What can happen to a part, or to any sensor: names as a schedule writes them.
[[nodiscard]] std::vector<std::string> fault_names(std::string_view part);

/// @throws UsageError as the constructor of `FaultInjector` does.
void check_fault(const ScheduledFault& fault, const DataSheet& sheet, double run_s);

}  // namespace torsio

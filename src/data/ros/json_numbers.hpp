#pragma once

#include <string>
#include <string_view>

#include "data/read_budget.hpp"
#include "data/ros/topic_table.hpp"

namespace torsio {

/// Sets the numbers and booleans of a JSON message in the row of `table`, each in a column of its own:
/// "/topic/field/sub", "/topic/field/2" for an element of a list.
/// @returns false if it is not JSON, or is nested deeper than 64 levels
[[nodiscard]] bool set_json_numbers(std::string_view message, const std::string& topic,
                                    TopicTable& table, ReadBudget& budget);

}  // namespace torsio

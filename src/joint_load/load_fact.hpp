#pragma once

#include <string>
#include <string_view>

#include "data/yaml_reader.hpp"
#include "torsio/joint_load/known_load.hpp"

namespace torsio {

/// A number with its unit, or the name of a condition in the same quantity.
[[nodiscard]] LoadFact load_fact(const YamlValue& value, std::string_view si_unit);

/// The fact in a recording: its value, or that of the condition that it names.
/// @param file the file that states the fact, for messages
/// @throws Error if the recording has no such condition, or a channel that is not constant.
[[nodiscard]] double fact_in(const LoadFact& fact, const Recording& recording,
                             std::string_view file, std::string_view name);

}  // namespace torsio

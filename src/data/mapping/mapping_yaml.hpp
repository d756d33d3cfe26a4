#pragma once

#include <vector>

#include "data/yaml_reader.hpp"
#include "torsio/data/mapping.hpp"

namespace torsio {

/// @param joint as in `read_mapping`
[[nodiscard]] Mapping mapping_from(const YamlValue& of_joints, const std::string& joint = {});
[[nodiscard]] std::vector<ZeroRule> zeros_from(const YamlValue& yaml);

/// The SI name of a channel that a file names. @throws Error at the value's place if the name ends
/// in no known unit.
[[nodiscard]] std::string si_channel_name(const std::string& name, const std::string& place);

}  // namespace torsio

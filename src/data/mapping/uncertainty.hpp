#pragma once

#include <string>
#include <vector>

#include "data/yaml_reader.hpp"
#include "torsio/data/mapping.hpp"

namespace torsio {

/// `uncertainty: {torque_Nm: {class: 0.2%, range: 100Nm, gain: 0.5%, mounting: 0.3%, zero: 0.1Nm}}`
[[nodiscard]] std::vector<UncertaintyRule> uncertainties_from(const YamlValue& yaml);

/// The entries of one channel, as `uncertainties_from` reads them; 0 is left out.
[[nodiscard]] std::vector<std::pair<std::string, std::string>> entries_of(
    const UncertaintyRule& rule);

}  // namespace torsio

#pragma once

#include <string>
#include <vector>

#include "sim/plant/plant.hpp"
#include "torsio/actuator/data_sheet.hpp"

namespace torsio::test {

/// The names of all actuators in all their variants.
inline std::vector<std::string> every_actuator() {
  std::vector<std::string> names;
  for (const DataSheet& sheet : data_sheets()) {
    for (const std::string_view variant : sheet.variants) {
      const std::string name(sheet.name);
      if (!variant.empty()) names.push_back(name + ":" + std::string(variant));
    }
    if (sheet.variants.front().empty()) names.emplace_back(sheet.name);
  }
  return names;
}

/// A lever that pulls with a tenth of the rated torque when it is level.
inline Load tenth_of_the_rating(const DataSheet& sheet) {
  constexpr double kLength_m = 0.1;
  return lever(0.1 * sheet.rating.torque_Nm.value / (9.81 * kLength_m), kLength_m);
}

}  // namespace torsio::test

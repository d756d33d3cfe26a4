#pragma once

#include <vector>

#include "sim/plant/plant_parameters.hpp"
#include "support/arm6.hpp"

namespace torsio::test {

/// The drives of `arm6`, with every effect of their sheets.
inline std::vector<PlantParameters> arm6_drives() {
  std::vector<PlantParameters> drives;
  for (const char* name : {"dfki-300", "dfki-300", "dfki-120", "dfki-28", "dfki-28", "dfki-28"})
    drives.push_back(plant_parameters(data_sheet(name)));
  return drives;
}

inline ArmModel arm6_with_8_kg() {
  ArmModel arm = arm6();
  arm.payload = payload_of_8_kg();
  return arm;
}

}  // namespace torsio::test

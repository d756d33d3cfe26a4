#pragma once

#include <vector>

#include "torsio/actuator/data_sheet.hpp"

namespace torsio::test {

/// The sheets of the family with a gear before a spring.
inline std::vector<DataSheet> series_elastic_sheets() {
  std::vector<DataSheet> sheets;
  for (const DataSheet& sheet : data_sheets()) {
    if (sheet.family == ActuatorFamily::series_elastic) sheets.push_back(sheet);
  }
  return sheets;
}

}  // namespace torsio::test

#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "fleet/calibration.hpp"
#include "torsio/store/registry.hpp"

namespace torsio {

struct RegisteredFleet {
  std::size_t models = 0;
  std::size_t promoted = 0;
  std::size_t current_before = 0;  ///< models that were current already
  /// Joints whose model became current though they were not compared with others of their type: these are too few.
  std::vector<std::string> not_compared = {};
  /// Joints whose model was not made current, with the reason.
  std::vector<std::string> refused = {};
};

/// Adds the joints of a calibration to the registry, with their recordings and models. Repeated, it adds nothing.
/// @param request `CalibrationStudy::request`
/// @param promotes also makes the models current of joints that do not differ from the others of their type
[[nodiscard]] RegisteredFleet register_fleet(Registry& registry, StudyStore& store,
                                             const FleetCalibration& fleet,
                                             const CalibrationRequest& request, bool promotes,
                                             const std::string& by);

}  // namespace torsio

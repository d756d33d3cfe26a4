#pragma once

#include "torsio/actuator/data_sheet.hpp"

namespace torsio {

/// Factors on the properties of a stage.
struct StageWear {
  double stiffness = 1.0;
  double friction = 1.0;  ///< inner friction, with its break-away angles
  double play = 1.0;
};

/// An actuator whose second stage (spring, coupling, rubber, gear) has changed. Changed values are tagged
/// assumed.
[[nodiscard]] DataSheet worn(const DataSheet& sheet, const StageWear& wear);

}  // namespace torsio

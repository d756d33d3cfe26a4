#pragma once

#include <variant>

#include "torsio/actuator/data_sheet.hpp"

namespace torsio {

/// Stiffness of the spring, or of the gear of a harmonic drive [Nm/rad].
[[nodiscard]] inline double second_stage_stiffness(const DataSheet& sheet) {
  return std::visit([](const auto& stage) { return stage.stiffness_Nm_rad.value; }, sheet.second);
}

}  // namespace torsio

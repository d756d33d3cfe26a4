#pragma once

#include <optional>
#include <string>

#include "sim/closed_loop/impedance_loop.hpp"
#include "torsio/actuator/data_sheet.hpp"
#include "torsio/control/model_inverse.hpp"
#include "torsio/sim/closed_loop/impedance_tracking.hpp"

namespace torsio {

constexpr auto kImpedance = "impedance";

[[nodiscard]] inline bool has_tube(const DataSheet& sheet) {
  return sheet.family == ActuatorFamily::harmonic_drive;
}

[[nodiscard]] double impedance_amplitude_Nm(const DataSheet& sheet, const ImpedanceSpec& spec);

/// The plan of a run, checked as `track_impedance` describes, apart from a bandwidth of the correction that nothing
/// uses. @throws UsageError
[[nodiscard]] ImpedancePlan checked_plan(const DataSheet& sheet, const ImpedanceSpec& spec,
                                         const std::optional<ImpedanceModel>& model,
                                         const LinearInverse& line);

/// @throws UsageError if a bandwidth of the correction is given and no estimate corrects.
void require_used_correction(const ImpedanceSpec& spec, bool has_estimator);

}  // namespace torsio

#pragma once

#include <string>
#include <string_view>

#include "torsio/actuator/data_sheet.hpp"
#include "torsio/core/progress.hpp"

namespace torsio {

/// A data sheet as YAML: every number of `describe` with unit and origin; docs/simulation/actuators.md has the
/// format. `parse_data_sheet` of it gives the same sheet, bit for bit.
[[nodiscard]] std::string data_sheet_yaml(const DataSheet& sheet);

/// Reads a data sheet that `data_sheet_yaml` wrote or a person did. Every value must be there; the
/// torque curve of a spring may be a table.
///
///     name: my-joint
///     title: a joint with a measured spring
///     family: series-elastic
///     variant: maxwell-slip
///     values:
///       rated_torque: {value: 50, unit: Nm, origin: P}
///       ...
///     torque_curve: {columns: [deflection_deg, torque_Nm], origin: P, points: [[-6, -70], ...]}
///
/// @throws UsageError naming file, line, what was expected and found, if a value is missing, is not
/// a number, has a wrong unit or sign, a key is not known, the torque curve does not increase, or
/// no plant or sensors can be built from the sheet; Cancelled.
[[nodiscard]] DataSheet read_data_sheet(const std::string& path, const Progress& progress = {});
/// The same from a text. @param file for messages
[[nodiscard]] DataSheet parse_data_sheet(std::string_view text, const std::string& file);

/// Whether an actuator is named by its file, FILE.yaml or FILE.yml.
[[nodiscard]] bool is_sheet_file(std::string_view actuator) noexcept;
/// The sheet of an actuator: a file, or a name as `data_sheet` takes it.
/// @throws UsageError as `read_data_sheet` and `data_sheet`; Cancelled.
[[nodiscard]] DataSheet find_data_sheet(const std::string& actuator, const Progress& progress = {});

}  // namespace torsio

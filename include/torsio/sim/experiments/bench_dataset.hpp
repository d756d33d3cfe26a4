#pragma once

#include <cstdint>
#include <string_view>

#include "torsio/actuator/data_sheet.hpp"
#include "torsio/core/progress.hpp"
#include "torsio/data/dataset.hpp"

namespace torsio {

/// The recordings of paper 001 for fitting a spring (specification 4.7): training sweeps with the
/// mass at different places on the lever (three; the paper prints no number), and a test sweep with
/// another place and an inclined plane of motion. Seeds are `seed`, `seed + 1`, ...
/// @throws UsageError for an unknown actuator; Cancelled if `progress` asks to stop.
[[nodiscard]] Dataset sweep_dataset(std::string_view actuator, std::uint64_t seed,
                                    const Progress& progress = {});
/// The same with a data sheet.
[[nodiscard]] Dataset sweep_dataset(const DataSheet& sheet, std::uint64_t seed,
                                    const Progress& progress = {});

}  // namespace torsio

#pragma once

#include <cstdint>
#include <string_view>

#include "torsio/core/progress.hpp"
#include "torsio/data/dataset.hpp"

namespace torsio {

/// What paper 001 records before it fits a spring (specification 4.7): sweeps with the mass at
/// different places on the lever to learn from (three; the paper prints no number), and one with
/// another place and an inclined plane of motion to be judged on. Seeds are `seed`, `seed + 1`, ...
/// @throws UsageError for an unknown actuator; Cancelled if `progress` asks to stop.
[[nodiscard]] Dataset sweep_dataset(std::string_view actuator, std::uint64_t seed,
                                    const Progress& progress = {});

}  // namespace torsio

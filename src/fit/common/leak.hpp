#pragma once

#include <string>

#include "torsio/data/dataset.hpp"
#include "torsio/signal/feature_pipeline.hpp"

namespace torsio {

/// Whether target = slope * input + offset over all fresh samples, within the digits of both and 1e-9, at most 1e-6, of
/// the target's variance: no sensor is that accurate.
[[nodiscard]] bool is_straight_line(const Dataset& dataset, const std::string& input);

/// What a user can do about `find_leak`.
[[nodiscard]] std::string leak_advice(const Dataset& dataset, const FeatureSpec& spec,
                                      const std::string& leak);

}  // namespace torsio

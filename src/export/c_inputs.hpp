#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "signal/pipeline_listing.hpp"
#include "torsio/estimate/estimator_settings.hpp"
#include "torsio/export/c99.hpp"

namespace torsio {

/// A raw input of the exported program: a real number in SI, or the counts of an encoder.
struct CInput {
  std::string channel;
  std::optional<double> unit;  ///< SI per count; none: a real number
  bool has_zero = false;       ///< `NAME_set_zero` is needed
  [[nodiscard]] bool is_counted() const noexcept { return unit.has_value(); }
};

/// Counts are kept times this: an interpolated sample lies between two counts.
inline constexpr double kCountParts = 256.0;

/// @throws UsageError for counts of another channel, given twice, or of a channel that is no angle in rad.
[[nodiscard]] std::vector<CInput> c_inputs(const std::vector<std::string>& raw_inputs,
                                           const EstimatorSettings& settings,
                                           const C99Options& options);

}  // namespace torsio

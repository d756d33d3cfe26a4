#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
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

/// The angles that a joint measures, in the order of `JointSample`.
inline constexpr std::array<std::string_view, 3> kSampleAngles{"motor_angle_rad", "gear_angle_rad",
                                                               "joint_angle_rad"};

/// Counts are kept times this: an interpolated sample lies between two counts.
inline constexpr double kCountParts = 256.0;

/// A sum of counts, each a C expression with its weight in SI, and an offset in SI.
/// @returns the sum as a C expression of the type int64_t, and what 1 of it is in SI
[[nodiscard]] std::pair<std::string, double> whole_sum(
    const std::vector<std::pair<std::string, double>>& weighted, double offset = 0.0);

/// @throws UsageError for counts of another channel, given twice, or of a channel that is not an angle in rad.
[[nodiscard]] std::vector<CInput> c_inputs(const std::vector<std::string>& raw_inputs,
                                           const EstimatorSettings& settings,
                                           const C99Options& options);

}  // namespace torsio

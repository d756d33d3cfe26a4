#pragma once

#include <cmath>
#include <string>
#include <string_view>

#include "torsio/core/error.hpp"
#include "torsio/model/sampled_time.hpp"

namespace torsio {

/// @throws Error naming the family and the field.
inline void require_parameter(bool holds, std::string_view family, const char* field,
                              const char* expected, double found) {
  if (!holds)
    throw Error({.place = std::string(family) + ": " + field,
                 .expected = expected,
                 .found = std::to_string(found)});
}

inline void check_sampled_time(const SampledTime& time, std::string_view family) {
  constexpr std::size_t kMostSubsteps = 1000;
  require_parameter(std::isfinite(time.sample_period_s) && time.sample_period_s > 0.0, family,
                    "sample_period_s", "a positive number", time.sample_period_s);
  require_parameter(time.substeps >= 1 && time.substeps <= kMostSubsteps, family, "substeps",
                    "1 to 1000", static_cast<double>(time.substeps));
}

/// @throws Error unless 0, where a run starts, lies between finite ends.
inline void check_end_stops(double lowest, double highest, std::string_view family) {
  require_parameter(std::isfinite(lowest) && lowest < 0.0, family, "lowest", "a negative number",
                    lowest);
  require_parameter(std::isfinite(highest) && highest > 0.0, family, "highest", "a positive number",
                    highest);
}

}  // namespace torsio

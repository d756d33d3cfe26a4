#pragma once

#include <cmath>
#include <numeric>
#include <span>
#include <string>
#include <string_view>

#include "core/checks.hpp"
#include "model/second_order/sampled_time.hpp"

namespace torsio {

/// The force that the inputs make together.
inline double driving_force(std::span<const double> gains,
                            std::span<const double> inputs) noexcept {
  return std::inner_product(gains.begin(), gains.end(), inputs.begin(), 0.0);
}

inline void check_sampled_time(const SampledTime& time, std::string_view family) {
  constexpr std::size_t kMaxSubsteps = 1000;
  require(std::isfinite(time.sample_period_s) && time.sample_period_s > 0.0,
          {family, "sample_period_s"}, "a positive number", time.sample_period_s);
  require(time.substeps >= 1 && time.substeps <= kMaxSubsteps, {family, "substeps"}, "1 to 1000",
          static_cast<double>(time.substeps));
}

inline void check_gains(std::span<const double> gains, std::string_view family) {
  require(!gains.empty(), {family, "gains"}, "one per input", 0.0);
  for (const double gain : gains)
    require(std::isfinite(gain), {family, "gains"}, "finite numbers", gain);
  require(gains.front() != 0.0, {family, "gains"}, "a first input that drives", 0.0);
}

/// @throws Error unless 0, where a run starts, lies between finite ends.
inline void check_end_stops(double lowest, double highest, std::string_view family) {
  require(std::isfinite(lowest) && lowest < 0.0, {family, "lowest"}, "a negative number", lowest);
  require(std::isfinite(highest) && highest > 0.0, {family, "highest"}, "a positive number",
          highest);
}

}  // namespace torsio

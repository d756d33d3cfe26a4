#pragma once

#include <optional>
#include <span>

namespace torsio {

/// A motion that a loop keeps up by itself.
struct LimitCycle {
  double frequency_Hz = 0.0;
  double amplitude = 0.0;  ///< in the unit of the error
};

/// Looks for one in a tracking error: from 3 Hz to a little below a quarter of the sample rate (of a
/// faster one the samples miss the crests), ten half waves on end, each at least `least_amplitude`
/// high, of equal length and height (each within a third of the one before), that do not decay and
/// that the reference does not have. The highest there is; none if there is none. Ours.
/// @throws Error if error and reference are not of one length.
[[nodiscard]] std::optional<LimitCycle> find_limit_cycle(std::span<const double> error,
                                                         std::span<const double> reference,
                                                         double least_amplitude,
                                                         double sample_rate_Hz);

}  // namespace torsio

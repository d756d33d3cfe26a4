#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "torsio/actuator/data_sheet.hpp"
#include "torsio/data/recording.hpp"
#include "torsio/signal/excitation.hpp"
#include "torsio/sim/closed_loop/tracking.hpp"
#include "torsio/sim/closed_loop/tracking_score.hpp"

namespace torsio {

/// Looks for one in a tracking error: from 3 Hz to a little below a quarter of the sample rate (of
/// a faster one the samples miss the crests), ten half waves on end, each at least
/// `least_amplitude` high, of equal length and height (each within a third of the one before), that
/// do not decay and that the reference does not have. The highest there is; none if there is none.
/// Ours.
/// @throws Error if error and reference are not of one length.
[[nodiscard]] std::optional<LimitCycle> find_limit_cycle(std::span<const double> error,
                                                         std::span<const double> reference,
                                                         double least_amplitude,
                                                         double sample_rate_Hz);

/// The score of a recording from `track`. @throws Error if it is not longer than the part that is
/// not scored.
[[nodiscard]] TrackingScore tracking_score(const Recording& record, double amplitude_Nm,
                                           bool has_steps);

/// The frequency [Hz] where the response to a sweep has fallen to -3 dB of what was wanted. Its
/// first harmonic, in windows of a third of an octave.
/// @returns 0 if it is below from the first window on, infinity if it never falls so far: the
/// bandwidth lies below or above what the sweep covers
[[nodiscard]] double bandwidth(std::span<const double> torque_Nm, const LogSweep::Parameters& sweep,
                               double sample_rate_Hz);

/// All of it, tick by tick.
/// @param seed of a random walk
/// @throws UsageError if a value is out of range, or the torque anywhere beyond the actuator's
/// rating.
[[nodiscard]] std::vector<double> reference_torque(const TorqueReference& reference,
                                                   const DataSheet& sheet, std::uint64_t seed);

}  // namespace torsio

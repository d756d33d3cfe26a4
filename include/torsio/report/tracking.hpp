#pragma once

#include <span>
#include <string>

#include "torsio/sim/closed_loop/impedance_tracking.hpp"
#include "torsio/sim/closed_loop/tracking.hpp"

namespace torsio {

/// The task, and a table of the models, each with its mean over the seeds.
[[nodiscard]] std::string tracking_text(std::span<const TrackingRow> rows);

/// A JSON object with every row; ends with a line feed.
[[nodiscard]] std::string tracking_json(std::span<const TrackingRow> rows);

/// The task with its gains, a table of wanted and rendered impedance over the frequency, and the
/// forces of the hand.
[[nodiscard]] std::string impedance_text(const ImpedanceRun& run);
/// Each run, and if there are several a table that compares them: |rendered - wanted| over |wanted|
/// is averaged over the frequencies up to 1 Hz.
[[nodiscard]] std::string impedance_text(std::span<const ImpedanceRun> runs);

/// The same as a JSON object; ends with a line feed.
[[nodiscard]] std::string impedance_json(const ImpedanceRun& run);
/// One run as above, several as the array `runs`.
[[nodiscard]] std::string impedance_json(std::span<const ImpedanceRun> runs);

}  // namespace torsio

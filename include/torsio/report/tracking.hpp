#pragma once

#include <span>
#include <string>

#include "torsio/sim/closed_loop/tracking.hpp"

namespace torsio {

/// The task, and a table of the models, each with its mean over the seeds.
[[nodiscard]] std::string tracking_text(std::span<const TrackingRow> rows);

/// A JSON object with every row; ends with a line feed.
[[nodiscard]] std::string tracking_json(std::span<const TrackingRow> rows);

}  // namespace torsio

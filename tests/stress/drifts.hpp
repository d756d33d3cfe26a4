#pragma once

#include "stress/stress.hpp"

namespace torsio::stress {

/// Monitored joints of which a sensor drifts, slowly or fast. While the monitor watches, the combined torque may differ from
/// the one of the same recording without the drift by more than five error bars for 50 ms at most; in one of twenty
/// drifts for longer, since the other sources do not resolve a slow drift of the most precise one.
Outcome drifting_sensors(const Settings& settings);

}  // namespace torsio::stress

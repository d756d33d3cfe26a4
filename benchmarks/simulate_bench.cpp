#include <cmath>

#include "rows.hpp"
#include "torsio/sim/experiment.hpp"
#include "torsio/sim/plant.hpp"

namespace torsio::bench {

// The whole of what `torsio simulate` does before it writes: plant, sensors, position loop.
Row simulate_dfki_120() {
  double steps = 0.0;
  const double seconds = best_seconds([&] {
    const Recording recording = simulate({.actuator = "dfki-120"});
    steps = std::round(static_cast<double>(recording.size()) /
                       (recording.sample_rate_Hz() * Plant::kDefaultStep_s));
  });
  return {.value = steps / seconds, .unit = "steps/s"};
}

}  // namespace torsio::bench

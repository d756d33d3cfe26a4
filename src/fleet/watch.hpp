#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "fleet/calibration.hpp"
#include "torsio/core/estimate.hpp"
#include "torsio/core/progress.hpp"
#include "torsio/evaluate/drift.hpp"
#include "torsio/store/registry.hpp"

namespace torsio {

/// One joint of a fleet in the order of its drift.
struct WatchedJoint {
  std::string serial;
  std::string type = {};
  std::optional<std::int64_t> model = {};  ///< that is current; none: it has none
  std::optional<DriftEntry> last = {};     ///< none: it was never compared
  /// Largest change over the smallest that counts: from 1 on the joint has changed, if the interval allows it.
  double severity = kNotMeasured;
  std::string worst = {};                 ///< which change that is, "stiffness -8.1 %"
  std::string advice = {};                ///< what the last comparison advises
  std::size_t comparisons = 0;            ///< in the history
  double severity_before = kNotMeasured;  ///< severity in the comparison before
};

/// Compares the recordings of a joint with its current model (`detect_drift`), and adds the result to the history.
/// @param request the list's mapping, rate and target
/// @throws Error if the joint has no current model, or as `load_dataset` and `detect_drift`.
void watch_joint(Registry& registry, const FleetJoint& joint, const CalibrationRequest& request,
                 const Progress& progress = {});

/// `watch_joint` for each joint of a list, which are entered in its order.
/// @param threads joints that are compared at the same time, on which the result does not depend; 0: one for each
/// core that the process may use
/// @returns those that could not be compared, with the reason
[[nodiscard]] std::vector<std::string> watch_joints(Registry& registry,
                                                    const CalibrationRequest& request,
                                                    std::size_t threads = 0,
                                                    const Progress& progress = {});

/// All joints of the registry, the largest drift first; those never compared last.
[[nodiscard]] std::vector<WatchedJoint> rank_by_drift(Registry& registry);

}  // namespace torsio

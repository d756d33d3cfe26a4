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
  std::string failure = {};               ///< why the recordings of today could not be compared
};

/// Compares the recordings of a joint with its current model (`detect_drift`), and adds the result to the history.
/// @param request the list's mapping, rate and target
/// @throws Error if the joint has no current model, or as `load_dataset` and `detect_drift`.
void watch_joint(Registry& registry, const FleetJoint& joint, const CalibrationRequest& request,
                 const Progress& progress = {});

/// `watch_joint` for each joint of a list. @returns those that could not be compared, with the reason
[[nodiscard]] std::vector<std::string> watch_joints(Registry& registry,
                                                    const CalibrationRequest& request,
                                                    const Progress& progress = {});

/// All joints of the registry, the largest drift first; those never compared last.
[[nodiscard]] std::vector<WatchedJoint> rank_by_drift(Registry& registry);

struct RegisteredFleet {
  std::size_t models = 0;
  std::size_t promoted = 0;
  std::vector<std::string> refused =
      {};  ///< joints whose model was not made current, with the reason
};

/// Adds the joints of a calibration to the registry, with their recordings and models. Repeated, it adds nothing.
/// @param promotes also makes the models current of joints that do not differ from the others of their type
[[nodiscard]] RegisteredFleet register_fleet(Registry& registry, StudyStore& store,
                                             const FleetCalibration& fleet,
                                             const CalibrationRequest& request, bool promotes,
                                             const std::string& by);

}  // namespace torsio

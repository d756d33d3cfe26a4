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
  std::optional<DriftEntry> last = {};     ///< with the current model; none: it was never compared
  /// Certain part of the largest change, also of the zero, over the smallest that counts.
  double severity = kNotMeasured;
  std::string worst = {};                 ///< which change that is, "stiffness -8.1 %"
  std::string advice = {};                ///< what the last comparison advises
  double error_ratio = kNotMeasured;      ///< RMSE over that of the calibration
  std::size_t comparisons = 0;            ///< with the current model
  std::size_t earlier_comparisons = 0;    ///< with models that were current before
  double severity_before = kNotMeasured;  ///< in the comparison with the same model before
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

/// All joints of the registry: first those that have changed or whose advice is to do something at the joint, then
/// those that cannot be determined, those that have not changed, and those whose current model was never compared;
/// among these the largest severity first, then the largest error.
[[nodiscard]] std::vector<WatchedJoint> rank_by_drift(Registry& registry);

}  // namespace torsio

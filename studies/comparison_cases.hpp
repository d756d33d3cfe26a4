#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "torsio/core/progress.hpp"
#include "torsio/data/dataset.hpp"

namespace torsio {

/// What all models of one actuator, or of one real drive, learn from and are judged on.
struct ComparisonCase {
  Dataset dataset = {};
  std::vector<std::string> inputs = {};  ///< empty: the usual ones (`resolve_inputs`)
  std::string schedule = {};             ///< an input that families which can are scheduled over
  /// TestCase recording and the condition that it is a row of; none: all together are one, called as the
  /// case.
  std::vector<std::pair<std::string, std::string>> conditions = {};
};

struct ComparisonPlan {
  std::string name;   ///< "dfki-50:lugre, sweeps"
  std::string plant;  ///< simulated actuator; empty: a real one
  std::function<ComparisonCase(std::uint64_t seed, const Progress& progress)> make;
};

/// Every simulated actuator in all variants. What is judged is of another kind than what is learned from:
/// another lever in another plane, another reference, another amplitude.
/// @param is_quick two short ones
[[nodiscard]] std::vector<ComparisonPlan> simulated_plans(bool is_quick);

/// The real recordings with a torque: leaf spring of a prosthetic ankle, printed cycloidal drives.
/// `make` throws Error where they are not at hand.
[[nodiscard]] std::vector<ComparisonPlan> recorded_plans();

}  // namespace torsio

#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "torsio/core/progress.hpp"
#include "torsio/data/dataset.hpp"

namespace torsio {

/// Training and test data of one actuator, or of one real drive.
struct ComparisonCase {
  Dataset dataset = {};
  std::vector<std::string> inputs = {};  ///< empty: the defaults (`resolve_inputs`)
  std::string schedule = {};             ///< scheduling input, for the families that have one
  /// Test recordings and the conditions of their rows; empty: all together are one condition with
  /// the name of the case.
  std::vector<std::pair<std::string, std::string>> conditions = {};
};

struct ComparisonPlan {
  std::string name;   ///< "dfki-50:lugre, sweeps"
  std::string plant;  ///< simulated actuator; empty: a real one
  std::function<ComparisonCase(std::uint64_t seed, const Progress& progress)> make;
};

/// Every simulated actuator in all variants. Test runs differ from training runs:
/// another lever in another plane, another reference, another amplitude.
/// @param is_quick two short ones
[[nodiscard]] std::vector<ComparisonPlan> simulated_plans(bool is_quick);

/// The real recordings with a torque: leaf spring of a prosthetic ankle, printed cycloidal drives.
/// `make` throws Error where they are not at hand.
[[nodiscard]] std::vector<ComparisonPlan> recorded_plans();

}  // namespace torsio

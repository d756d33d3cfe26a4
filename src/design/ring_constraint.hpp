#pragma once

#include <string>
#include <vector>

#include "torsio/design/rubber_spring.hpp"
#include "torsio/signal/feature_pipeline.hpp"

namespace torsio {

/// A constraint of the user's on a ring, `length <= 0.6 * outer_radius`: two expressions
/// (docs/use/expressions.md) of outer_radius, inner_radius, wall, length [m], volume [m³], stress [Pa],
/// strain and stiffness [Nm/rad].
class RingConstraint {
 public:
  /// @throws UsageError if it is not two expressions of these names with <= or >= between them.
  explicit RingConstraint(const std::string& text);

  [[nodiscard]] const std::string& text() const noexcept { return text_; }
  /// The side that has to be larger less the other one, in SI; below 0 it is violated. NaN counts as
  /// violated.
  [[nodiscard]] double slack(const RubberRing& ring, const RubberSpringDemand& demand);

 private:
  std::string text_;
  FeaturePipeline difference_;
  std::vector<double> values_;  ///< values of the names in the expression
};

}  // namespace torsio

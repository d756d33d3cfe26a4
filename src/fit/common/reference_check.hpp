#pragma once

#include <span>
#include <string>

namespace torsio {

/// Measured torques beside the estimates of a model for the same samples, in the order of time.
struct ReferencePairs {
  std::span<const double> estimated;
  std::span<const double> measured;
};

/// Refuses a reference that cannot be that of the model's quantity, however much the joint has changed:
///
/// - it varies by less than a tenth of what the model's output varies;
/// - it does not change while the model's output goes through a quarter of its range;
/// - it falls where the model's output rises (correlation below -0.5);
/// - its size differs by a factor of 100 or more (correlation of at least 0.5).
///
/// @param place recording or channel in the message.
/// @throws Error
void require_plausible_reference(const std::string& place, const ReferencePairs& pairs);

}  // namespace torsio

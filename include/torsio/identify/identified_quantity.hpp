#pragma once

#include <string>
#include <vector>

#include "torsio/core/estimate.hpp"

namespace torsio {

/// A number that a motion determines, or why it does not.
struct IdentifiedQuantity {
  double value = kNotMeasured;
  double standard_error = kNotMeasured;
  bool is_determined = false;
  std::string reason = {};  ///< why it is not determined
};

/// What was found at one joint besides the masses.
struct IdentifiedJoint {
  std::string name = {};
  IdentifiedQuantity dry_Nm = {};           ///< dry friction of the bearing
  IdentifiedQuantity viscous_Nms_rad = {};  ///< viscous friction of the bearing
  double residual_Nm = 0.0;                 ///< RMS of the residual, means over a window
};

/// The data on which an identification rests.
struct IdentificationData {
  double duration_s = 0.0;
  double window_s = 0.0;
  double block_s = 0.0;  ///< length of a block of the jackknife
  std::size_t windows = 0;
  std::size_t blocks = 0;
};

}  // namespace torsio

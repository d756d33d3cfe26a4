#pragma once

#include <limits>

#include "torsio/core/fault.hpp"

namespace torsio {

/// A value that was not measured: it becomes a fault where it is used, never a guess.
inline constexpr double kNotMeasured = std::numeric_limits<double>::quiet_NaN();

/// The output of a model or an estimator at one tick. `value` is finite in every case.
struct Estimate {
  double value = 0.0;  ///< in the target's unit
  double std_dev =
      kNotMeasured;  ///< one standard deviation, same unit; NaN where there is no evidence, never 0
  double novelty = kNotMeasured;  ///< larger: less like the training data; NaN if unknown
  Fault fault = Fault::none;
};

}  // namespace torsio

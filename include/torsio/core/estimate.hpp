#pragma once

#include "torsio/core/fault.hpp"
#include "torsio/core/not_measured.hpp"

namespace torsio {

/// The output of a model or an estimator at one tick. `value` is finite in every case.
struct Estimate {
  double value = 0.0;  ///< in the target's unit
  double std_dev =
      kNotMeasured;  ///< one standard deviation, same unit; NaN where there is no evidence, never 0
  double novelty = kNotMeasured;  ///< larger: less like the training data; NaN if unknown
  Fault fault = Fault::none;
};

}  // namespace torsio

#pragma once

#include <string>

#include "torsio/core/not_measured.hpp"

namespace torsio {

/// A fitted number with a physical meaning: a stiffness, a time constant.
struct FittedParameter {
  std::string name;    ///< "k1"
  std::string unit;    ///< "Nm/rad"; empty for a number without
  double value = 0.0;  ///< in that unit
  double std_error =
      kNotMeasured;  ///< from the curvature of the error at the optimum; NaN if unknown
};

}  // namespace torsio

#pragma once

#include <string>
#include <vector>

#include "torsio/core/not_measured.hpp"

namespace torsio {

/// A number that a fit chose and that means something to people: a stiffness, a time constant.
struct FittedParameter {
  std::string name;    ///< "k1"
  std::string unit;    ///< "Nm/rad"; empty for a number without
  double value = 0.0;  ///< in that unit
  double std_error =
      kNotMeasured;  ///< from the curvature of the error at the optimum; NaN if untold
};

/// What a fitter returns: the parameters, and what the user should be told about them ("input
/// support_m is constant in the training data: no term").
template <class Family>
struct Fitted {
  typename Family::Parameters parameters;
  std::vector<std::string> notes;
  std::vector<FittedParameter> table = {};  ///< of families whose numbers have a meaning
  /// On training data that the fit held out to choose by; NaN of families that do not.
  double held_out_rmse = kNotMeasured;
};

}  // namespace torsio

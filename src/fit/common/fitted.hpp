#pragma once

#include <string>
#include <vector>

#include "torsio/core/not_measured.hpp"
#include "torsio/fit/common/fitted.hpp"

namespace torsio {

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

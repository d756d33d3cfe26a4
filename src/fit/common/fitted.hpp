#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "torsio/core/estimate.hpp"
#include "torsio/fit/common/family_info.hpp"

namespace torsio {

/// What a fitter returns: the parameters, and messages for the user ("input support_m is constant
/// in the training data: no term").
template <class Family>
struct Fitted {
  typename Family::Parameters parameters;
  std::vector<std::string> notes;
  std::vector<FittedParameter> table = {};  ///< for families with interpretable parameters
  /// RMSE on training data that the fit held out for its choices; NaN for families that hold out
  /// none.
  double held_out_rmse = kNotMeasured;
  /// Recordings that were held out for it one after the other; 0: parts of recordings were.
  std::size_t held_out_records = 0;
  bool has_held_out_fifths =
      false;                   ///< contiguous fifths of the only recording, one after the other
  double stroke_growth = 0.0;  ///< `StrokeGuard::growth`; 0: not known
};

}  // namespace torsio

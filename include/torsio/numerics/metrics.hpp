#pragma once

#include <cstddef>

#include "torsio/core/estimate.hpp"

namespace torsio {

/// The error of a model, e = value - target; all but `fit_percent` in the target's unit. NaN where
/// there are no samples to compute it from. There is no "MAE": the papers use it for two different
/// things. Source: specification 3.10.
struct Metrics {
  std::size_t samples = 0;            ///< that were scored
  double rmse = kNotMeasured;         ///< sqrt(mean e^2)
  double mad = kNotMeasured;          ///< mean |e|
  double std_abs = kNotMeasured;      ///< standard deviation of |e| about `mad` (divided by n)
  double max_abs = kNotMeasured;      ///< largest |e|
  double fit_percent = kNotMeasured;  ///< 100 (1 - |e| / |y - mean y|) in the 2-norm (BF)
};

}  // namespace torsio

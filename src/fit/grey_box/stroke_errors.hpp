#pragma once

#include "fit/grey_box/grey_box_candidate.hpp"
#include "torsio/fit/common/training_data.hpp"

namespace torsio {

/// How well a grey box predicts strokes of other durations than those that it is fitted to.
struct StrokeErrors {
  double rmse =
      0.0;  ///< over all groups, each predicted from the others; 0: the strokes last equally long
  double growth =
      0.0;  ///< `StrokeGuard::growth`: what the longest strokes show beyond `reference`; 0: nothing
};

/// @param parameters the fitted box, without a schedule; @param choice that it was fitted for
/// @param reference error on held-out data of the same motion, target's unit
[[nodiscard]] StrokeErrors stroke_errors(const TrainingData& data,
                                         const GreyBox::Parameters& parameters,
                                         const GreyBoxChoice& choice, double reference);

}  // namespace torsio

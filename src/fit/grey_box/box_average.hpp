#pragma once

#include <cstddef>
#include <optional>

#include "fit/grey_box/grey_box_search.hpp"
#include "torsio/fit/common/training_data.hpp"

namespace torsio {

struct BoxAverage {
  GreyBox::Parameters parameters;
  double held_out_rmse = 0.0;
  std::size_t boxes = 0;  ///< that it is the average of
};

/// The average of those boxes, one step of any sequence away from the chosen one, that predict held-out data nearly as well:
/// which of them the search has chosen is chance, and their errors in other motions differ.
///
/// coefficients = Σ w_k c_k / Σ w_k over the knots, thresholds and time constants of all of them, w_k = e_k^-64, with e_k the
/// error of box k on the longest strokes of the training, predicted from the shorter ones; w_k = 1 where the strokes last
/// equally long. No box bends, slips, relaxes or is signed where the chosen one does not: a linear spring remains one.
/// @param rate_share as the search was given it
/// @returns nothing for a schedule, or if no other box is nearly as good.
[[nodiscard]] std::optional<BoxAverage> box_average(const GreyBoxSearch& search,
                                                    const GreyBoxSearch::Candidate& chosen,
                                                    const TrainingData& data, double rate_share);

}  // namespace torsio

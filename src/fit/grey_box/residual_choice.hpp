#pragma once

#include <optional>
#include <string>

#include "fit/grey_box/fit_grey_box.hpp"
#include "model/grey_box/grey_box.hpp"
#include "torsio/fit/common/fit_context.hpp"
#include "torsio/fit/common/training_data.hpp"

namespace torsio {

/// A model of what the terms of a box leave over.
struct ChosenResidual {
  std::optional<GreyBoxResidual> residual;
  double rmse_share = 1.0;  ///< error on what was held out, with it over without it
  std::string note;
};

/// Fits the residual of `options`, with the slips of the box as further inputs. `auto`: products of the inputs and a sparse
/// Gaussian process are fitted to all recordings but some and scored on these, three times (of one recording: all but
/// a contiguous fifth), and a network on every fifth of 50 blocks. One of the former is taken if it lowers the mean square
/// error in each trial, and in all of them by more than the standard error over the parts of what was held out, and
/// by 4 %, the process before products; else the network, if it does. Deterministic for a seed, whatever the number of
/// threads.
[[nodiscard]] ChosenResidual chosen_residual(const TrainingData& data,
                                             const GreyBox::Parameters& box,
                                             const GreyBoxOptions& options,
                                             const FitContext& context);

}  // namespace torsio

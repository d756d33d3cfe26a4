#pragma once

#include <cstddef>

#include "fit/mixture/online_mixture.hpp"
#include "model/mixture/dgmm.hpp"
#include "torsio/core/not_measured.hpp"
#include "torsio/core/progress.hpp"
#include "torsio/fit/common/fitted.hpp"
#include "torsio/fit/common/training_data.hpp"

namespace torsio {

struct DgmmOptions {
  /// NaN as `initial_spread` (the default here): chosen from the training records; as
  /// `novelty_distance`: 5/3 of the initial spread, as 0.25 to 0.15 in specification 3.1.
  OnlineMixtureSettings online = {.novelty_distance = kNotMeasured, .initial_spread = kNotMeasured};
  std::size_t em_iterations = 10;   ///< refinement after the online pass; 0: none
  double clamp = 2.0;               ///< LinearClamp::width in RMSE of the linear model; 0: none
  double background_weight = 1e-3;  ///< of the one Gaussian over all data; 0: none
  std::size_t threads = 0;          ///< for search and refinement; 0: as many as the machine has
};

/// Learns the joint density of target and inputs from the usable samples in the order of recording
/// (`OnlineMixture`), refines it by expectation maximisation if asked to, and adds the guards: a
/// background component, which makes the answer far from all data a linear regression, and the
/// clamp to the linear model without rates (decision 0004), whose threshold of density is the first percentile over the training
/// samples.
///
/// How far components must reach to bridge the gaps between recorded conditions the training
/// records tell themselves: unless given, the initial spread is the one of a short list that does
/// best when one record at a time is left out (a single record: every fifth of 50 blocks). The
/// notes state choice and scores.
///
/// Source: specification 3.1. Deterministic; independent of the number of threads.
/// @throws Error if no sample is usable, one lies a million times the spread of its channel away
/// (naming record, channel and sample), or an option is out of range; Cancelled if `progress` asks.
[[nodiscard]] Fitted<Dgmm> fit_dgmm(const TrainingData& data, const DgmmOptions& options = {},
                                    const Progress& progress = {});

struct PaperDgmmOptions {
  std::size_t components = 500;
  double learning_rate = 0.02;
  double spread = 0.15;  ///< of every component in every direction, standardised
};

/// Algorithm 1 of paper 000 as printed, only with the sign of the mean's update mended, for
/// comparison: the first samples become the components, their covariances stay spread^2 I, and
/// each later sample moves the nearest mean. No guards. Expect it to be worse than a straight line:
/// at 1 kHz all components are born within the first half second, and a covariance without
/// correlation makes the regression a kernel average (specification 3.1).
[[nodiscard]] Fitted<Dgmm> fit_dgmm_paper(const TrainingData& data,
                                          const PaperDgmmOptions& options = {},
                                          const Progress& progress = {});

}  // namespace torsio

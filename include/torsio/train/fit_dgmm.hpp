#pragma once

#include <cstddef>

#include "torsio/core/progress.hpp"
#include "torsio/model/dgmm.hpp"
#include "torsio/train/fitted.hpp"
#include "torsio/train/online_mixture.hpp"
#include "torsio/train/training_data.hpp"

namespace torsio {

struct DgmmOptions {
  OnlineMixtureSettings online = {};
  std::size_t em_iterations = 10;   ///< refinement after the online pass; 0: none
  double clamp = 2.0;               ///< LinearClamp::width in RMSE of the linear model; 0: none
  double background_weight = 1e-3;  ///< of the one Gaussian over all data; 0: none
  std::size_t threads = 0;          ///< for the refinement only; 0: as many as the machine has
};

/// Learns the joint density of target and inputs from the usable samples in the order of recording
/// (`OnlineMixture`), refines it by expectation maximisation if asked to, and adds the guards: a
/// background component, which makes the answer far from all data a linear regression, and the
/// clamp to the linear model, whose threshold of density is the first percentile over the training
/// samples.
///
/// Source: SPEC 3.1. Deterministic; independent of the number of threads.
/// @throws Error if no sample is usable or an option is out of range; Cancelled if `progress` asks.
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
/// correlation makes the regression a kernel average (SPEC 3.1).
[[nodiscard]] Fitted<Dgmm> fit_dgmm_paper(const TrainingData& data,
                                          const PaperDgmmOptions& options = {},
                                          const Progress& progress = {});

}  // namespace torsio

#pragma once

#include <cstddef>

#include "fit/common/fitted.hpp"
#include "fit/mixture/online_mixture.hpp"
#include "model/mixture/dgmm.hpp"
#include "torsio/core/estimate.hpp"
#include "torsio/core/progress.hpp"
#include "torsio/fit/common/family_info.hpp"
#include "torsio/fit/common/training_data.hpp"

namespace torsio {

struct DgmmOptions {
  /// NaN as `initial_spread` (the default here): chosen from the training records; as
  /// `novelty_distance`: 5/3 of the initial spread, as 0.25 to 0.15 in specification 3.1.
  OnlineMixtureSettings online = {.novelty_distance = kNotMeasured, .initial_spread = kNotMeasured};
  std::size_t em_iterations = 10;   ///< refinement after the online pass; 0: none
  double clamp = 2.0;               ///< LinearClamp::width in RMSE of the linear model; 0: none
  double background_weight = 1e-3;  ///< weight of the one Gaussian over all data; 0: none
  std::size_t threads = 0;          ///< for search and refinement; 0: as many as the machine has

  template <class Self, class Visit>
  static void visit_options(Self& self, const Visit& visit) {
    visit_online(self.online, visit);
    visit(self.em_iterations,
          {.name = "em_iterations",
           .maximum = 10000,
           .help = "of expectation maximisation after the online pass; 0: none"});
    visit(
        self.clamp,
        {.name = "clamp",
         .maximum = 1e6,
         .help = "where data are sparse, limit to this many RMSE around the linear model; 0: off"});
    visit(self.background_weight, {.name = "background_weight",
                                   .maximum = 0.999,
                                   .help = "of one Gaussian over all data; 0: none"});
  }

 private:
  template <class Online, class Visit>
  static void visit_online(Online& self, const Visit& visit) {
    visit(self.components, {.name = "components",
                            .minimum = 1,
                            .maximum = 100000,
                            .help = "at most this many Gaussians"});
    visit(self.novelty_distance,
          {.name = "novelty_distance",
           .maximum = 100,
           .help = "in standard deviations: a sample farther from all Gaussians becomes a new one; "
                   "auto: 5/3 of the initial spread"});
    visit(self.initial_spread,
          {.name = "initial_spread",
           .minimum = 1e-6,
           .maximum = 100,
           .help = "standard deviation of a Gaussian that has seen one sample, in standard "
                   "deviations; auto: found by leaving one training record out at a time"});
    visit(self.learning_rate_floor, {.name = "learning_rate_floor",
                                     .maximum = 1,
                                     .help = "0: means settle; above: they keep following"});
    visit(self.forgetting,
          {.name = "forgetting", .maximum = 1, .help = "of a Gaussian's past with each sample"});
    visit(self.prune_count,
          {.name = "prune_count", .maximum = 1e12, .help = "drop Gaussians of fewer samples ..."});
    visit(self.prune_age,
          {.name = "prune_age", .maximum = 1e12, .help = "... once so many samples old; 0: never"});
  }
};

/// Fits the joint density of target and inputs to the usable samples in the order of recording
/// (`OnlineMixture`), refines it by expectation maximisation if requested, and adds the guards: a
/// background component, which makes the output far from all data a linear regression, and the
/// clamp to the linear model without rates (decision 0004), whose threshold of density is the first
/// percentile over the training samples.
///
/// The spread that components need to bridge the gaps between recorded conditions is estimated from
/// the training records: unless given, the initial spread is the one of a short list with the least
/// error when one record at a time is left out (a single record: every fifth of 50 blocks). The
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
  double spread = 0.15;  ///< standardised, for every component and direction

  template <class Self, class Visit>
  static void visit_options(Self& self, const Visit& visit) {
    visit(self.components,
          {.name = "components", .minimum = 1, .maximum = 100000, .help = "Gaussians"});
    visit(self.learning_rate,
          {.name = "learning_rate", .maximum = 1, .help = "of the nearest Gaussian's mean"});
    visit(self.spread, {.name = "spread",
                        .minimum = 1e-6,
                        .maximum = 100,
                        .help = "of every Gaussian in every direction, in standard deviations"});
  }
};

/// Algorithm 1 of paper 000 with the sign of the mean's update corrected, for comparison: the first
/// samples become the components, their covariances stay spread^2 I, and each later sample moves the
/// nearest mean. Not in the algorithm: quantities are standardised, and a weight is the component's
/// share of the samples; none of the numbers in `PaperDgmmOptions` is printed. No guards. It is
/// expected to be worse than the linear model: at 1 kHz all components are created within the first
/// half second, and a covariance without correlation makes the regression a kernel average
/// (specification 3.1).
[[nodiscard]] Fitted<Dgmm> fit_dgmm_paper(const TrainingData& data,
                                          const PaperDgmmOptions& options = {},
                                          const Progress& progress = {});

}  // namespace torsio

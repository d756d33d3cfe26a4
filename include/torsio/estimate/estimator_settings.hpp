#pragma once

#include <cstddef>
#include <limits>
#include <string>
#include <vector>

#include "torsio/core/provenance.hpp"
#include "torsio/signal/feature_pipeline.hpp"

namespace torsio {

/// Means no limit in the ranges of inputs: beyond every quantity, and a range of this size on
/// either side has a width that double can represent.
inline constexpr double kOpenRange = 1e300;

/// The range of each feature in the training data.
struct FeatureRanges {
  std::vector<double> lowest;
  std::vector<double> highest;
  double margin = 0.05;  ///< transition from model to fallback outside the range, as a share of it

  template <class Self, class Visit>
  static void visit_fields(Self& self, Visit&& visit) {
    visit("lowest", self.lowest);
    visit("highest", self.highest);
    visit("margin", self.margin);
  }
};

/// value = intercept + sum_j slope_j * feature_j, used where the model's value must not be used.
/// Fitted ones have slope 0 on rates.
struct LinearFallback {
  double intercept = 0.0;
  std::vector<double> slope;
  double residual_std =
      std::numeric_limits<double>::quiet_NaN();  ///< training residuals, target's unit

  template <class Self, class Visit>
  static void visit_fields(Self& self, Visit&& visit) {
    visit("intercept", self.intercept);
    visit("slope", self.slope);
    visit("residual_std", self.residual_std);
  }
};

/// Spread of the model's residuals by region of its own output, for families without an error
/// bar of their own. `std_dev[i]` holds for values in [edges[i], edges[i+1]); outside, the
/// nearest region's. Empty: no evidence.
struct ResidualTable {
  std::vector<double> edges;    ///< ascending, one more than regions
  std::vector<double> std_dev;  ///< target's unit

  template <class Self, class Visit>
  static void visit_fields(Self& self, Visit&& visit) {
    visit("edges", self.edges);
    visit("std_dev", self.std_dev);
  }
};

/// What an estimator uses to detect a jump of an input and to recover from unusable inputs.
struct DisturbanceGuards {
  /// Per raw input: largest change from one sample to the next in training, at least
  /// `kSmallestStepShare` of its range there. Empty: not determined; a jump within the ranges is then
  /// not detected, and every excursion beyond them counts as one.
  std::vector<double> largest_step = {};
  /// Largest change of the first feature from one sample to the next in training. NaN: not
  /// determined; while inputs are missing it may then be anywhere within its range.
  double largest_travel = std::numeric_limits<double>::quiet_NaN();
  /// Time after a reset until a model whose memory is not declared (`ModelMemory`) agrees with one
  /// that was not reset. NaN: no such time was found.
  double warm_up_s = kAssumedWarmUpSeconds;

  static constexpr double kSmallestStepShare = 0.025;
  /// The warm-up of models that were not fitted here (imported ones, files of older releases).
  static constexpr double kAssumedWarmUpSeconds = 10.0;

  template <class Self, class Visit>
  static void visit_fields(Self& self, Visit&& visit) {
    visit("largest_step", self.largest_step);
    visit("largest_travel", self.largest_travel);
    visit("warm_up_s", self.warm_up_s);
  }
};

/// Limits of the model's output from the training and the held-out data.
struct OutputGuards {
  /// Largest |target| in training: beyond `kLargestOutput` times that, a value is not used. NaN: not
  /// determined, no limit.
  double largest_target = std::numeric_limits<double>::quiet_NaN();
  /// The model's own error bar, of a family that has one, is multiplied by this; at least 1.
  double error_bar_factor = 1.0;

  static constexpr double kLargestOutput = 3.0;

  template <class Self, class Visit>
  static void visit_fields(Self& self, Visit&& visit) {
    visit("largest_target", self.largest_target);
    visit("error_bar_factor", self.error_bar_factor);
  }
};

/// How the error of a model grows in strokes of the first input that last longer than those of the training: a
/// slow motion shows what relaxes or creeps with time.
///
///     std_dev^2 += min(growth n, limit)^2,   n = (r - 1)^2 / r,   r = t / longest_s > 1
///
/// t is the duration of this stroke or of the one before it, whichever is longer. The model describes how the
/// target depends on ln t within the training, so that what is left begins with the square of ln r, which n is
/// near 1. n is the novelty.
struct StrokeGuard {
  double longest_s =
      0.0;  ///< almost all training samples (99 %) are in strokes that are not longer
  double dead_band =
      0.0;  ///< turning back by less than this is part of the stroke [first input's unit]
  double growth = 0.0;  ///< target's unit; 0: not known, and nothing is added
  double limit = 0.0;   ///< standard deviation of the target in training

  template <class Self, class Visit>
  static void visit_fields(Self& self, Visit&& visit) {
    visit("longest_s", self.longest_s);
    visit("dead_band", self.dead_band);
    visit("growth", self.growth);
    visit("limit", self.limit);
  }
};

/// Everything around the model: the path from raw channels to features, and the guards. Plain data,
/// stored in the model file.
struct EstimatorSettings {
  FeatureSpec features;
  double sample_rate_Hz = 0.0;
  std::string target;                        ///< channel name with unit: "torque_Nm"
  std::vector<std::string> zeroed_channels;  ///< raw inputs whose zero was taken from each record:
                                             ///< `set_zero` at run time
  FeatureRanges ranges;
  DisturbanceGuards disturbances = {};
  OutputGuards output = {};
  StrokeGuard strokes = {};
  LinearFallback fallback;
  ResidualTable residuals;
  /// What the sensor from which the target was learned adds to every error bar, as a term of its own:
  /// std_dev^2 += u(value)^2.
  SensorUncertainty target_uncertainty = {};
};

}  // namespace torsio

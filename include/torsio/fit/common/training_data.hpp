#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "torsio/core/estimate.hpp"
#include "torsio/core/matrix.hpp"
#include "torsio/data/dataset.hpp"
#include "torsio/signal/feature_pipeline.hpp"

namespace torsio {

/// Name and rate property of one input of a model.
struct InputInfo {
  std::string expression;
  bool is_rate = false;  ///< FeaturePipeline::is_rate
};

/// One record after the feature pipeline: contiguous in time, so that families with memory can run
/// through it.
struct Sequence {
  std::string recording;
  Matrix features = {};             ///< samples x inputs
  std::vector<double> target = {};  ///< NaN where not measured
  /// Standard error of each value of a target that was computed; empty: it was measured.
  std::vector<double> target_error = {};
  /// 1: usable for training (role, settled filters, fresh and finite target, finite features)
  std::vector<std::uint8_t> use = {};

  /// False where a feature is not finite (a division, a power): models skip this sample.
  [[nodiscard]] bool has_features(std::size_t sample) const;
};

/// A sample that is not used because one channel has an absurd value there.
struct LeftOut {
  std::string file;  ///< where the recording was read from; empty: made in memory
  std::string recording;
  std::size_t sample = 0;
  double time_s = 0.0;
  std::string channel;
  double value = 0.0;  ///< in SI

  /// "sweep.csv, sample 1200 (t = 1.2 s): gear_angle_rad = 1e+12"
  [[nodiscard]] std::string text() const;
};

/// The data for every fitter.
struct TrainingData {
  std::vector<InputInfo> inputs = {};
  std::string target;
  double sample_rate_Hz = 0.0;
  std::vector<Sequence> sequences = {};
  std::vector<LeftOut> left_out = {};
  /// Per raw input of the pipeline, see `DisturbanceGuards::largest_step`.
  std::vector<double> largest_step = {};
  double largest_travel = kNotMeasured;  ///< see `DisturbanceGuards::largest_travel`

  [[nodiscard]] std::size_t input_count() const noexcept { return inputs.size(); }
  [[nodiscard]] std::size_t usable_samples() const noexcept;
};

/// Runs each record of the dataset that has segments of `role` through the pipeline. A few absurd
/// values (at most 10, at most 0.01 % of a channel's samples, far outside the rest; the rule is at
/// `outlier_limits`) are taken as not measured: the raw input keeps its last value, the target is
/// NaN, and the sample is not used. Each is in `left_out`.
/// @throws Error if a raw input is missing or not finite (naming record, channel, sample), or
/// nothing usable remains. A feature that is not finite only spoils its own sample.
[[nodiscard]] TrainingData training_data(const Dataset& dataset, const FeatureSpec& spec,
                                         Role role = Role::train);

}  // namespace torsio

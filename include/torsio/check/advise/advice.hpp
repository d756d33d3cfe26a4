#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "torsio/core/estimate.hpp"
#include "torsio/core/progress.hpp"
#include "torsio/data/dataset.hpp"
#include "torsio/signal/feature_pipeline.hpp"

namespace torsio {

/// A range that the model is wanted for.
struct WantedRange {
  /// "input" (the first input), "frequency" (of the motion), "speed" (of the first input, only
  /// `highest` is used), or a condition of the recordings
  std::string quantity;
  double lowest = 0.0;  ///< in SI
  double highest = 0.0;
};

/// Reads "input=-3deg:3deg", "frequency=0.05Hz:2Hz", "speed=1rad/s", "temperature_degC=-10:40".
/// @throws UsageError for an unknown quantity or a range that is empty.
[[nodiscard]] WantedRange parse_wanted(const std::string& text, const Dataset& dataset,
                                       const FeatureSpec& spec);

/// A motion: strokes of one amplitude and frequency about one centre, in SI.
struct TriangleMotion {
  double amplitude = 0.0;
  double centre = 0.0;
  double frequency_Hz = 0.0;

  [[nodiscard]] double speed() const noexcept { return 4.0 * amplitude * frequency_Hz; }
};

/// Strokes of similar motion (a factor of 2 in amplitude and of 3 in frequency) and their errors.
struct Region {
  TriangleMotion motion;  ///< its middle
  std::size_t strokes = 0;
  double duration_s = 0.0;
  double sample_share = 0.0;            ///< share of the usable samples in regions
  double error_share = 0.0;             ///< share of the squared held-out error
  double held_out_rmse = kNotMeasured;  ///< NaN for fewer than two strokes
  bool is_wanted = true;
};

/// A recording to make.
struct Proposal {
  std::string recording;                 ///< "triangles of +-0.05 rad at 0.1 Hz, 60 s"
  std::string reason;                    ///< the figures
  std::optional<TriangleMotion> motion;  ///< none: that of the recordings
  double duration_s = kNotMeasured;
  std::string condition = {};  ///< name of the condition that is new
  double condition_value = kNotMeasured;
  /// Share by which the RMSE over the intended use is expected to fall; NaN: cannot be determined
  /// from these recordings.
  double expected_reduction = kNotMeasured;
  /// The same with assumptions where it cannot be determined: the order of the proposals.
  double assumed_reduction = 0.0;
};

/// Held-out error of a model that is trained on a share of every kind of motion.
struct LearningPoint {
  double share = 1.0;
  double effective_samples = 0.0;  ///< independent samples with the same information
  double rmse = 0.0;
};

/// What to record next, so that the error of a model falls most over its intended use.
struct Advice {
  std::string input;  ///< first input
  std::string target;
  double lowest = 0.0;  ///< intended use: of the first input
  double highest = 0.0;
  double lowest_Hz = 0.0;
  double highest_Hz = 0.0;
  double highest_speed = 0.0;
  double wanted_rmse = kNotMeasured;  ///< expected over the intended use, before any new recording
  std::vector<Region> regions;        ///< with strokes, largest share of the error first
  std::vector<LearningPoint> learning_curve;
  /// Expected share by which the RMSE falls if every recording is made once more.
  double same_again_reduction = kNotMeasured;
  double target_noise = kNotMeasured;  ///< standard deviation, from neighbouring new samples
  /// Squared error on a recording that was left out over that with part of every recording in the
  /// training.
  double between_recordings = kNotMeasured;
  std::vector<Proposal> proposals;        ///< the most useful first
  std::vector<std::string> limits;        ///< what limits the error besides the amount of data
  std::vector<std::string> undetermined;  ///< what the recordings do not determine, with the reason
};

/// Divides the training recordings into strokes of the first input (from one reversal to the next)
/// and these into regions of amplitude, frequency and centre. A quick model, linear in its
/// parameters, is fitted hundreds of times: without a fifth of each region (held-out error),
/// without those beyond some amplitude, frequency, centre or condition (how fast the error rises
/// with the distance from what was trained), with half of a region and with half of all (learning).
/// From these follow the expected squared error in each region of the intended use and what a
/// recording there would change; docs/use/advise.md has the equations.
///
/// The intended use is `wanted`; by default the range of the recordings, and within it the
/// amplitudes down to a quarter and the frequencies that are missing.
/// @throws Error as `training_data`; UsageError for a wanted quantity that does not exist;
/// Cancelled.
[[nodiscard]] Advice advise(const Dataset& dataset, const FeatureSpec& spec,
                            const std::vector<WantedRange>& wanted, const Progress& progress = {});

}  // namespace torsio

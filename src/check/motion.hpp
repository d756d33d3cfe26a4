#pragma once

#include <string>
#include <vector>

#include "torsio/data/dataset.hpp"
#include "torsio/signal/feature_pipeline.hpp"

namespace torsio {

/// How the first input x of a model moves, over the samples of one role of a recording. The rate is
/// taken over 0.1 s, which leaves out noise and the steps of an encoder.
struct Motion {
  double amplitude = 0.0;     ///< half the range that contains 98 % of the samples, in x's unit
  double rms_speed = 0.0;     ///< in x's unit per second
  double frequency_Hz = 0.0;  ///< rms_speed / (2 pi standard deviation of x): a sine's frequency
  double rest_share = 0.0;    ///< share of the samples slower than 5 % of `rms_speed`
};

/// All 0 if the role has no samples or nothing moves.
[[nodiscard]] Motion motion_of(const DatasetRecord& record, Role role, const FeatureSpec& spec);

/// Motions of one kind: amplitude, speed and frequency differ by at most a factor of
/// `kMotionRatio`, shares of rest by at most `kRestDifference`.
inline constexpr double kMotionRatio = 2.5;
inline constexpr double kRestDifference = 0.3;

/// A held-out recording that no training recording resembles, and the one that is nearest.
struct OtherMotion {
  std::string recording;
  std::string nearest;
  Motion held_out;
  Motion trained;  ///< motion of `nearest`

  /// "0.2 times the amplitude, 3.1 times the speed": the quantities that differ.
  [[nodiscard]] std::string text() const;
};

/// The recordings with the role validation or test whose motion is of another kind than that of
/// every training recording. Scores on them show what a model does with a motion that it was not
/// trained on, and error bars taken from training recordings may be too small there.
[[nodiscard]] std::vector<OtherMotion> other_motions(const Dataset& dataset,
                                                     const FeatureSpec& spec);

}  // namespace torsio

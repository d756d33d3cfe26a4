#pragma once

#include <array>
#include <compare>
#include <cstddef>
#include <cstdint>
#include <map>
#include <vector>

#include "check/advise/quick_model.hpp"
#include "check/advise/strokes.hpp"
#include "torsio/check/advise/advice.hpp"
#include "torsio/core/progress.hpp"
#include "torsio/fit/common/training_data.hpp"

namespace torsio {

/// Strokes of similar amplitude, frequency and centre.
struct RegionKey {
  int amplitude = 0;  ///< 0: from the half range down to half of it, 1: down to a quarter, ...
  int frequency = 0;  ///< a factor of 3 each
  int centre = 0;     ///< -1, 0, 1: below, about and above the middle of the range
  auto operator<=>(const RegionKey&) const = default;  // NOLINT(modernize-use-nullptr): clang 14
};

inline constexpr int kSmallestAmplitude = 4;

/// From strokes to regions. The half range of the first input is the unit of amplitudes.
struct RegionGrid {
  double middle = 0.0;
  double half_range = 1.0;

  /// True for a stroke that is too small to be a motion.
  [[nodiscard]] bool is_rest(const Stroke& stroke) const;
  [[nodiscard]] double smallest_amplitude() const;
  [[nodiscard]] RegionKey key_of(const Stroke& stroke) const;
  [[nodiscard]] int amplitude_level(double amplitude) const;
  [[nodiscard]] static int frequency_level(double frequency_Hz);
  [[nodiscard]] static double lowest_frequency_Hz(int level);
  [[nodiscard]] TriangleMotion motion(const RegionKey& key) const;
};

/// Consecutive strokes of one region in one recording.
struct Block {
  std::size_t recording = 0;  ///< index of the sequence
  bool is_motion = true;      ///< false: rest
  RegionKey region;
  std::size_t strokes = 0;
  BlockSums sums;
};

/// Squared errors with and without some of the training data, on the same blocks.
struct ErrorRatio {
  double ratio = 1.0;       ///< without over with
  bool is_clear = false;    ///< the mean difference is above twice its standard error
  std::size_t strokes = 0;  ///< tested; 0: not determined
};

/// How fast the squared error rises with the distance from the regions that were trained.
struct Growth {
  bool is_known = false;
  double per_step = 0.0;    ///< ln of the ratio of squared errors, at least 0
  ErrorRatio largest = {};  ///< the experiment with the most strokes
  RegionKey at = {};        ///< one of its regions
};

/// Errors of a quick model over the blocks of a dataset.
class RegionErrors {
 public:
  RegionErrors(const QuickModel& model, std::vector<Block> blocks, Progress progress);

  struct Errors {
    double square_sum = 0.0;
    std::size_t samples = 0;
    std::size_t strokes = 0;
    std::size_t blocks = 0;
    [[nodiscard]] double mean_square() const;
  };
  [[nodiscard]] const std::map<RegionKey, Errors>& held_out() const noexcept { return held_out_; }
  [[nodiscard]] const std::map<RegionKey, Errors>& held_out_linear() const noexcept {
    return held_out_linear_;
  }
  [[nodiscard]] Errors all_held_out() const;

  enum class Direction : std::uint8_t { larger, smaller, faster, slower, off_centre };
  [[nodiscard]] Growth growth(Direction direction) const;

  /// Squared error with all of a region's strokes times n over the strokes, from half of them: the
  /// b of E(n) = a + b / n at the present n; 0 unless the difference is clear.
  [[nodiscard]] double decrease(const RegionKey& region) const;

  [[nodiscard]] std::vector<LearningPoint> learning_curve() const;
  /// b of E(n) = a + b / n over all blocks, as a share of E; NaN if there are too few blocks.
  [[nodiscard]] double decrease_of_all() const;

  /// A recording that is left out against parts of all, on regions that others have too.
  [[nodiscard]] ErrorRatio between_recordings() const;
  /// Recordings that are left out together, against `held_out`.
  [[nodiscard]] ErrorRatio without_recordings(const std::vector<std::uint8_t>& is_left_out) const;

  /// Slope of the target over the first input by its half range.
  [[nodiscard]] double linear_slope() const;

 private:
  static constexpr std::size_t kFolds = 5;
  using Mask = std::vector<std::uint8_t>;  ///< by block

  [[nodiscard]] QuickModel::Coefficients fit(const Mask& trained, bool is_linear) const;
  [[nodiscard]] ErrorRatio compare(const Mask& tested, const std::vector<double>& without) const;
  /// Squared errors on `tested` of a model trained on `trained`.
  [[nodiscard]] std::vector<double> errors(const Mask& trained, const Mask& tested,
                                           bool is_linear) const;
  [[nodiscard]] std::vector<double> fold_errors(bool is_linear) const;
  [[nodiscard]] std::map<RegionKey, Errors> by_region(const std::vector<double>& errors) const;
  [[nodiscard]] std::size_t strokes_of(const Mask& mask) const;
  /// Squared errors when one block in `parts` of every region is trained, on the others.
  [[nodiscard]] std::vector<double> errors_of_share(std::size_t parts) const;

  const QuickModel& model_;
  std::vector<Block> blocks_;
  Progress progress_;
  std::vector<std::size_t> rank_;  ///< number of a block among those of its region
  std::vector<double> with_;       ///< held-out squared error of each block
  std::map<RegionKey, Errors> held_out_;
  std::map<RegionKey, Errors> held_out_linear_;
  mutable double done_ = 0.0;
};

}  // namespace torsio

#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "studies/board_sets.hpp"
#include "studies/comparison_cases.hpp"
#include "torsio/core/progress.hpp"

namespace torsio {

/// The scored samples of one test recording.
struct BoardTarget {
  std::string recording;
  std::vector<std::size_t> samples;
  std::vector<double> values;
};

struct BoardScore {
  double error = kNotMeasured;  ///< `BoardSet::measure`, in the set's unit
  std::size_t samples = 0;
  std::size_t without = 0;  ///< without a prediction (NaN), because filters had not settled
};

/// The folder of the recordings; empty if there is none.
[[nodiscard]] std::string board_folder();

/// Why the sets of a source cannot be run here, and where its files belong; empty: they can.
/// @throws Error if a file has another content than expected.
[[nodiscard]] std::string why_left_out(const BoardSource& source, const std::string& folder);

/// Training and test recordings of a set with the inputs of its models.
/// @throws Error as `why_left_out`, or with its text if files are missing.
[[nodiscard]] ComparisonCase board_case(const BoardSet& set, const Progress& progress = {});

[[nodiscard]] std::vector<BoardTarget> board_targets(const BoardSet& set, const Dataset& dataset);

/// @param predictions by target, one value for each of its samples
[[nodiscard]] BoardScore board_score(const BoardSet& set, std::span<const BoardTarget> targets,
                                     std::span<const std::vector<double>> predictions);

/// Which samples a file of a set holds.
enum class BoardPart : std::uint8_t { test, training };

/// The samples of a set as CSV: set, recording, sample, t_s, whether the sample is scored (or trained on), the channels,
/// and the target where it may be used.
[[nodiscard]] std::string board_samples(const BoardSet& set, const Dataset& dataset,
                                        BoardPart part);

}  // namespace torsio

#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "studies/board_data.hpp"
#include "studies/board_sets.hpp"

namespace torsio {

/// A line of a file of predictions.
struct PredictedSample {
  std::size_t line = 0;
  std::string recording;
  std::optional<std::size_t> sample;  ///< empty: by time
  double t_s = kNotMeasured;
  double value = kNotMeasured;
};

/// A file of predictions: the columns set, recording, sample or t_s or both, and prediction_UNIT in any order, others ignored.
struct PredictionFile {
  std::string file;
  const BoardSet* set = nullptr;
  std::vector<PredictedSample> samples;
};

/// @param name of the file, for messages
/// @throws Error naming line and column if a column is missing or there twice, the unit is another one, a field is not a number, or the
/// lines are of several sets; UsageError for a set that does not exist.
[[nodiscard]] PredictionFile parse_predictions(std::string_view text, const std::string& name);
/// The same from a file, plain or gzipped.
[[nodiscard]] PredictionFile read_predictions(const std::string& path);

/// The predictions of the scored samples, by target; those of other samples are ignored.
/// @throws Error naming the line if a recording does not exist, a time is between two samples or not that of the sample, a scored sample occurs twice
/// or its prediction is not finite; or that counts the scored samples without a prediction.
[[nodiscard]] std::vector<std::vector<double>> matched_predictions(
    const PredictionFile& file, const Dataset& dataset, std::span<const BoardTarget> targets);

}  // namespace torsio

#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "torsio/data/recording.hpp"

namespace torsio {

/// Some channels of a recording as rows, the raw inputs of a pipeline or an estimator in each tick.
class RecordingRows {
 public:
  /// @param recording must outlive this, unchanged
  /// @throws Error as `Recording::channel` if one of the channels is missing.
  RecordingRows(const Recording& recording, std::span<const std::string> channels);
  RecordingRows(RecordingRows&&) noexcept = default;
  RecordingRows(const RecordingRows&) = delete;  // would read what `replace` gave to the other
  RecordingRows& operator=(RecordingRows&&) = delete;
  RecordingRows& operator=(const RecordingRows&) = delete;
  ~RecordingRows() = default;

  [[nodiscard]] std::span<const Channel* const> channels() const noexcept { return channels_; }
  /// Takes a channel's values from `values` instead, of which there must be as many.
  void replace(std::size_t channel, std::vector<double> values);

  /// The values of one sample, in the order of the channels, until the next call. Does not allocate.
  [[nodiscard]] std::span<const double> at(std::size_t sample) noexcept {
    for (std::size_t k = 0; k < row_.size(); ++k) row_[k] = values_[k][sample];
    return row_;
  }

 private:
  std::vector<const Channel*> channels_;
  std::vector<const double*> values_;
  std::vector<std::vector<double>> replaced_;
  std::vector<double> row_;
};

}  // namespace torsio

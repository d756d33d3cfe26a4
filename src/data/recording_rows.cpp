#include "data/recording_rows.hpp"

#include <utility>

namespace torsio {

RecordingRows::RecordingRows(const Recording& recording, std::span<const std::string> channels)
    : row_(channels.size()) {
  for (const std::string& name : channels) {
    channels_.push_back(&recording.channel(name));
    values_.push_back(channels_.back()->values.data());
  }
}

void RecordingRows::replace(std::size_t channel, std::vector<double> values) {
  replaced_.push_back(std::move(values));  // the values of the others stay where they are
  values_[channel] = replaced_.back().data();
}

}  // namespace torsio

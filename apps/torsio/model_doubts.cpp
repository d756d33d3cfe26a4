#include "model_doubts.hpp"

#include <algorithm>

#include "output.hpp"
#include "torsio/train/check.hpp"

void warn_of_seen_recordings(const torsio::ModelFile& file, const torsio::Dataset& dataset) {
  const auto& trained = file.card.training_files;
  for (const torsio::DatasetRecord& record : dataset.records) {
    const torsio::Recording& recording = record.recording;
    const bool is_known = std::ranges::any_of(trained, [&](const torsio::Source& source) {
      return !source.sha256.empty() && source.sha256 == recording.source.sha256;
    });
    if (is_known)
      remark("warning: the model was trained on " + recording.name() +
             "; its score is no held-out one");
  }
}

void warn_of_missing_zeros(const torsio::ModelFile& file, const torsio::Dataset& dataset) {
  for (const torsio::DatasetRecord& record : dataset.records) {
    const torsio::Recording& recording = record.recording;
    for (const std::string& channel : file.settings.zeroed_channels) {
      const bool is_zeroed = std::ranges::any_of(
          recording.zeros, [&](const torsio::ZeroRule& zero) { return zero.channel == channel; });
      if (!is_zeroed)
        remark("warning: the model expects " + channel + " with its zero taken, but " +
               recording.name() + " has it as measured: use the mapping that it was trained with");
    }
  }
}

void warn_of_another_unit(const torsio::ModelFile& file, const torsio::Dataset& dataset) {
  for (const torsio::DatasetRecord& record : dataset.records) {
    const std::string mistake = torsio::unit_doubt(record.recording, file.settings);
    if (!mistake.empty())
      remark("warning: " + file.settings.target + " of " + record.recording.name() + " over " +
             file.settings.features.inputs.front() +
             " differs from the training data by the factor between " + mistake +
             ": look at the units of the recording");
  }
}

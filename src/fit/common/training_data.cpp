#include "torsio/fit/common/training_data.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "fit/common/finite_input.hpp"
#include "torsio/core/error.hpp"
#include "torsio/estimate/estimator_settings.hpp"

namespace torsio {
namespace {

std::vector<std::uint8_t> role_mask(const DatasetRecord& record, Role role) {
  std::vector<std::uint8_t> mask(record.recording.size(), 0);
  for (const Segment& segment : record.segments)
    if (segment.role == role)
      std::fill(mask.begin() + static_cast<std::ptrdiff_t>(segment.begin),
                mask.begin() + static_cast<std::ptrdiff_t>(segment.end), std::uint8_t{1});
  return mask;
}

std::vector<const std::vector<double>*> raw_channels(const Recording& recording,
                                                     const FeaturePipeline& pipeline) {
  std::vector<const std::vector<double>*> channels;
  for (const std::string& input : pipeline.raw_inputs())
    channels.push_back(&finite_input(recording, input));
  return channels;
}

Sequence run(const DatasetRecord& record, FeaturePipeline& pipeline, const std::string& target,
             Role role) {
  const Recording& recording = record.recording;
  const std::vector<const std::vector<double>*> channels = raw_channels(recording, pipeline);
  const Channel& measured = recording.channel(target);
  Sequence sequence{.recording = recording.name(),
                    .features = Matrix(recording.size(), pipeline.feature_count()),
                    .target = measured.values,
                    .use = role_mask(record, role)};
  std::vector<double> raw(channels.size());
  pipeline.reset();
  for (std::size_t n = 0; n < recording.size(); ++n) {
    std::ranges::transform(channels, raw.begin(),
                           [n](const auto* channel) { return (*channel)[n]; });
    std::ranges::copy(pipeline.step(raw), sequence.features.row(n).begin());
    if (!pipeline.is_settled() || !measured.is_fresh(n) || !std::isfinite(measured.values[n]) ||
        !sequence.has_features(n))
      sequence.use[n] = 0;
  }
  return sequence;
}

/// The part of the records that has `role`; see `DisturbanceGuards::largest_step`.
double largest_step(const Dataset& dataset, const std::string& channel, Role role) {
  double largest = 0.0;
  double lowest = std::numeric_limits<double>::infinity();
  double highest = -lowest;
  for (const DatasetRecord& record : dataset.records) {
    if (!record.has_role(role)) continue;
    const std::vector<double>& values = record.recording.channel(channel).values;
    for (const Segment& segment : record.segments) {
      if (segment.role != role) continue;
      for (std::size_t n = segment.begin; n < segment.end; ++n) {
        lowest = std::min(lowest, values[n]);
        highest = std::max(highest, values[n]);
        if (n > segment.begin) largest = std::max(largest, std::abs(values[n] - values[n - 1]));
      }
    }
  }
  return std::max(largest, DisturbanceGuards::kSmallestStepShare * (highest - lowest));
}

/// The largest change of the first feature from one sample to the next within `role`.
double largest_travel(const DatasetRecord& record, const Sequence& sequence, Role role) {
  double largest = 0.0;
  for (const Segment& segment : record.segments)
    for (std::size_t n = segment.begin + 1; segment.role == role && n < segment.end; ++n) {
      const double travel = std::abs(sequence.features(n, 0) - sequence.features(n - 1, 0));
      if (std::isfinite(travel)) largest = std::max(largest, travel);
    }
  return largest;
}

/// Features that are not finite may be the reason why no usable sample is left.
void refuse_if_not_finite(const TrainingData& data) {
  for (const Sequence& sequence : data.sequences) {
    const auto& values = sequence.features.values;
    const auto bad =
        std::ranges::find_if(values, [](double value) { return !std::isfinite(value); });
    if (bad == values.end()) continue;
    const auto index = static_cast<std::size_t>(bad - values.begin());
    throw Error({.place = sequence.recording + ": input " +
                          data.inputs[index % data.input_count()].expression + ", sample " +
                          std::to_string(index / data.input_count()),
                 .problem = "no sample is left to learn from",
                 .expected = "a finite value",
                 .found = std::to_string(*bad),
                 .advice = "Change the expression so that it stays finite."});
  }
}

}  // namespace

bool Sequence::has_features(std::size_t sample) const {
  return std::ranges::all_of(features.row(sample),
                             [](double value) { return std::isfinite(value); });
}

TrainingData training_data(const Dataset& dataset, const FeatureSpec& spec, Role role) {
  FeaturePipeline pipeline(spec, dataset.sample_rate_Hz());
  TrainingData data;
  data.target = dataset.target;
  data.sample_rate_Hz = dataset.sample_rate_Hz();
  for (std::size_t j = 0; j < pipeline.feature_count(); ++j)
    data.inputs.push_back({spec.inputs[j], pipeline.is_rate(j)});
  for (const DatasetRecord& record : dataset.records) {
    if (!record.has_role(role)) continue;
    data.sequences.push_back(run(record, pipeline, dataset.target, role));
    data.largest_travel =
        std::fmax(data.largest_travel, largest_travel(record, data.sequences.back(), role));
  }
  for (const std::string& channel : pipeline.raw_inputs())
    data.largest_step.push_back(largest_step(dataset, channel, role));
  if (data.usable_samples() == 0) {
    refuse_if_not_finite(data);
    std::size_t samples = 0;
    for (const Sequence& sequence : data.sequences) samples += sequence.target.size();
    throw Error({.problem = "nothing to use with role " + std::string(name(role)),
                 .expected = "samples with a measured " + dataset.target +
                             " after the filters have settled (" +
                             std::to_string(pipeline.settling_samples()) + " samples)",
                 .found = std::to_string(data.sequences.size()) + " record(s) of that role with " +
                          std::to_string(samples) + " samples in all"});
  }
  return data;
}

}  // namespace torsio

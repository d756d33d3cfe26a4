#include "torsio/fit/common/training_data.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <map>
#include <tuple>
#include <utility>

#include "data/recording_rows.hpp"
#include "fit/common/finite_input.hpp"
#include "fit/common/outliers.hpp"
#include "fit/common/passes.hpp"
#include "numerics/parallel.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/estimate.hpp"
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

std::size_t new_samples(const Channel& channel) {
  if (channel.fresh.empty()) return channel.values.size();
  return static_cast<std::size_t>(
      std::ranges::count_if(channel.fresh, [](std::uint8_t mark) { return mark != 0; }));
}

/// Limits of the channel over all samples of the role.
OutlierLimits limits_of(const Dataset& dataset, const std::string& channel, Role role) {
  std::vector<double> values;
  std::size_t samples = 0;
  for (const DatasetRecord& record : dataset.records)
    if (record.has_role(role)) samples += new_samples(record.recording.channel(channel));
  values.reserve(samples);
  for (const DatasetRecord& record : dataset.records) {
    if (!record.has_role(role)) continue;
    const Channel& measured = record.recording.channel(channel);
    for (const Segment& segment : record.segments)
      for (std::size_t n = segment.begin; segment.role == role && n < segment.end; ++n)
        if (measured.is_fresh(n) && std::isfinite(measured.values[n]))
          values.push_back(measured.values[n]);
  }
  return outlier_limits(values);
}

using ChannelLimits = std::map<std::string, OutlierLimits>;

ChannelLimits channel_limits(const Dataset& dataset, const FeaturePipeline& pipeline, Role role) {
  ChannelLimits limits{{dataset.target, limits_of(dataset, dataset.target, role)}};
  for (const std::string& input : pipeline.raw_inputs())
    limits.try_emplace(input, limits_of(dataset, input, role));
  return limits;
}

void note_left_out(std::vector<LeftOut>& left_out, const Recording& recording, std::size_t sample,
                   const std::string& channel, double value) {
  left_out.push_back({.file = recording.source.file,
                      .recording = recording.name(),
                      .sample = sample,
                      .time_s = recording.time_s(sample),
                      .channel = channel,
                      .value = value});
}

/// Takes the last value before them instead of the outliers of a raw input, whose samples are not
/// used.
void replace_outliers(RecordingRows& rows, std::size_t input, const Recording& recording,
                      const OutlierLimits& limits, std::vector<std::uint8_t>& use,
                      std::vector<LeftOut>& left_out) {
  const Channel& channel = *rows.channels()[input];
  const auto is_sound = [&](double value) { return limits.contain(value); };
  if (std::ranges::all_of(channel.values, is_sound)) return;
  std::vector<double> values = channel.values;
  const auto first = std::ranges::find_if(values, is_sound);
  double last = first == values.end() ? 0.0 : *first;
  for (std::size_t n = 0; n < values.size(); ++n) {
    if (is_sound(values[n])) {
      last = values[n];
      continue;
    }
    if (use[n] != 0) note_left_out(left_out, recording, n, channel.name, values[n]);
    values[n] = last;
    use[n] = 0;
  }
  rows.replace(input, std::move(values));
}

Sequence run(const Dataset& dataset, const DatasetRecord& record, FeaturePipeline& pipeline,
             Role role, const ChannelLimits& limits, std::vector<LeftOut>& left_out) {
  const auto& [target, target_error] = std::tie(dataset.target, dataset.target_error);
  const Recording& recording = record.recording;
  const Channel& measured = recording.channel(target);
  Sequence sequence{.recording = recording.name(),
                    .features = Matrix(recording.size(), pipeline.feature_count()),
                    .target = measured.values,
                    .use = role_mask(record, role)};
  if (!target_error.empty()) sequence.target_error = recording.channel(target_error).values;
  for (std::size_t n = 0; n < recording.size(); ++n) {
    if (limits.at(target).contain(measured.values[n])) continue;
    if (sequence.use[n] != 0 && measured.is_fresh(n))
      note_left_out(left_out, recording, n, target, measured.values[n]);
    sequence.target[n] = kNotMeasured;
  }
  RecordingRows rows(recording, pipeline.raw_inputs());
  for (std::size_t k = 0; k < rows.channels().size(); ++k) {
    const std::string& input = pipeline.raw_inputs()[k];
    (void)finite_input(recording, input);
    replace_outliers(rows, k, recording, limits.at(input), sequence.use, left_out);
  }
  pipeline.reset();
  for (std::size_t n = 0; n < recording.size(); ++n) {
    std::ranges::copy(pipeline.step(rows.at(n)), sequence.features.row(n).begin());
    if (!pipeline.is_settled() || !measured.is_fresh(n) || !std::isfinite(sequence.target[n]) ||
        !sequence.has_features(n))
      sequence.use[n] = 0;
  }
  return sequence;
}

/// The part of the records that has `role`; see `DisturbanceGuards::largest_step`.
double largest_step(const Dataset& dataset, const std::string& channel, Role role,
                    const OutlierLimits& limits) {
  double largest = 0.0;
  double lowest = std::numeric_limits<double>::infinity();
  double highest = -lowest;
  for (const DatasetRecord& record : dataset.records) {
    if (!record.has_role(role)) continue;
    const std::vector<double>& values = record.recording.channel(channel).values;
    for (const Segment& segment : record.segments) {
      if (segment.role != role) continue;
      for (std::size_t n = segment.begin; n < segment.end; ++n) {
        if (!limits.contain(values[n])) continue;
        lowest = std::min(lowest, values[n]);
        highest = std::max(highest, values[n]);
        if (n > segment.begin && limits.contain(values[n - 1]))
          largest = std::max(largest, std::abs(values[n] - values[n - 1]));
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

std::string LeftOut::text() const {
  return fmt::format("{}, sample {} (t = {:.6g} s): {} = {:.6g}",
                     file.empty() || recording.find('[') != std::string::npos ? recording : file,
                     sample, time_s, channel, value);
}

bool Sequence::has_features(std::size_t sample) const {
  return std::ranges::all_of(features.row(sample),
                             [](double value) { return std::isfinite(value); });
}

TrainingData training_data(const Dataset& dataset, const FeatureSpec& spec, Role role) {
  ++passes().training_data;
  const FeaturePipeline pipeline(spec, dataset.sample_rate_Hz());
  TrainingData data;
  data.target = dataset.target;
  data.sample_rate_Hz = dataset.sample_rate_Hz();
  for (std::size_t j = 0; j < pipeline.feature_count(); ++j)
    data.inputs.push_back({spec.inputs[j], pipeline.is_rate(j)});
  const ChannelLimits limits = channel_limits(dataset, pipeline, role);
  std::vector<const DatasetRecord*> records;
  for (const DatasetRecord& record : dataset.records)
    if (record.has_role(role)) records.push_back(&record);
  data.sequences.resize(records.size());
  std::vector<std::vector<LeftOut>> left_out(records.size());
  std::vector<double> travels(records.size());
  for_each_chunk(records.size(), 0, [&](std::size_t r) {
    FeaturePipeline own = pipeline;
    data.sequences[r] = run(dataset, *records[r], own, role, limits, left_out[r]);
    travels[r] = largest_travel(*records[r], data.sequences[r], role);
  });
  for (std::size_t r = 0; r < records.size(); ++r) {
    std::ranges::move(left_out[r], std::back_inserter(data.left_out));
    data.largest_travel = std::fmax(data.largest_travel, travels[r]);
  }
  for (const std::string& channel : pipeline.raw_inputs())
    data.largest_step.push_back(largest_step(dataset, channel, role, limits.at(channel)));
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

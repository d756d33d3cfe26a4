#include "torsio/evaluate/estimate_recording.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <string_view>
#include <utility>

#include "core/report_progress.hpp"
#include "data/channel_names.hpp"
#include "data/recording_rows.hpp"
#include "data/text_sink.hpp"
#include "files/output_file.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/realtime.hpp"
#include "torsio/core/units.hpp"

namespace torsio {
namespace {

constexpr std::size_t kSamplesPerReport = 1000;
constexpr const char* kNovelty = "novelty_1";

/// A text as a cell of a CSV file (RFC 4180).
std::string cell(std::string_view text) {
  if (text.find_first_of(",\"\r\n") == std::string_view::npos) return std::string(text);
  std::string quoted = "\"";
  for (const char letter : text) quoted.append(letter == '"' ? 2 : 1, letter);
  return quoted + "\"";
}

bool has_novelty(const std::vector<EstimatedRecording>& recordings) {
  return std::ranges::any_of(recordings, [](const EstimatedRecording& each) {
    return std::ranges::any_of(each.channels.channel(kNovelty).values,
                               [](double value) { return std::isfinite(value); });
  });
}

void check_equal_channels(const std::vector<EstimatedRecording>& recordings) {
  for (const EstimatedRecording& each : recordings)
    if (channel_names(each.channels.channels()) !=
        channel_names(recordings.front().channels.channels()))
      throw Error(
          {.place = each.channels.name(),
           .problem = "its channels differ from those of " + recordings.front().channels.name()});
}

}  // namespace

std::string estimate_channel(const std::string& target) { return "estimated_" + target; }

std::string error_bar_channel(const std::string& target) {
  const ChannelName parts = *split_channel_name(target);
  return std::string(parts.quantity) + "_std_dev_" + std::string(parts.unit->si_suffix);
}

EstimatedRecording estimate_recording(Estimator estimator, const Recording& recording,
                                      const Progress& progress) {
  const EstimatorSettings& settings = estimator.settings();
  for (const ZeroRule& zero : recording.zeros)
    if (std::ranges::find(settings.zeroed_channels, zero.channel) != settings.zeroed_channels.end())
      estimator.set_zero(zero.channel, 0.0);
  EstimatedRecording result{
      .channels = Recording(recording.name(), recording.sample_rate_Hz(), recording.time_s(0)),
      .faults = {}};
  RecordingRows rows(recording, estimator.raw_inputs());
  for (const Channel* input : rows.channels())
    result.channels.add({.name = input->name, .values = input->values});
  const std::size_t samples = recording.size();
  Channel value{.name = estimate_channel(settings.target), .values = {}};
  Channel std_dev{.name = error_bar_channel(settings.target), .values = {}};
  Channel novelty{.name = kNovelty, .values = {}};
  for (Channel* channel : {&value, &std_dev, &novelty}) channel->values.reserve(samples);
  result.faults.reserve(samples);
  const DenormalsOff denormals_off;
  estimator.reset();
  for (std::size_t n = 0; n < samples; ++n) {
    if (n % kSamplesPerReport == 0)
      report_progress(progress, static_cast<double>(n) / static_cast<double>(samples),
                      "estimating");
    const Estimate estimate = estimator.step(rows.at(n));
    value.values.push_back(estimate.value);
    std_dev.values.push_back(estimate.std_dev);
    novelty.values.push_back(estimate.novelty);
    result.faults.push_back(estimate.fault);
  }
  result.channels.add(std::move(value));
  result.channels.add(std::move(std_dev));
  result.channels.add(std::move(novelty));
  return result;
}

double EstimateSummary::usable_share() const noexcept {
  const auto usable = std::ranges::find(faults, Fault::none, &OfFault::fault);
  if (usable == faults.end()) return 0.0;
  return static_cast<double>(usable->samples) / static_cast<double>(samples);
}

EstimateSummary summary_of(const EstimatedRecording& estimated, const std::string& target) {
  EstimateSummary summary{.recording = estimated.channels.name(),
                          .sample_rate_Hz = estimated.channels.sample_rate_Hz(),
                          .samples = estimated.faults.size(),
                          .faults = {}};
  const auto& value = estimated.channels.channel(estimate_channel(target)).values;
  const auto& std_dev = estimated.channels.channel(error_bar_channel(target)).values;
  std::map<Fault, std::size_t> counts;
  for (std::size_t n = 0; n < estimated.faults.size(); ++n) {
    ++counts[estimated.faults[n]];
    if (estimated.faults[n] != Fault::none) continue;
    // fmin and fmax take the number where the other value is NaN.
    summary.lowest = std::fmin(summary.lowest, value[n]);
    summary.highest = std::fmax(summary.highest, value[n]);
    summary.largest_std_dev = std::fmax(summary.largest_std_dev, std_dev[n]);
  }
  for (const auto& [fault, samples] : counts) summary.faults.push_back({fault, samples});
  return summary;
}

void write_estimates(const std::vector<EstimatedRecording>& recordings, const std::string& path,
                     FaultColumn fault) {
  if (recordings.empty()) return;
  check_equal_channels(recordings);
  OutputFile file = path == "-" ? OutputFile::standard_output() : OutputFile(path);
  TextSink text(file, path.ends_with(".gz"));
  std::vector<std::string> columns = channel_names(recordings.front().channels.channels());
  if (!has_novelty(recordings)) std::erase(columns, kNovelty);
  text.add("t_s");
  for (const std::string& column : columns) {
    text.add(",");
    text.add(column);
  }
  const bool is_named = fault == FaultColumn::name;
  const bool has_recording = is_named || recordings.size() > 1;
  text.add(is_named ? ",fault" : ",fault_1");
  text.add(has_recording ? ",recording\n" : "\n");
  for (const auto& [recording, faults] : recordings) {
    const std::string name_cell = cell(recording.name());
    std::vector<const std::vector<double>*> values;
    values.reserve(columns.size());
    for (const std::string& column : columns) values.push_back(&recording.channel(column).values);
    for (std::size_t n = 0; n < recording.size(); ++n) {
      text.add(recording.time_s(n));
      for (const auto* channel : values) {
        text.add(",");
        text.add((*channel)[n]);
      }
      text.add(",");
      if (is_named)
        text.add(name(faults[n]));
      else
        text.add(static_cast<double>(faults[n]));
      if (has_recording) text.add(",");
      if (has_recording) text.add(name_cell);
      text.add("\n");
    }
  }
  text.finish();
  file.commit();
}

}  // namespace torsio

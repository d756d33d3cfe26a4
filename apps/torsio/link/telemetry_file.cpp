#include "link/telemetry_file.hpp"

#include <fmt/format.h>

#include <cmath>
#include <filesystem>
#include <system_error>
#include <utility>

#include "common/output.hpp"
#include "link/lost_samples.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/units.hpp"
#include "torsio/data/recording_blocks.hpp"
#include "torsio/data/write.hpp"

namespace {

constexpr std::string_view kRecorderEnding = ".tsr";
constexpr std::uint64_t kClockBack_ns = 1'000'000'000;

}  // namespace

std::string text_of(const std::string& path, const TelemetrySummary& summary) {
  std::string text =
      fmt::format("{}: {} samples of {} channels at {:g} Hz", path,
                  summary.frames + summary.missing, summary.channels.size(), summary.rate_Hz);
  if (summary.missing == 0) return text;
  text += fmt::format(", {} of which did not arrive", summary.missing);
  const std::size_t left = summary.missing - summary.bridged;
  if (summary.bridged == 0) return text + ", and are nan";
  text += fmt::format(": {} are bridged", summary.bridged);
  if (left > 0) text += fmt::format(", {} in longer gaps are nan", left);
  return text;
}

void TelemetryFile::check(const std::string& path) {
  require_ending("--output", path, {".csv", ".gz", ".mcap", ".npz", ".mat", kRecorderEnding});
  require_writable(path);
}

std::vector<std::string> TelemetryFile::recorded(const std::vector<std::string>& channels) {
  std::vector<std::string> found;
  for (const std::string& each : channels) {
    const auto parts = torsio::split_channel_name(each);
    if (parts && parts->si() == each)
      found.push_back(each);
    else
      remark(fmt::format("channel {} is not recorded: its name has no SI unit", each));
  }
  return found;
}

TelemetryFile::TelemetryFile(torsio::JointConnection::Subscription subscription,
                             const std::string& path, double bridge_s)
    : path_(path),
      bridge_s_(bridge_s),
      recorded_(path.ends_with(kRecorderEnding) ? path : path + ".tsr"),
      subscription_(std::move(subscription)) {
  recorder_ = std::make_unique<torsio::Recorder>(
      recorded_, torsio::RecorderOptions{.channels = subscription_.channels,
                                         .period_s = 1.0 / subscription_.rate_Hz});
}

void TelemetryFile::add(const torsio::LinkTelemetry& telemetry) {
  if (!first_ns_) first_ns_ = telemetry.time_ns;
  // The clock of a joint that was started again: the recording continues with the next sample.
  if (telemetry.time_ns + kClockBack_ns < last_ns_) {
    first_ns_ = telemetry.time_ns;
    first_tick_ = last_tick_ + 1;
  }
  last_ns_ = telemetry.time_ns;
  if (telemetry.time_ns < *first_ns_) return;
  const auto tick =
      first_tick_ +
      static_cast<std::int64_t>(std::llround(
          1e-9 * static_cast<double>(telemetry.time_ns - *first_ns_) * subscription_.rate_Hz));
  if (tick <= last_tick_) return;  // it has arrived late or twice
  last_tick_ = tick;
  const auto& values = telemetry.values;
  values_.assign(values.values.begin(), values.values.begin() + values.count);
  static_cast<void>(recorder_->push(tick, values_));
}

void TelemetryFile::remove_recorded() const {
  std::error_code ignored;
  std::filesystem::remove(recorded_, ignored);
}

TelemetrySummary TelemetryFile::close() {
  const torsio::RecorderReport report = recorder_->close();
  TelemetrySummary summary{.frames = report.frames,
                           .missing = static_cast<std::size_t>(last_tick_ + 1) - report.frames,
                           .channels = subscription_.channels,
                           .rate_Hz = subscription_.rate_Hz};
  if (!report.trouble.empty())
    throw torsio::Error(
        {.place = recorded_,
         .problem = fmt::format("{} frames could not be written", report.dropped),
         .found = report.trouble,
         .advice = fmt::format("The file has the {} frames before.", report.frames)});
  if (report.frames == 0) {
    remove_recorded();
    throw torsio::Error({.place = path_,
                         .problem = "no telemetry has arrived",
                         .advice = "The file was not written."});
  }
  if (recorded_ == path_) return summary;
  try {
    const BridgedRecording bridged =
        bridge_lost_samples(torsio::read_recording_blocks(recorded_).recording, bridge_s_);
    torsio::write_recording(bridged.recording, path_);
    summary.bridged = bridged.bridged;
  } catch (const torsio::Error& error) {
    torsio::ErrorReport again = error.report();
    again.advice = fmt::format("The recording is in {0}: `torsio unpack {0} -o {1}` converts it.",
                               recorded_, path_);
    throw torsio::Error(again);
  }
  remove_recorded();
  return summary;
}

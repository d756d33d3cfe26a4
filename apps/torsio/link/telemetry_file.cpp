#include "link/telemetry_file.hpp"

#include <fmt/format.h>

#include <cmath>
#include <filesystem>

#include "common/output.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/units.hpp"
#include "torsio/data/recording_blocks.hpp"
#include "torsio/data/write.hpp"

namespace {

constexpr std::string_view kRecorderEnding = ".tsr";

std::vector<std::string> channels_with_unit(const std::vector<std::string>& all) {
  std::vector<std::string> found;
  for (const std::string& each : all) {
    const auto parts = torsio::split_channel_name(each);
    if (parts && parts->si() == each)
      found.push_back(each);
    else
      remark(fmt::format("channel {} is not recorded: its name has no SI unit", each));
  }
  return found;
}

}  // namespace

TelemetryFile::TelemetryFile(torsio::JointConnection& joint,
                             const std::vector<std::string>& channels, double rate_Hz,
                             const std::string& path)
    : path_(path), recorded_(path.ends_with(kRecorderEnding) ? path : path + ".tsr") {
  require_ending("--output", path, {".csv", ".gz", ".mcap", ".npz", ".mat", kRecorderEnding});
  require_writable(path);
  subscription_ =
      joint.subscribe(channels.empty() ? channels_with_unit(joint.channels()) : channels, rate_Hz);
  recorder_ = std::make_unique<torsio::Recorder>(
      recorded_, torsio::RecorderOptions{.channels = subscription_.channels,
                                         .period_s = 1.0 / subscription_.rate_Hz});
}

void TelemetryFile::add(const torsio::LinkTelemetry& telemetry) {
  if (!first_ns_) first_ns_ = telemetry.time_ns;
  if (telemetry.time_ns < *first_ns_) return;
  const auto tick = static_cast<std::int64_t>(std::llround(
      1e-9 * static_cast<double>(telemetry.time_ns - *first_ns_) * subscription_.rate_Hz));
  if (tick <= last_tick_) return;  // it has arrived late or twice
  last_tick_ = tick;
  const auto& values = telemetry.values;
  values_.assign(values.values.begin(), values.values.begin() + values.count);
  static_cast<void>(recorder_->push(tick, values_));
}

TelemetryFile::Summary TelemetryFile::close() {
  const torsio::RecorderReport report = recorder_->close();
  Summary summary{.frames = report.frames,
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
    std::filesystem::remove(recorded_);
    throw torsio::Error({.place = path_,
                         .problem = "no telemetry has arrived",
                         .advice = "The file was not written."});
  }
  if (recorded_ == path_) return summary;
  try {
    torsio::write_recording(torsio::read_recording_blocks(recorded_).recording, path_);
  } catch (const torsio::Error& error) {
    torsio::ErrorReport again = error.report();
    again.advice = fmt::format("The recording is in {0}: `torsio unpack {0} -o {1}` converts it.",
                               recorded_, path_);
    throw torsio::Error(again);
  }
  std::filesystem::remove(recorded_);
  return summary;
}

#include "sim/sensors/bench_log.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <utility>

#include "torsio/core/error.hpp"

namespace torsio {
namespace {

/// @throws Error if the bench does not come to a whole number of ticks a sample.
std::size_t whole_ticks_a_sample(double rate_Hz) {
  const double ticks = std::round(kBenchRate_Hz / rate_Hz);
  if (ticks >= 1.0 && std::abs(ticks * rate_Hz - kBenchRate_Hz) < 1e-6 * kBenchRate_Hz)
    return static_cast<std::size_t>(ticks);
  throw Error({.place = "data sheet: log_rate_Hz",
               .expected = fmt::format("{} Hz divided by a whole number", kBenchRate_Hz),
               .found = fmt::format("{} Hz", rate_Hz)});
}

}  // namespace

BenchLog::BenchLog(const DataSheet& sheet, std::size_t ticks, bool with_truth, bool is_electrical,
                   const std::vector<std::string>& command_channels)
    : rate_Hz_(sheet.sensors.log_rate_Hz.value), ticks_a_sample_(whole_ticks_a_sample(rate_Hz_)) {
  const std::size_t samples = ticks / ticks_a_sample_ + 1;
  for (const SensedChannel& source : sensed_channels(sheet, is_electrical)) {
    Sensed& of = sensed_.emplace_back(
        Sensed{.source = source, .channel = {.name = std::string(source.name), .values = {}}});
    of.channel.values.reserve(samples);
    of.channel.fresh.reserve(samples);
  }
  for (const std::string& name : command_channels) {
    commands_.push_back({.name = name, .values = {}});
    commands_.back().values.reserve(samples);
  }
  if (!with_truth) return;
  for (TruthChannel& source : truth_channels(sheet, is_electrical)) {
    Truth& of = truth_.emplace_back(Truth{.channel = {.name = std::move(source.name), .values = {}},
                                          .value = std::move(source.value)});
    of.channel.values.reserve(samples);
  }
}

void BenchLog::add(const Measurement& measured, const BenchTruth& truth,
                   std::span<const double> commanded) {
  for (Sensed& of : sensed_) of.is_fresh = of.is_fresh || measured.*of.source.is_fresh;
  if (tick_++ % ticks_a_sample_ != 0) return;
  for (Sensed& of : sensed_) {
    of.channel.values.push_back(of.source.scale * measured.*of.source.value);
    of.channel.fresh.push_back(of.is_fresh ? 1 : 0);
    of.is_fresh = false;
  }
  for (std::size_t i = 0; i < commands_.size(); ++i) commands_[i].values.push_back(commanded[i]);
  for (Truth& of : truth_) of.channel.values.push_back(of.value(truth));
}

Recording BenchLog::finish(std::string name) {
  Recording recording(std::move(name), rate_Hz_);
  const std::string_view load_cell = sensed_.back().source.name;
  for (Sensed& of : sensed_) {
    std::vector<std::uint8_t>& fresh = of.channel.fresh;
    const bool is_always_fresh = std::ranges::find(fresh, 0) == fresh.end();
    if (is_always_fresh && of.source.name != load_cell) fresh.clear();
    recording.add(std::move(of.channel));
  }
  for (Channel& command : commands_) recording.add(std::move(command));
  for (Truth& of : truth_) recording.add(std::move(of.channel));
  return recording;
}

}  // namespace torsio

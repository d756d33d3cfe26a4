// Jumps: a sensor that slipped, a step of a zero, rows that are missing, bursts in which nothing was measured.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "check/checker.hpp"
#include "check/dropouts.hpp"
#include "data/finest_step.hpp"
#include "torsio/core/units.hpp"

namespace torsio {

namespace {

std::string jumps_text(const Recording& recording, std::string_view name, const Jumps& jumps) {
  const std::string heights = jumps.highest < 1.05 * jumps.lowest
                                  ? fmt::format("{:.3g}", jumps.highest)
                                  : fmt::format("{:.3g} to {:.3g}", jumps.lowest, jumps.highest);
  return fmt::format("{} jumps {} times by {} {}, the first time at t = {:.4g} s, {} anywhere else",
                     name, jumps.samples.size(), heights, unit_label(name),
                     recording.time_s(jumps.samples.front()),
                     jumps.next_height > 0.0
                         ? fmt::format("{:.3g} times more than", jumps.lowest / jumps.next_height)
                         : "and does not move");
}

std::vector<SampleRange> places_of_jumps(const Jumps& jumps) {
  std::vector<SampleRange> places;
  for (const std::size_t sample : jumps.samples) places.push_back({sample, sample + 1});
  return places;
}

constexpr double kTurn_s = 0.05;

/// Whether the jumps are where the input turns, as those of a friction; at most one of four or more is elsewhere.
bool are_at_turns(const Jumps& jumps, const std::vector<double>& input, std::size_t window) {
  const auto at_turn = std::ranges::count_if(jumps.samples, [&](std::size_t i) {
    if (i < window || i + window >= input.size()) return true;
    return !((input[i] - input[i - window]) * (input[i + window] - input[i]) > 0.0);
  });
  const auto all = std::ssize(jumps.samples);
  return at_turn >= (all >= 4 ? all - 1 : all);
}

/// Whether the channel may step, as a current or a voltage does.
bool may_step(std::string_view channel) {
  const auto parts = split_channel_name(channel);
  return !parts || parts->unit->si_suffix == "A" || parts->unit->si_suffix == "V";
}

}  // namespace

/// Several jumps, which `largest_jump` does not find, since the second one is the highest step elsewhere.
/// @param samples of the new values
bool Checker::check_jumps(std::size_t r, const Channel& channel,
                          const std::vector<std::size_t>& samples,
                          const std::vector<double>& values) {
  if (may_step(channel.name) || (spoiled_[r] != 0 && is_source(channel.name))) return false;
  auto jumps = find_jumps(values, finest_step(channel), kJumpOverOthers);
  if (!jumps || jumps->lowest < kJumpShare * extent_of(values).width()) return false;
  for (std::size_t& sample : jumps->samples) sample = samples[sample];
  if (std::ranges::any_of(
          jumps->samples,
          [&](std::size_t sample) { return is_end_of_stall(r, sample) || is_spike(r, sample); }) ||
      are_at_turns(*jumps, pairs_[r].input,
                   static_cast<std::size_t>(kTurn_s * dataset_.sample_rate_Hz())))
    return false;
  const Recording& recording = dataset_.records[r].recording;
  add(Verdict::warn, "gaps", recording.name(), jumps_text(recording, channel.name, *jumps),
      "Check for a zero that was set or a test signal that was added, lost samples and a slipping "
      "sensor. Cut the recording there.",
      places_of_jumps(*jumps));
  return true;
}

bool Checker::check_jumps_of_input(std::size_t r) {
  const std::vector<double>& input = pairs_[r].input;
  const Recording& recording = dataset_.records[r].recording;
  double code = 0.0;
  for (const std::string& source : sources_)
    code = std::max(code, finest_step(recording.channel(source)));
  const auto jumps = find_jumps(input, code, kJumpOverOthers);
  if (!jumps || jumps->lowest < kInputJumpShare * extent_of(input).width()) return false;
  if (std::ranges::any_of(jumps->samples, [&](std::size_t sample) {
        return is_end_of_stall(r, sample) || is_spike(r, sample);
      }))
    return false;
  spoiled_[r] = 1;
  add(Verdict::warn, "gaps", recording.name(),
      jumps_text(recording, spec_.inputs.front(), *jumps) +
          fmt::format("; the first comes from {}",
                      source_of(recording, {.sample = jumps->samples.front()})),
      "Check whether that sensor slipped or lost counts or samples, or a part broke. Cut the "
      "recording there, and determine the zero of each part.",
      places_of_jumps(*jumps));
  return true;
}

/// Bursts in which a channel has no measurements.
bool Checker::check_dropouts(std::size_t r, const Channel& channel) {
  if (may_step(channel.name)) return false;
  const double least =
      std::max(kSpikeShare * range_in_use(r, channel.name), 3.0 * finest_step(channel));
  const auto dropouts = find_dropouts(channel, least);
  if (!dropouts) return false;
  const Recording& recording = dataset_.records[r].recording;
  std::vector<SampleRange> places;
  for (const Rest& burst : dropouts->bursts) {
    places.push_back({burst.begin, burst.end});
    leave_out(r, burst);
    for (std::size_t i = burst.begin; i <= burst.end; ++i) spikes_[r].push_back(i);
  }
  const auto ms = [&](std::size_t samples) {
    return 1e3 * static_cast<double>(samples) / recording.sample_rate_Hz();
  };
  const std::string lengths =
      dropouts->shortest == dropouts->longest
          ? fmt::format("{:.0f} ms", ms(dropouts->longest))
          : fmt::format("{:.0f} to {:.0f} ms", ms(dropouts->shortest), ms(dropouts->longest));
  const std::string bursts =
      fmt::format("in {} bursts of {}, the first from t = {:.4g} s on", dropouts->bursts.size(),
                  lengths, recording.time_s(dropouts->bursts.front().begin));
  if (dropouts->is_one_value)
    add(Verdict::warn, "frozen sensors", recording.name(),
        fmt::format("{} is exactly {:.6g} {} {}, and jumps there and back, by up to {:.3g} {}",
                    channel.name, dropouts->value, unit_label(channel.name), bursts,
                    dropouts->highest_jump, unit_label(channel.name)),
        fmt::format("Something writes that value where it has no measurement: check the bus for "
                    "lost frames. Mapping line that reads it as not measured, as it is in the "
                    "file: missing: [{:.9g}]",
                    dropouts->value),
        std::move(places));
  else
    add(Verdict::warn, "frozen sensors", recording.name(),
        fmt::format("{} keeps its last value {}, and then jumps, by up to {:.3g} {}", channel.name,
                    bursts, dropouts->highest_jump, unit_label(channel.name)),
        "Check the bus for lost frames. Cut those parts out: a model would be trained on values "
        "that were not measured.",
        std::move(places));
  return true;
}

bool Checker::stands_out(const Jump& jump, const std::vector<double>& values) {
  return jump.height > 0.0 && jump.height >= kJumpShare * extent_of(values).width() &&
         jump.height >= kJumpOverOthers * jump.next_height;
}

void Checker::check_gaps(bool with_warnings) {
  pass_unless_found("gaps", "no jump", [&] {
    for_each_record([&](std::size_t r) { check_gaps_of(r, with_warnings); });
  });
}

void Checker::check_gaps_of(std::size_t r, bool with_warnings) {
  if (coded_[r] != 0) return;  // numbers that begin again jump
  check_jump_of_input(r);      // later checks leave a recording with a jump out
  if (!with_warnings) return;
  if (!check_cut(r)) check_cadence(r);
  const Recording& recording = dataset_.records[r].recording;
  for (const std::string& name : channels_) {
    const Channel& channel = recording.channel(name);
    if (is_condition(recording, name) || stands_still(r, name)) continue;
    // Between the new samples of a slow sensor there is no jump.
    const std::vector<double> whole = bridged(channel);
    std::vector<std::size_t> samples;
    std::vector<double> values;
    for (std::size_t i = 0; i < whole.size(); ++i)
      if (channel.is_fresh(i)) samples.push_back(i), values.push_back(whole[i]);
    if (check_jumps(r, channel, samples, values)) continue;
    Jump jump = largest_jump(values);
    if (!samples.empty()) jump.sample = samples[jump.sample];
    if (!stands_out(jump, values) || is_end_of_stall(r, jump.sample) ||
        is_sign_flip(r, name, jump) || is_spike(r, jump.sample) ||
        (spoiled_[r] != 0 && is_source(name)))
      continue;
    add(Verdict::warn, "gaps", recording.name(), jump_text(recording, name, jump),
        "Check for lost samples and a slipping sensor. Cut the recording in two there.",
        {{jump.sample, jump.sample + 1}});
  }
}

// A step that is small for an angle can be the whole range of the deflection between two angles.
void Checker::check_jump_of_input(std::size_t r) {
  const std::vector<double>& input = pairs_[r].input;
  if (sources_.size() < 2 || check_jumps_of_input(r)) return;
  const Jump jump = largest_jump(input);
  if (!stands_out(jump, input) || is_spike(r, jump.sample) ||
      jump.height < kInputJumpShare * extent_of(input).width())
    return;
  const Recording& recording = dataset_.records[r].recording;
  spoiled_[r] = 1;
  add(Verdict::warn, "gaps", recording.name(),
      jump_text(recording, spec_.inputs.front(), jump) +
          fmt::format("; it comes from {}", source_of(recording, jump)),
      "Check whether that sensor slipped or lost counts or samples, or a part broke. Cut the "
      "recording in two there, and determine the zero of each part.",
      {{jump.sample, jump.sample + 1}});
}

std::string Checker::jump_text(const Recording& recording, const std::string& name,
                               const Jump& jump) {
  return fmt::format("{} jumps by {:.3g} at t = {:.4g} s, {} anywhere else", name, jump.height,
                     recording.time_s(jump.sample),
                     jump.next_height > 0.0
                         ? fmt::format("{:.4g} times more than", jump.height / jump.next_height)
                         : "and does not move");
}

/// The channel whose step at a jump of the first input is largest compared with its other steps.
const std::string& Checker::source_of(const Recording& recording, const Jump& jump) const {
  const auto excess = [&](const std::string& name) {
    const std::vector<double>& values = recording.channel(name).values;
    const auto step = [&](std::size_t i) {
      return i > 0 && i < values.size() ? values[i] - values[i - 1] : 0.0;
    };
    return std::abs(step(jump.sample) - 0.5 * (step(jump.sample - 1) + step(jump.sample + 1)));
  };
  return *std::ranges::max_element(sources_, {}, excess);
}

bool Checker::is_source(const std::string& name) const {
  return std::ranges::find(sources_, name) != sources_.end();
}

bool Checker::is_sign_flip(std::size_t r, const std::string& name, const Jump& jump) const {
  const double apart_s =
      flips_[r]
          ? std::abs(static_cast<double>(jump.sample) - static_cast<double>(flips_[r]->sample)) /
                dataset_.sample_rate_Hz()
          : kNotMeasured;
  return name == dataset_.target && apart_s < kSameMoment_s;
}

}  // namespace torsio

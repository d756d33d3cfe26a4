#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "check/checker.hpp"
#include "check/hysteresis_fit.hpp"
#include "check/signal_faults.hpp"
#include "data/finest_step.hpp"
#include "torsio/core/units.hpp"

namespace torsio {

/// The range of a channel; of an angle of the first input that of this input, if it is smaller.
double Checker::range_in_use(std::size_t r, const std::string& name) const {
  const double range = extent_of(dataset_.records[r].recording.channel(name).values).width();
  const double input = extent_of(pairs_[r].input).width();
  return is_source(name) && input > 0.0 ? std::min(range, input) : range;
}

bool Checker::is_spike(std::size_t r, std::size_t sample) const {
  return std::ranges::any_of(
      spikes_[r], [&](std::size_t spike) { return sample == spike || sample == spike + 1; });
}

// Two columns that were interchanged: a torque sensor after the spring follows the deflection
// closely, apart from hysteresis; a current contains the friction of the gear as well.
void Checker::check_columns() {
  pass_unless_found("columns", "no other channel follows the first input better",
                    [&] { for_each_record([&](std::size_t r) { check_columns_of(r); }); });
}

void Checker::check_columns_of(std::size_t r) {
  if (spoiled_[r] != 0 || changes_[r]) return;
  const Recording& recording = dataset_.records[r].recording;
  const Pair& pair = pairs_[r];
  const std::vector<std::size_t> samples = known_samples(pair);
  if (samples.size() < kFewSamples) return;
  const FixedColumns columns(hysteresis_columns(pair.input, samples));
  const double own = columns.unexplained(at_samples(pair.target, samples));
  for (const Channel& channel : recording.channels()) {
    if (!may_be_target(recording, channel)) continue;
    const std::vector<double> values = bridged(channel);
    if (std::abs(correlation(pair.input, values)) < kClearCorrelation) continue;
    const Eigen::VectorXd other = at_samples(values, samples);
    if (!other.allFinite()) continue;
    const double left = columns.unexplained(other);
    if (left > kWellExplained || left > kOtherExplained * own) continue;
    add(Verdict::warn, "columns", recording.name(),
        fmt::format("{} follows {} more closely than {} does ({:.2g} and {:.2g} % unexplained)",
                    channel.name, spec_.inputs.front(), dataset_.target, 100.0 * left, 100.0 * own),
        "Check whether two columns were interchanged.");
  }
}

/// Torques, forces and currents that are neither the target nor an input.
bool Checker::may_be_target(const Recording& recording, const Channel& channel) const {
  const auto parts = split_channel_name(channel.name);
  const std::string_view unit = parts ? parts->unit->si_suffix : std::string_view();
  return (unit == "Nm" || unit == "N" || unit == "A") &&
         std::ranges::find(channels_, channel.name) == channels_.end() &&
         !channel.name.starts_with(kTruthPrefix) && !is_condition(recording, channel.name) &&
         std::ranges::find(dataset_.target_computed_from, channel.name) ==
             dataset_.target_computed_from.end();
}

void Checker::check_noise() {
  pass_unless_found("noise", "small, and the same throughout", [&] {
    for_each_moving_channel([&](std::size_t r, const Recording& recording, const Channel& channel) {
      if (is_condition(recording, channel.name)) return;
      const double range = range_in_use(r, channel.name);
      if (range > 0.0) check_noise_of(r, channel, range);
    });
  });
}

void Checker::check_noise_of(std::size_t r, const Channel& channel, double range) {
  const Recording& recording = dataset_.records[r].recording;
  const NoiseCourse course = noise_course(channel, recording.sample_rate_Hz());
  if (course.sigma.empty()) return;
  const double least = std::max(kBurstShare * range, finest_step(channel));
  const auto burst = find_burst(channel, course, recording.sample_rate_Hz(), least);
  if (burst) {
    add(Verdict::warn, "noise", recording.name(),
        fmt::format("{} has noise of {:.3g} {} from t = {:.4g} s to {:.4g} s, {:.3g} elsewhere",
                    channel.name, burst->sigma, unit_label(channel.name),
                    recording.time_s(burst->begin), recording.time_s(burst->end), burst->usual),
        "Check cables and supply. Cut that part out.");
    return;
  }
  // Where nothing moves, noise is all there is.
  const double usual = usual_noise(course);
  if (channel.name != dataset_.target || !is_clear(r) ||
      usual < std::max(kNoiseShare * range, finest_step(channel)))
    return;
  add(Verdict::warn, "noise", recording.name(),
      fmt::format("{} has noise of {:.3g} {}, {:.2g} % of its range", channel.name, usual,
                  unit_label(channel.name), 100.0 * usual / range),
      "Check cables and shielding. The error of a model cannot be measured below the noise.");
}

/// Whether the standard deviation of the first input is less than ten times its noise.
bool Checker::hardly_moves(std::size_t r) const {
  const Channel input{.name = spec_.inputs.front(), .values = pairs_[r].input};
  const NoiseCourse course = noise_course(input, dataset_.sample_rate_Hz());
  if (course.sigma.empty()) return false;
  const Variation variation = variation_of(input.values);
  return variation.squares < variation.count * std::pow(kMotionOverNoise * usual_noise(course), 2);
}

namespace {

/// The first hundred.
std::vector<SampleRange> places_of(const std::vector<std::size_t>& samples) {
  std::vector<SampleRange> places;
  for (std::size_t i = 0; i < std::min<std::size_t>(samples.size(), 100); ++i)
    places.push_back({samples[i], samples[i] + 1});
  return places;
}

}  // namespace

void Checker::check_spikes() {
  pass_unless_found("spikes", "no single sample is far from its neighbours", [&] {
    for_each_moving_channel([&](std::size_t r, const Recording& recording, const Channel& channel) {
      if (is_condition(recording, channel.name)) return;
      const double range = range_in_use(r, channel.name);
      const double least = std::max(kSpikeShare * range, 2.0 * finest_step(channel));
      std::vector<std::size_t> spikes = find_spikes(channel, least);
      if (const auto returning = find_returning_value(channel, least)) {
        report_returning(r, channel, *returning);
        std::erase_if(spikes, [&](std::size_t i) { return channel.values[i] == returning->value; });
      }
      if (spikes.empty()) return;
      std::ranges::copy(spikes, std::back_inserter(spikes_[r]));
      add(Verdict::warn, "spikes", recording.name(),
          fmt::format("{}: {} single samples are far from both neighbours, the first at t = {:.4g} "
                      "s by {:.3g} {}",
                      channel.name, spikes.size(), recording.time_s(spikes.front()),
                      std::abs(channel.values[spikes.front()] - channel.values[spikes.front() - 1]),
                      unit_label(channel.name)),
          "Check the bus for invalid telegrams, and the log for lost digits.", places_of(spikes));
    });
  });
}

void Checker::report_returning(std::size_t r, const Channel& channel,
                               const ReturningValue& returning) {
  const Recording& recording = dataset_.records[r].recording;
  std::ranges::copy(returning.samples, std::back_inserter(spikes_[r]));
  add(Verdict::warn, "spikes", recording.name(),
      fmt::format(
          "{} returns to exactly {:.6g} {} in {} single samples, far from their neighbours, the "
          "first at t = {:.4g} s",
          channel.name, returning.value, unit_label(channel.name), returning.samples.size(),
          recording.time_s(returning.samples.front())),
      fmt::format(
          "An amplifier that has no measurement writes such a value. Mapping line that reads it as "
          "not measured, as it is in the file: missing: [{:.9g}]",
          returning.value),
      places_of(returning.samples));
}

void Checker::check_repeats() {
  pass_unless_found("repeats", "no rows occur twice", [&] {
    for_each_record([&](std::size_t r) {
      const Recording& recording = dataset_.records[r].recording;
      std::vector<const Channel*> channels;
      for (const std::string& name : channels_)
        if (!is_condition(recording, name)) channels.push_back(&recording.channel(name));
      const auto rows =
          std::max(kRepeatRows,
                   static_cast<std::size_t>(std::round(kRepeat_s * recording.sample_rate_Hz())));
      const std::vector<RepeatedBlock> repeats = find_repeats(channels, rows);
      if (repeats.empty()) return;
      constexpr std::size_t kMaxNamed = 4;
      std::vector<std::string> texts;
      std::vector<SampleRange> places;
      for (const RepeatedBlock& repeat : repeats) {
        places.push_back({repeat.again, repeat.again + repeat.length});
        if (texts.size() < kMaxNamed)
          texts.push_back(fmt::format(
              "the rows from t = {:.4g} s on occur again from t = {:.4g} s on, for {:.3g} s",
              recording.time_s(repeat.first), recording.time_s(repeat.again),
              static_cast<double>(repeat.length) / recording.sample_rate_Hz()));
      }
      if (repeats.size() > kMaxNamed)
        texts.push_back(fmt::format("{} more blocks", repeats.size() - kMaxNamed));
      add(Verdict::warn, "repeats", recording.name(), fmt::format("{}", fmt::join(texts, "; ")),
          repeats.size() == 1 ? "No sensor repeats its noise: check the logger for a buffer that "
                                "was written twice, "
                                "and cut the second one out."
                              : "No sensor repeats its noise: check the logger for buffers that "
                                "were written twice, "
                                "and cut the second one of each out.",
          std::move(places));
    });
  });
}

// Rows that are missing while the stamps are even: every channel jumps by what it passes through in
// the same time. Currents may jump.
bool Checker::check_cut(std::size_t r) {
  const Recording& recording = dataset_.records[r].recording;
  std::vector<const Channel*> channels;
  std::vector<double> codes;
  for (const Channel& channel : recording.channels()) {
    const auto parts = split_channel_name(channel.name);
    if (is_condition(recording, channel.name) || channel.name.starts_with(kTruthPrefix) || !parts ||
        parts->unit->si_suffix == "A" || parts->unit->si_suffix == "V")
      continue;
    channels.push_back(&channel);
    codes.push_back(finest_step(channel));
  }
  const auto cut = find_cut(channels, codes);
  if (!cut || is_spike(r, cut->sample)) return false;
  add(Verdict::warn, "gaps", recording.name(),
      fmt::format("several channels jump together at t = {:.4g} s, as if {:.2g} s were missing",
                  recording.time_s(cut->sample), cut->rows / recording.sample_rate_Hz()),
      "Rows are missing although the stamps are even. Cut the recording in two there.",
      {{cut->sample, cut->sample + 1}});
  return true;
}

// The rows between two new samples of a slow sensor are counted by its own clock.
void Checker::check_cadence(std::size_t r) {
  const Recording& recording = dataset_.records[r].recording;
  for (const Channel& channel : recording.channels()) {
    const auto cadence = find_broken_cadence(channel);
    if (!cadence) continue;
    add(Verdict::warn, "gaps", recording.name(),
        fmt::format("{} has a new sample in every {}. row, but at t = {:.4g} s after {} rows",
                    channel.name, cadence->usual, recording.time_s(cadence->sample),
                    cadence->found),
        "Rows are missing or were inserted although the stamps are even. Cut the recording in two "
        "there.");
    return;
  }
}

}  // namespace torsio

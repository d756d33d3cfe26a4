#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <span>

#include "check/checker.hpp"
#include "data/finest_step.hpp"
#include "torsio/core/estimate.hpp"
#include "torsio/core/units.hpp"

namespace torsio {

namespace {

constexpr double kFewMissing = 1e-3;   // share of the samples
constexpr double kSlowerSensor = 0.4;  // its cells are empty between its samples

/// Means over the `half_window` samples before and after each; NaN where one of them is.
std::vector<double> without_noise(const std::vector<double>& values, std::size_t half_window) {
  std::vector<double> means(values.size());
  for (std::size_t i = 0; i < values.size(); ++i) {
    const std::size_t begin = i > half_window ? i - half_window : 0;
    const std::size_t end = std::min(values.size(), i + half_window + 1);
    double sum = 0.0;
    for (std::size_t k = begin; k < end; ++k) sum += values[k];
    means[i] = sum / static_cast<double>(end - begin);
  }
  return means;
}

}  // namespace

// A locked output: compared with the deflection the channel does not move, and the torque follows
// that deflection, which it would not do if a sensor were dead while its side moved.
bool Checker::stands_still(std::size_t r, const std::string& name) const {
  const Recording& recording = dataset_.records[r].recording;
  if (sources_.size() < 2 || name == dataset_.target || is_condition(recording, name) ||
      std::ranges::find(sources_, name) == sources_.end())
    return false;
  const Pair& pair = pairs_[r];
  return extent_of(recording.channel(name).values).width() <
             kRestShare * extent_of(pair.input).width() &&
         std::abs(correlation(pair.input, pair.target)) > kFollows;
}

bool Checker::is_condition(const Recording& recording, const std::string& channel) {
  return std::ranges::find(recording.conditions(), channel) != recording.conditions().end();
}

namespace {

/// Where a channel has such values; at most a hundred places, short distances between them left out.
template <class Condition>
std::vector<SampleRange> ranges_where(const Channel& channel, const Condition& is_found) {
  constexpr std::size_t kMost = 100;
  const std::size_t together = channel.values.size() / (10 * kMost) + 1;
  std::vector<SampleRange> ranges;
  for (std::size_t n = 0; n < channel.values.size(); ++n) {
    if (!is_found(channel.values[n])) continue;
    if (!ranges.empty() && (n - ranges.back().end < together || ranges.size() == kMost))
      ranges.back().end = n + 1;
    else
      ranges.push_back({n, n + 1});
  }
  return ranges;
}

}  // namespace

namespace {

/// Without the samples at either end that have no value, as the torque of a known load: its acceleration looks back and
/// ahead. All of them if none has one.
std::span<const double> between_ends(std::span<const double> values) {
  const auto has_value = [](double value) { return is_finite(value); };
  const auto first = std::ranges::find_if(values, has_value);
  if (first == values.end()) return values;
  const auto after = std::find_if(values.rbegin(), values.rend(), has_value).base();
  return {first, after};
}

}  // namespace

void Checker::check_missing() {
  pass_unless_found("missing values", "none", [&] {
    for_each_channel([&](const Recording& recording, const Channel& channel) {
      const bool is_target = channel.name == dataset_.target;
      std::span<const double> values = channel.values;
      if (is_target && dataset_.load_target.is_used()) values = between_ends(values);
      const auto missing = static_cast<std::size_t>(
          std::ranges::count_if(values, [](double v) { return !is_finite(v); }));
      if (missing == 0) return;
      const double share =
          static_cast<double>(missing) / static_cast<double>(channel.values.size());
      const bool is_slower = share > kSlowerSensor;
      Verdict verdict = is_target && share < 1.0 ? Verdict::warn : Verdict::fail;
      if (is_target && share < kFewMissing) verdict = Verdict::pass;
      std::string advice =
          is_target ? "They are neither trained on nor scored." : "An input must have every value.";
      if (!is_target || is_slower)
        advice += fmt::format(" If it is a slower sensor: hold: [{}]", channel.name);
      add(verdict, "missing values", recording.name(),
          fmt::format("{}: {} of {} samples are NaN{}", channel.name, missing,
                      channel.values.size(),
                      verdict == Verdict::pass ? ", neither trained on nor scored" : ""),
          verdict == Verdict::pass ? "" : advice,
          ranges_where(channel, [](double value) { return !is_finite(value); }));
    });
  });
}

void Checker::check_constant() {
  pass_unless_found("constant channels", "every input and the target move", [&] {
    for_each_moving_channel([&](std::size_t, const Recording& recording, const Channel& channel) {
      if (is_condition(recording, channel.name) || extent_of(channel.values).width() > 0.0) return;
      add(Verdict::fail, "constant channels", recording.name(),
          fmt::format("{} never changes from {:g}", channel.name, channel.values.front()),
          "Check that the sensor is connected. If it is a condition of the recording, list it "
          "under conditions: in a manifest.");
    });
    for (std::size_t r = 0; r < pairs_.size(); ++r)
      for (const std::string& name : channels_)
        if (stands_still(r, name))
          add(Verdict::pass, "constant channels", dataset_.records[r].recording.name(),
              fmt::format("{} does not move, as at a locked output, and {} follows {}", name,
                          dataset_.target, spec_.inputs.front()));
  });
}

// A range limit causes many consecutive samples exactly at the extreme value.
void Checker::check_saturation() {
  pass_unless_found("saturation", "no channel rests at its extreme value", [&] {
    for_each_moving_channel([&](std::size_t r, const Recording& recording, const Channel& channel) {
      const Extent span = extent_of(channel.values);
      if (!(span.width() > 0.0)) return;
      // A motion that turns within the last of few codes rests there, too.
      const double by_code = kCodesAtATurn * finest_step(channel) / span.width();
      for (const double extreme : {span.lowest, span.highest}) {
        const auto count = static_cast<double>(std::ranges::count(channel.values, extreme));
        const double share = count / static_cast<double>(channel.values.size());
        if (share < std::max(kSaturatedShare, by_code) ||
            approaches_gradually(channel, extreme, span) || is_turn(r, channel, extreme))
          continue;
        const auto returning = find_returning_value(channel, kSpikeShare * span.width());
        if (returning && returning->value == extreme) continue;
        add(Verdict::warn, "saturation", recording.name(),
            fmt::format("{}: {:.1f} % of the samples are exactly {:g}", channel.name, 100.0 * share,
                        extreme),
            "If that is the sensor's limit, cut those parts out or use a sensor of larger "
            "range.",
            ranges_where(channel, [&](double value) { return value == extreme; }));
      }
    });
    for_each_record([&](std::size_t r) { check_limit(r); });
  });
}

// A signal that reverses at its extreme has samples near it too; a saturated one is exactly at it.
bool Checker::approaches_gradually(const Channel& channel, double extreme, const Extent& span) {
  std::size_t at_extreme = 0;
  std::size_t near_extreme = 0;
  for (const double value : channel.values) {
    if (value == extreme) ++at_extreme;
    if (std::abs(value - extreme) < 0.01 * span.width()) ++near_extreme;
  }
  return 2 * at_extreme < near_extreme;
}

/// Whether the motion itself ends at the extreme: while the channel rests there, the channel that
/// follows it best moves no further in the direction in which it came than two codes of the channel
/// explain. A limit of the sensor hides the rest of a motion that continues. False if no channel
/// follows it.
bool Checker::is_turn(std::size_t r, const Channel& channel, double extreme) const {
  const std::vector<double>& values = channel.values;
  const Extent span = extent_of(values);
  std::vector<double> other;
  double closest = kClearCorrelation;
  for (const Channel& each : others_of(r, channel.name)) {
    const double together = std::abs(correlation(values, each.values));
    if (together > closest) closest = together, other = bridged(each);
  }
  if (other.empty()) return false;
  other = without_noise(other,
                        static_cast<std::size_t>(kSpeedHalfWindow_s * dataset_.sample_rate_Hz()));
  const double beyond = std::max(kCodesAtATurn * finest_step(channel), kBeyondShare * span.width());
  const double zone = kApproachShare * span.width();
  for (std::size_t begin = 0, end = 0; begin < values.size(); begin = end) {
    end = begin + 1;
    if (values[begin] != extreme) continue;
    // The visit of the extreme, and the last part of the motion towards it.
    while (end < values.size() && std::abs(values[end] - extreme) < zone) ++end;
    std::size_t from = begin;
    while (from > 0 && std::abs(values[from] - extreme) < zone) --from;
    const double slope = (other[begin] - other[from]) / (values[begin] - values[from]);
    if (!is_finite(slope) || slope == 0.0) continue;
    const double direction = (values[begin] > values[from] ? 1.0 : -1.0) / slope;
    for (std::size_t i = begin; i < end; ++i)
      if (direction * (other[i] - other[begin]) > beyond) return false;
  }
  return true;
}

// A sensor with a constant value is frozen if the other channels move; at a standstill it is
// correct.
void Checker::check_frozen() {
  pass_unless_found("frozen sensors", "none is constant while the others move", [&] {
    for_each_moving_channel([&](std::size_t r, const Recording& recording, const Channel& channel) {
      if (is_condition(recording, channel.name) || check_dropouts(r, channel)) return;
      const auto shortest = static_cast<std::size_t>(0.5 * kFrozen_s * recording.sample_rate_Hz());
      const std::vector<Rest> rests = rests_of(channel, std::max<std::size_t>(shortest, 2));
      if (rests.empty()) return;
      const std::vector<Channel> others = others_of(r, channel.name);
      for (const Rest& rest : rests) {
        const auto samples = static_cast<double>(rest.length());
        const double duration_s = samples / recording.sample_rate_Hz();
        // A sensor without output has no new samples for many of its periods.
        if (duration_s < kFrozen_s || share_fresh(channel) * samples < kFrozenDeliveries ||
            rest.length() == channel.values.size())
          return;
        for (const Channel& other : others) {
          const double moved = share_moved(other, rest);
          if (moved < kMovedMeanwhile &&
              (is_stop_of_motion(channel, rest) || !is_odd_one_out(rest, rests, channel, other)))
            continue;
          add(Verdict::warn, "frozen sensors", recording.name(),
              fmt::format(
                  "{} is constant at {:g} for {:.3g} s from t = {:.4g} s, while {} moves through "
                  "{:.{}f} % of its range",
                  channel.name, channel.values[rest.begin], duration_s,
                  recording.time_s(rest.begin), other.name, 100.0 * moved, moved < 0.1 ? 1 : 0),
              "Check its bus. Cut that part out: a model would be trained on the constant value.",
              {{rest.begin, rest.begin + rest.length()}});
          leave_out(r, rest);
          return;
        }
      }
    });
    for_each_record([&](std::size_t r) { check_dead_angle(r); });
    check_switched_off();
  });
}

/// A rest at a turning point, or at the beginning or end of the recording: friction holds the joint
/// while the torque still changes.
bool Checker::is_stop_of_motion(const Channel& channel, const Rest& rest) {
  const double step = std::max(kCodesAtATurn * finest_step(channel),
                               kStepShare * extent_of(channel.values).width());
  return rest.begin == 0 || rest.end == channel.values.size() ||
         is_turning_point(rest, channel.values, step);
}

/// The channels that should move if a channel does; the target is compared with the first input,
/// not with the channels of its expression.
std::vector<Channel> Checker::others_of(std::size_t r, const std::string& name) const {
  std::vector<Channel> others;
  for (const std::string& each : channels_)
    if (each != name && !stands_still(r, each))
      others.push_back(dataset_.records[r].recording.channel(each));
  if (name == dataset_.target && sources_.size() > 1)
    others.push_back({.name = spec_.inputs.front(), .values = pairs_[r].input});
  return others;
}

/// Excludes the samples of a frozen sensor from the other checks.
void Checker::leave_out(std::size_t r, const Rest& rest) {
  for (std::size_t i = rest.begin; i < std::min(rest.end + 1, pairs_[r].input.size()); ++i)
    pairs_[r].input[i] = kNotMeasured;
  stalls_[r].push_back(rest);
}

bool Checker::is_end_of_stall(std::size_t r, std::size_t sample) const {
  return std::ranges::any_of(stalls_[r], [&](const Rest& stall) {
    return sample >= stall.end && sample <= stall.end + 1;
  });
}

// The channels of the first input may have a much larger range than the input: the resolution of a
// gear's angle is compared with the range of the deflection.
void Checker::check_resolution() {
  pass_unless_found("resolution", "every sensor resolves its range", [&] {
    for_each_record([&](std::size_t r) { check_resolution_of(r); });
    check_held();
  });
}

void Checker::check_resolution_of(std::size_t r) {
  const auto unit_of = [](const std::string& name) {
    const auto parts = split_channel_name(name);
    return parts ? parts->unit->si_suffix : std::string_view();
  };
  const Recording& recording = dataset_.records[r].recording;
  const double first_input = extent_of(pairs_[r].input).width();
  for (const std::string& name : channels_) {
    if (is_condition(recording, name) || stands_still(r, name)) continue;
    const std::vector<double>& values = recording.channel(name).values;
    double range = extent_of(values).width();
    if (first_input > 0.0 && unit_of(name) == unit_of(channels_.front()) && name != dataset_.target)
      range = std::min(range, first_input);
    const double code = finest_step(recording.channel(name));
    if (!(range > 0.0) || code < kCoarseShare * range) continue;
    add(Verdict::warn, "resolution", recording.name(),
        fmt::format("{} has a resolution of {:.3g}: {} moves through only {:.0f} such steps", name,
                    code, range == first_input ? spec_.inputs.front() : name, range / code),
        "Check whether the sensor has lost bits or the log has too few digits. No model "
        "resolves finer steps.");
  }
}

}  // namespace torsio

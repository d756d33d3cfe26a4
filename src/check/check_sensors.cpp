// What a sensor writes is not a measurement: numbers in another coding, values that are held, a torque that is switched
// off, a zero that was taken in motion.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <span>
#include <vector>

#include "check/checker.hpp"
#include "check/hysteresis_fit.hpp"
#include "check/mapping_advice.hpp"
#include "check/signal_faults.hpp"
#include "data/finest_step.hpp"
#include "data/mapping/columns.hpp"
#include "data/mapping/number_coding.hpp"
#include "torsio/core/estimate.hpp"
#include "torsio/core/units.hpp"
#include "torsio/data/mapping.hpp"

namespace torsio {
namespace {

std::string_view key_of(CodedNumbers::Kind kind) {
  switch (kind) {
    case CodedNumbers::Kind::sign_bit: return "sign_bit";
    case CodedNumbers::Kind::modulus: return "modulus";
    case CodedNumbers::Kind::wrapped: return "unwrap";
  }
  return {};
}

std::string coding_text(const CodedNumbers& coded) {
  const std::string codes =
      coded.codes > 0.0 ? fmt::format(" ({:.0f} of its steps)", coded.codes) : std::string();
  switch (coded.kind) {
    case CodedNumbers::Kind::sign_bit:
      return fmt::format("{}: from there on it falls again, like a magnitude with a sign bit",
                         codes);
    case CodedNumbers::Kind::modulus:
      return fmt::format("{}, like a signed number that was read as an unsigned one", codes);
    case CodedNumbers::Kind::wrapped:
      return fmt::format("{}, like a counter or an angle that begins again", codes);
  }
  return {};
}

/// What one turn of an encoder is in a channel, also before a gear; empty for other quantities.
std::vector<double> turns_of(const Recording& recording, const std::string& name) {
  const auto parts = split_channel_name(name);
  if (!parts || parts->unit->si_suffix != "rad") return {};
  constexpr double kTurn_rad = 2.0 * std::numbers::pi;
  std::vector<double> turns{kTurn_rad};
  if (const auto rule = rule_of(recording, name)) {
    if (rule->gear_ratio != 1.0) turns.push_back(kTurn_rad / rule->gear_ratio);
    if (rule->scale != 1.0) turns.push_back(kTurn_rad * std::abs(rule->scale) / rule->gear_ratio);
  }
  return turns;
}

/// What a decoded channel begins with.
std::string text_on_zero(const std::string& name, double span) {
  const auto parts = split_channel_name(name);
  if (parts && parts->unit->si_suffix == "rad")
    return "\n         The zero is then that of the turn in which a recording begins: give each "
           "recording "
           "its zero (zero: in the mapping).";
  return fmt::format(
      "\n         The first number of a recording is taken as it is: where {0} begins beyond the "
      "range of "
      "its "
      "numbers, add offset: {1:.9g} or offset: -{1:.9g} ({2}) to the same rule.",
      name, span, unit_label(name));
}

}  // namespace

namespace {

/// The new values of a channel and their samples.
struct NewValues {
  std::vector<std::size_t> samples;
  std::vector<double> values;
  explicit NewValues(const Channel& channel) : samples(new_samples(channel)) {
    for (const std::size_t i : samples) values.push_back(channel.values[i]);
  }
};

std::optional<CodedNumbers> coding_of(const Recording& recording, const Channel& channel) {
  return find_coded_numbers(NewValues(channel).values, finest_step(channel),
                            turns_of(recording, channel.name));
}

/// The values, without the wraps that are found in them.
std::vector<double> unwrapped_values(const Recording& recording, const Channel& channel) {
  std::vector<double> values = channel.values;
  const auto coded = coding_of(recording, channel);
  if (coded && coded->kind == CodedNumbers::Kind::wrapped) unwrap(values, coded->span);
  return values;
}

}  // namespace

/// By how many spans the subtrahend of two angles is too low after both are unwrapped, if their difference is much smaller
/// than that span; not a number if it is not.
double Checker::spans_between_sources(std::size_t r, double span) const {
  const int order = order_of_difference(r);
  if (order == 0) return kNotMeasured;
  const Recording& recording = dataset_.records[r].recording;
  std::vector<double> difference =
      unwrapped_values(recording, recording.channel(sources_[order > 0 ? 0 : 1]));
  const std::vector<double> subtrahend =
      unwrapped_values(recording, recording.channel(sources_[order > 0 ? 1 : 0]));
  for (std::size_t i = 0; i < difference.size(); ++i) difference[i] -= subtrahend[i];
  const Extent extent = extent_of(difference);
  if (!(extent.width() < kSmallTwist * span)) return kNotMeasured;
  return std::round(0.5 * (extent.lowest + extent.highest) / span);
}

/// The mapping line that decodes a channel.
std::string Checker::coding_advice(std::size_t r, const std::string& name,
                                   const CodedNumbers& coded) const {
  const Recording& recording = dataset_.records[r].recording;
  const auto scale = scale_of_column(recording, name);
  std::string entries =
      fmt::format("{}: {:.9g}", key_of(coded.kind), coded.span / scale.value_or(1.0));
  std::string rest =
      scale ? std::string()
            : fmt::format(" ({:.9g} is for a column in {})", coded.span, unit_label(name));
  if (coded.kind == CodedNumbers::Kind::wrapped) {
    const double spans = is_source(name) ? spans_between_sources(r, coded.span) : kNotMeasured;
    const int order = order_of_difference(r);
    const bool is_subtrahend = order != 0 && name == sources_[order > 0 ? 1 : 0];
    if (!is_finite(spans)) {
      rest += text_on_zero(name, coded.span);
    } else if (spans != 0.0 && is_offset_on(r, name)) {
      entries += fmt::format(", offset: {:.9g}", (is_subtrahend ? spans : -spans) * coded.span);
      rest += fmt::format(
          "\n         The offset (in {}) brings it to the turn of the other angle; another "
          "recording may "
          "need another one.",
          unit_label(name));
    }
  }
  return rule_advice(recording, name, entries) + rest;
}

/// Whether this one of two angles gets the offset by whole turns: the wrapped one, the subtrahend where both are.
bool Checker::is_offset_on(std::size_t r, const std::string& name) const {
  const Recording& recording = dataset_.records[r].recording;
  const std::string& other = name == sources_[0] ? sources_[1] : sources_[0];
  const bool is_subtrahend = name == sources_[order_of_difference(r) > 0 ? 1 : 0];
  return is_subtrahend || !coding_of(recording, recording.channel(other));
}

void Checker::check_coding() {
  pass_unless_found("coding", "no channel jumps again and again by the same amount", [&] {
    for_each_moving_channel([&](std::size_t r, const Recording& recording, const Channel& channel) {
      if (is_condition(recording, channel.name)) return;
      const auto coded = coding_of(recording, channel);
      if (!coded) return;
      const std::vector<std::size_t> samples = new_samples(channel);
      spoiled_[r] = 1;
      coded_[r] = 1;
      const std::size_t first = samples[coded->first];
      add(Verdict::fail, "coding", recording.name(),
          coded->jumps == 1
              ? fmt::format("{} jumps by {:.6g} {}{}; at t = {:.4g} s", channel.name, coded->span,
                            unit_label(channel.name), coding_text(*coded), recording.time_s(first))
              : fmt::format("{} jumps {} times by {:.6g} {}{}; the first time at t = {:.4g} s",
                            channel.name, coded->jumps, coded->span, unit_label(channel.name),
                            coding_text(*coded), recording.time_s(first)),
          coding_advice(r, channel.name, *coded), {{first, first + 1}});
    });
  });
}

// A value that is written again and again looks like a delay.
void Checker::check_held() {
  for_each_moving_channel([&](std::size_t, const Recording& recording, const Channel& channel) {
    const std::string& name = channel.name;
    const std::size_t rows = held_rows(channel);
    if (rows == 0 || is_condition(recording, name)) return;
    const double rate_Hz = recording.sample_rate_Hz() / static_cast<double>(rows);
    const bool is_target = name == dataset_.target;
    add(Verdict::warn, "resolution", recording.name(),
        fmt::format("{} changes in every {}. row only: a sensor of {:.4g} Hz, whose value is held",
                    name, rows, rate_Hz),
        is_target ? fmt::format("A model would learn the held values as a delay. Mapping line "
                                "that trains and scores on "
                                "the new ones: hold: [{}]",
                                name)
                  : "An estimate is as late as its input: record that sensor at the rate of the "
                    "others, or all at its own "
                    "(clock: {resample: ...} in a mapping).");
  });
}

// An encoder that is dead: a locked output does not move either, but then the torque follows the other angle.
void Checker::check_dead_angle(std::size_t r) {
  constexpr double kLeastMotion_rad = 0.1;
  constexpr double kFollowsOther = 0.5;
  if (spoiled_[r] != 0 || sources_.size() != 2 || order_of_difference(r) == 0) return;
  const Recording& recording = dataset_.records[r].recording;
  for (std::size_t k = 0; k < 2; ++k) {
    const Channel& dead = recording.channel(sources_[k]);
    const Channel& other = recording.channel(sources_[1 - k]);
    const double moved_rad = inner_range(other.values);
    if (extent_of(dead.values).width() != 0.0 || moved_rad < kLeastMotion_rad) continue;
    const double together = correlation(other.values, pairs_[r].target);
    if (moved_rad < kWidestTwist_rad && std::abs(together) > kFollowsOther) continue;
    spoiled_[r] = 1;
    add(Verdict::fail, "frozen sensors", recording.name(),
        fmt::format(
            "{} is {:g} in all samples, while {} moves through {:.3g} rad (correlation with "
            "{} {:.2f})",
            dead.name, dead.values.front(), other.name, moved_rad, dataset_.target, together),
        "Its sensor is dead, or another column was taken for it: check its cable and bus. A spring "
        "does not twist so far.");
    return;
  }
}

// A torque sensor without supply or with a channel that saturates in its amplifier shows noise.
void Checker::check_switched_off() {
  for_each_record([&](std::size_t r) {
    const Channel& target = dataset_.records[r].recording.channel(dataset_.target);
    if (spoiled_[r] != 0 || new_samples(target).size() < kFewestSamples) return;
    const auto off = find_switched_off(pairs_[r]);
    if (!off) return;
    const Recording& recording = dataset_.records[r].recording;
    const bool is_last = off->samples.end == pairs_[r].target.size();
    spoiled_[r] = 1;
    add(Verdict::fail, "frozen sensors", recording.name(),
        fmt::format("{} stays within {:.3g} {} from t = {:.4g} s to {}, while the motion of {} "
                    "would change it by {:.3g} {}",
                    dataset_.target, off->passed, unit_label(dataset_.target),
                    recording.time_s(off->samples.begin),
                    is_last ? std::string("the end")
                            : fmt::format("{:.4g} s", recording.time_s(off->samples.end)),
                    spec_.inputs.front(), off->expected, unit_label(dataset_.target)),
        is_last
            ? fmt::format(
                  "Check its cable and supply. Mapping line that cuts that part out: to: {:.6g}s",
                  recording.time_s(off->samples.begin))
            : std::string("Check its cable and supply, and cut that part out."),
        {{off->samples.begin, off->samples.end}});
  });
}

// The zero is the mean of a window at the beginning: where the joint moves in it, it is not known what was measured at zero.
void Checker::check_zeros() {
  for_each_record([&](std::size_t r) {
    const Recording& recording = dataset_.records[r].recording;
    for (const ZeroRule& zero : recording.zeros) {
      if (zero.mid_range || !recording.has(zero.channel)) continue;
      const Channel& channel = recording.channel(zero.channel);
      const double range = range_in_use(r, zero.channel);
      const double moved = moved_within(
          channel, static_cast<std::size_t>(std::round(zero.first_s * recording.sample_rate_Hz())));
      if (!(moved > kZeroShare * range)) continue;
      add(Verdict::warn, "offsets", recording.name(),
          fmt::format("{} moves by {:.3g} {} in the first {:g} s, whose mean is taken as its zero "
                      "({:.2g} % of its range)",
                      zero.channel, moved, unit_label(zero.channel), zero.first_s,
                      100.0 * moved / range),
          "Take the zero while nothing moves and nothing pulls: a shorter first: in the mapping, "
          "or a recording at rest.");
    }
  });
}

/// Whether the first input is the twist of a spring, recorded or as the difference of two angles.
bool Checker::is_deflection(std::size_t r) const {
  const auto parts = split_channel_name(sources_.front());
  return parts && parts->unit->si_suffix == "rad" &&
         (order_of_difference(r) != 0 || spec_.inputs.front() == "spring_deflection_rad");
}

/// "zero: [{channel: gear_angle_rad, first: 0.1s}, ..]"
std::string Checker::zero_line(double first_s) const {
  std::string rules;
  for (const std::string& source : sources_)
    rules +=
        fmt::format("{}{{channel: {}, first: {:g}s}}", rules.empty() ? "" : ", ", source, first_s);
  return fmt::format("zero: [{}]", rules);
}

/// Whether the first input's channels rest in the first moments, where a zero can be taken.
bool Checker::begins_at_rest(std::size_t r) const {
  const Recording& recording = dataset_.records[r].recording;
  const auto samples =
      static_cast<std::size_t>(std::round(kUsualRest_s * recording.sample_rate_Hz()));
  return std::ranges::none_of(sources_, [&](const std::string& source) {
    return recording.has(source) &&
           moved_within(recording.channel(source), samples) > kZeroShare * range_in_use(r, source);
  });
}

bool Checker::all_begin_at_rest() const {
  for (std::size_t r = 0; r < dataset_.records.size(); ++r)
    if (!begins_at_rest(r)) return false;
  return true;
}

// A spring that carries no torque is not twisted: otherwise an encoder has another zero, as an incremental one after each
// start.
void Checker::check_unloaded(std::size_t r) {
  constexpr double kNearZero = 0.04;   // share of the range of the torque
  constexpr double kBothSides = 0.05;  // share of it on either side of zero
  constexpr double kFarOff = 0.15;     // share of the range of the deflection
  if (!is_deflection(r)) return;
  const auto target = split_channel_name(dataset_.target);
  if (!target || target->unit->si_suffix != "Nm") return;
  const Pair& pair = pairs_[r];
  if (std::abs(correlation(pair.input, pair.target)) < kTogether) return;
  const auto [twist, torque] = known_extents(pair);
  if (!(std::min(-torque.lowest, torque.highest) > kBothSides * torque.width())) return;
  Extent unloaded;
  double sum = 0.0;
  std::size_t samples = 0;
  for (std::size_t i = 0; i < pair.input.size(); ++i) {
    if (!is_known(pair, i) || std::abs(pair.target[i]) > kNearZero * torque.width()) continue;
    unloaded.include(pair.input[i]);
    sum += pair.input[i];
    ++samples;
  }
  if (samples < 2) return;
  const double zero_rad = sum / static_cast<double>(samples);
  // Within the friction of the spring, zero torque has no single twist.
  if (std::abs(zero_rad) < std::max(kFarOff * twist.width(), unloaded.width())) return;
  constexpr double kTurn_rad = 2.0 * std::numbers::pi;
  const double turns = std::round(zero_rad / kTurn_rad);
  if (turns != 0.0 && std::abs(zero_rad - turns * kTurn_rad) < kLargestZero_rad)
    return;  // `check_turns_between`
  const Recording& recording = dataset_.records[r].recording;
  const bool has_zero = std::ranges::any_of(
      recording.zeros, [&](const ZeroRule& zero) { return is_source(zero.channel); });
  add(Verdict::warn, "offsets", recording.name(),
      fmt::format("{} is zero at {} = {:.3g} rad instead of 0, a constant offset ({:.0f} % of the "
                  "range of {:.3g} rad)",
                  dataset_.target, spec_.inputs.front(), zero_rad,
                  100.0 * std::abs(zero_rad) / twist.width(), twist.width()),
      has_zero ? "The zero of the mapping was taken while the spring was loaded: take it at rest "
                 "without load."
      : begins_at_rest(r)
          ? fmt::format("An encoder or the torque sensor has another zero; that of an "
                        "incremental encoder changes with each start. Mapping line for a "
                        "recording that begins at rest without load:  {}",
                        zero_line(kUsualRest_s))
          : fmt::format("An encoder or the torque sensor has another zero; that of an incremental "
                        "encoder changes with each start. This recording begins in motion, so that "
                        "no zero can be taken from it: record once more from rest without load, or "
                        "correct it with an offset: of one of {}.",
                        fmt::join(sources_, ", ")));
}

}  // namespace torsio

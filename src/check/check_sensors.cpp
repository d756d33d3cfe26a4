// What a sensor writes is not a measurement: numbers in another coding, values that are held, a torque that is switched
// off, a zero that was taken in motion.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <span>
#include <vector>

#include "check/checker.hpp"
#include "check/hysteresis_fit.hpp"
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

/// The rule of the mapping that makes a channel.
std::optional<ChannelRule> rule_of(const Recording& recording, const std::string& name) {
  if (recording.mapping.empty()) return std::nullopt;
  for (const ChannelRule& rule : parse_mapping(recording.mapping, recording.name()).channels)
    if (const auto parts = split_channel_name(rule.name); parts && parts->si() == name) return rule;
  return std::nullopt;
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

/// The mapping line that decodes a channel.
std::string coding_advice(const Recording& recording, const std::string& name,
                          const CodedNumbers& coded) {
  const std::string zero =
      coded.kind == CodedNumbers::Kind::wrapped
          ? " The zero is then that of the turn in which a recording begins: give each its zero "
            "(zero: in the mapping)."
          : "";
  if (const auto rule = rule_of(recording, name))
    if (const auto factor = column_factor(*rule, LogColumn{.name = rule->from, .values = {}}))
      return fmt::format("Mapping: add {}: {:.9g} to the rule of {}, after its from: {}.{}",
                         key_of(coded.kind), coded.span / std::abs(*factor), rule->name, rule->from,
                         zero);
  return fmt::format(
      "Mapping: channels: {{{}: {{from: ..., {}: {:.9g}}}}}, with the column of {} (the number is "
      "in {}; give it in the "
      "unit of the column).{}",
      name, key_of(coded.kind), coded.span, name, unit_label(name), zero);
}

}  // namespace

void Checker::check_coding() {
  pass_unless_found("coding", "no channel jumps again and again by the same amount", [&] {
    for_each_moving_channel([&](std::size_t r, const Recording& recording, const Channel& channel) {
      if (is_condition(recording, channel.name)) return;
      std::vector<std::size_t> samples;
      std::vector<double> values;
      for (const std::size_t i : new_samples(channel))
        samples.push_back(i), values.push_back(channel.values[i]);
      const auto coded =
          find_coded_numbers(values, finest_step(channel), turns_of(recording, channel.name));
      if (!coded) return;
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
          coding_advice(recording, channel.name, *coded), {{first, first + 1}});
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

}  // namespace torsio

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "check/checker.hpp"
#include "torsio/core/units.hpp"

namespace torsio {

// The sensors of both sides of a spring turn by the same angle, so one of them in another unit
// turns by a unit's factor as much; and recordings of one joint have one stiffness.
void Checker::check_units() {
  pass_unless_found("units", "the recordings agree", [&] {
    for (std::size_t r = 0; r < pairs_.size(); ++r) check_units_within(r);
    if (pairs_.size() < 2) return;
    std::vector<double> slopes;
    for (std::size_t r = 0; r < pairs_.size(); ++r)
      slopes.push_back(is_clear(r) ? std::abs(line_through(pairs_[r]).slope) : 0.0);
    const std::size_t usual = usual_slope(slopes);
    const auto near_usual = std::ranges::count_if(slopes, [&](double slope) {
      return slope > 0.0 && ratio_of(slope, slopes[usual]) < kSlopeRatio;
    });
    for (std::size_t r = 0; r < pairs_.size(); ++r)
      if (slopes[r] > 0.0 && ratio_of(slopes[r], slopes[usual]) >= kSlopeRatio)
        report_slope(r, slopes[r], usual, slopes[usual], near_usual > 1);
  });
}

void Checker::report_slope(std::size_t r, double slope, std::size_t usual, double usual_slope,
                           bool is_majority) {
  const std::string_view mistake = unit_mistake(slope / usual_slope);
  const Recording& other = dataset_.records[usual].recording;
  if (mistake.empty() && !other.conditions().empty()) return;  // the condition explains it
  const double torque_ratio =
      extent_of(pairs_[r].target).width() / extent_of(pairs_[usual].target).width();
  const bool by_torque =
      std::abs(std::log(torque_ratio)) > 0.5 * std::log(ratio_of(slope, usual_slope));
  spoiled_[r] = 1;
  const std::string& own = dataset_.records[r].recording.name();
  add(mistake.empty() ? Verdict::warn : Verdict::fail, "units",
      is_majority ? own : own + " or " + other.name(),
      fmt::format("the slope of {} over {} is {:.4g} times {} in {} than in {}{}", dataset_.target,
                  spec_.inputs.front(), ratio_of(slope, usual_slope),
                  slope > usual_slope ? "larger" : "smaller", own,
                  is_majority ? "the other recordings, as in " : "", other.name()),
      mistake.empty()
          ? "Check spring and units: recordings of one joint have one stiffness."
          : fmt::format(
                "That is the factor between {}: check the unit of {} in {}, and specify it in "
                "the column's name or with unit: in a mapping.",
                mistake, by_torque ? dataset_.target : spec_.inputs.front(),
                is_majority ? "this recording"
                            : "both recordings (two recordings do not show which is correct)"));
}

/// The recording whose slope most others have, too; the first of equals.
std::size_t Checker::usual_slope(const std::vector<double>& slopes) {
  const auto company = [&](double slope) {
    return slope > 0.0
               ? std::ranges::count_if(
                     slopes,
                     [&](double each) { return each > 0.0 && ratio_of(each, slope) < kSlopeRatio; })
               : 0;
  };
  return static_cast<std::size_t>(std::ranges::max_element(slopes, {}, company) - slopes.begin());
}

double Checker::ratio_of(double a, double b) { return std::max(a / b, b / a); }

bool Checker::is_clear(std::size_t r) const {
  return spoiled_[r] == 0 &&
         std::abs(correlation(pairs_[r].input, pairs_[r].target)) > kClearCorrelation;
}

void Checker::check_units_within(std::size_t r) {
  const Recording& recording = dataset_.records[r].recording;
  if (order_of_difference(r) == 0) return;
  const Pair sides{recording.channel(sources_[0]).values, recording.channel(sources_[1]).values};
  if (correlation(sides.input, sides.target) < kOneMotion) return;
  const double slope = line_through(sides).slope;
  const std::string_view mistake = unit_mistake(slope);
  if (mistake.empty()) return;
  spoiled_[r] = 1;
  add(Verdict::fail, "units", recording.name(),
      fmt::format("{} moves {:.4g} times as far as {}", slope > 1.0 ? sources_[1] : sources_[0],
                  std::max(slope, 1.0 / slope), slope > 1.0 ? sources_[0] : sources_[1]),
      fmt::format("That is the factor between {}: specify the column's unit in its name or with "
                  "unit: in a mapping.",
                  mistake));
}

void Checker::check_sign_flips() {
  flips_.resize(pairs_.size());
  for (std::size_t r = 0; r < pairs_.size(); ++r)
    if (const Jump jump = largest_jump(pairs_[r].input); !stands_out(jump, pairs_[r].input))
      flips_[r] = find_sign_flip(pairs_[r]);
}

// Friction makes the torque lead the deflection, so that the cross-correlation alone would report a
// delay for every hysteretic spring. The delay is therefore the shift at which spring and friction
// together explain the torque best.
void Checker::check_delay() {
  const double rate = dataset_.sample_rate_Hz();
  const auto longest = static_cast<std::ptrdiff_t>(std::round(kLongestDelay_s * rate));
  pass_unless_found(
      "delay", fmt::format("{} and {} move together", spec_.inputs.front(), dataset_.target), [&] {
        for (std::size_t r = 0; r < pairs_.size(); ++r) {
          const ShiftedFit fit(pairs_[r], rate);
          const double at_zero = fit.unexplained(0);
          std::ptrdiff_t best = 0;
          double least = at_zero;
          for (std::ptrdiff_t lag = -longest; lag <= longest; ++lag)
            if (const double share = fit.unexplained(lag); share < least) best = lag, least = share;
          if (least > kExplainsLittle || least > kDelayGain * at_zero) continue;
          const double delay_ms = 1e3 * static_cast<double>(best) / rate;
          add(Verdict::warn, "delay", dataset_.records[r].recording.name(),
              fmt::format(
                  "{} comes {:.1f} ms {} {} (unexplained {:.2f} % there, {:.2f} % without shift)",
                  dataset_.target, std::abs(delay_ms), delay_ms > 0 ? "after" : "before",
                  spec_.inputs.front(), 100.0 * least, 100.0 * at_zero),
              delay_ms > 0 && best < longest
                  ? fmt::format("Mapping line that removes it: latency: {{{}: {:.1f}ms}}",
                                dataset_.target, delay_ms)
              : best == longest
                  ? "The search ends there: check the loggers' clocks."
                  : "Check the loggers' clocks: a torque cannot precede its deflection.");
        }
      });
}

void Checker::check_sign() {
  pass_unless_found(
      "sign", fmt::format("{} rises with {}", dataset_.target, spec_.inputs.front()), [&] {
        std::vector<double> values;
        for (const Pair& pair : pairs_) values.push_back(correlation(pair.input, pair.target));
        const std::string flipped = flipped_source(values);
        if (!flipped.empty()) std::ranges::fill(spoiled_, std::uint8_t{1});
        const bool some_rise =
            std::ranges::any_of(values, [](double value) { return value > kClearCorrelation; });
        for (std::size_t r = 0; r < values.size(); ++r) {
          const std::string& recording = dataset_.records[r].recording.name();
          if (!flipped.empty() && values[r] < kTogether) {
            add(Verdict::fail, "sign", recording,
                fmt::format("{} does not follow {} (correlation {:.3f}), but would with the sign "
                            "of {} inverted",
                            dataset_.target, spec_.inputs.front(), values[r], flipped),
                fmt::format(
                    "Mapping: channels: {{{0}: {{from: ..., sign: -1}}}}, with the column of {0}",
                    flipped));
          } else if (flips_[r] && flipped.empty()) {
            report_flip(r);
          } else if (values[r] < -kClearCorrelation) {
            add(Verdict::fail, "sign", recording,
                fmt::format("{} falls with {} (correlation {:.3f})", dataset_.target,
                            spec_.inputs.front(), values[r]),
                some_rise
                    ? fmt::format("In other recordings it rises: in this one {} has the wrong "
                                  "sign, or every angle has. Give it a mapping with sign: -1 "
                                  "(channels: {{{}: {{from: ..., sign: -1}}}})",
                                  dataset_.target, dataset_.target)
                    : fmt::format("Mapping: invert one of them with sign: -1 (channels: "
                                  "{{{}: {{from: ..., sign: -1}}}})",
                                  dataset_.target));
          } else if (values[r] < kClearCorrelation) {
            add(Verdict::warn, "sign", recording,
                fmt::format("{} hardly follows {} (correlation {:.3f})", dataset_.target,
                            spec_.inputs.front(), values[r]),
                "Check that the torque depends on this channel.");
          }
        }
      });
}

void Checker::report_flip(std::size_t r) {
  const Recording& recording = dataset_.records[r].recording;
  spoiled_[r] = 1;
  add(Verdict::fail, "sign", recording.name(),
      fmt::format("{0} {1} with {2} until t = {3:.4g} s and {4} with it from there (correlation "
                  "{5:.3f}, then {6:.3f})",
                  dataset_.target, flips_[r]->before > 0.0 ? "rises" : "falls",
                  spec_.inputs.front(), recording.time_s(flips_[r]->sample),
                  flips_[r]->after > 0.0 ? "rises" : "falls", flips_[r]->before, flips_[r]->after),
      "A sign changed while recording: cut the recording in two there, and invert one part.");
}

/// The one of two angles with whose inverted sign the torque follows their difference in every
/// recording, while it does not follow the difference as recorded; empty if there is none.
std::string Checker::flipped_source(const std::vector<double>& values) const {
  if (std::ranges::all_of(values, [](double v) { return v > kTogether; })) return {};
  bool is_first_minuend = true;
  double direction = 0.0;
  double narrowest = 1.0;
  for (std::size_t r = 0; r < pairs_.size(); ++r) {
    const int order = order_of_difference(r);
    if (order == 0) return {};
    is_first_minuend = order > 0;
    const Recording& recording = dataset_.records[r].recording;
    const std::vector<double>& first = recording.channel(sources_[0]).values;
    const std::vector<double>& second = recording.channel(sources_[1]).values;
    std::vector<double> sum(first.size());
    std::ranges::transform(first, second, sum.begin(), std::plus());
    const double now = correlation(sum, pairs_[r].target);
    if (std::abs(now) < kTogether || now * direction < 0.0) return {};
    direction = now;
    narrowest = std::min(narrowest, extent_of(sum).width() / extent_of(pairs_[r].input).width());
  }
  // Both sides of a spring turn in the same direction: their difference is small compared with
  // their sum.
  if (narrowest > kNarrow) return {};
  return is_first_minuend == (direction > 0.0) ? sources_[1] : sources_[0];
}

/// 1 if the first input is the first of its two sources minus the second, -1 if it is the second
/// minus the first, 0 if it is not a difference.
int Checker::order_of_difference(std::size_t r) const {
  if (sources_.size() != 2) return 0;
  const Recording& recording = dataset_.records[r].recording;
  const std::vector<double>& input = pairs_[r].input;
  const std::vector<double>& first = recording.channel(sources_[0]).values;
  const std::vector<double>& second = recording.channel(sources_[1]).values;
  const auto is_difference = [&](double sign) {
    for (std::size_t i = 0; i < input.size(); ++i)
      if (std::abs(input[i] - sign * (first[i] - second[i])) >
          1e-9 * (std::abs(first[i]) + std::abs(second[i])))
        return false;
    return true;
  };
  return is_difference(1.0) ? 1 : is_difference(-1.0) ? -1 : 0;
}

// Changes without a jump: a zero that drifts, a spring that breaks.
void Checker::check_change() {
  pass_unless_found("change", "each recording has the same relation early and late", [&] {
    for (std::size_t r = 0; r < pairs_.size(); ++r) {
      if (spoiled_[r] != 0) continue;
      const auto change = find_relation_change(pairs_[r], dataset_.sample_rate_Hz());
      if (!change) continue;
      const Recording& recording = dataset_.records[r].recording;
      const std::string when = change->is_gradual ? std::string("gradually from beginning to end")
                                                  : fmt::format("at about t = {:.3g} s",
                                                                recording.time_s(change->sample));
      add(Verdict::warn, "change", recording.name(),
          change->is_of_slope
              ? fmt::format("at equal {} and speed the slope of {} changes to {:.2g} times, {}",
                            spec_.inputs.front(), dataset_.target, change->slope_ratio, when)
              : fmt::format("at equal {} and speed {} changes by {:.3g} {}, {}",
                            spec_.inputs.front(), dataset_.target, change->offset,
                            unit_label(dataset_.target), when),
          "Check for a zero that slipped or drifted and for a part that broke or crept. A model "
          "would learn the mean of before and after.");
    }
  });
}

// Two recordings of one joint whose torques differ by a constant at the same deflection have
// different zeros.
void Checker::check_offsets() {
  pass_unless_found("offsets", "the recordings have the same zero", [&] {
    double slope = 0.0;
    double spread = 0.0;
    std::vector<Line> lines;
    std::vector<std::size_t> records;
    for (std::size_t r = 0; r < pairs_.size(); ++r) {
      if (spoiled_[r] != 0) continue;
      records.push_back(r);
      lines.push_back(line_through(pairs_[r]));
      slope += lines.back().slope;
      spread = std::max(spread, extent_of(pairs_[r].target).width());
    }
    if (lines.size() < 2) return;
    slope /= static_cast<double>(lines.size());
    std::vector<double> offsets;
    offsets.reserve(lines.size());
    for (const Line& line : lines) offsets.push_back(line.mean_target - slope * line.mean_input);
    std::vector<double> sorted = offsets;
    std::ranges::sort(sorted);
    const double median = sorted[sorted.size() / 2];
    for (std::size_t r = 0; r < offsets.size(); ++r)
      if (std::abs(offsets[r] - median) > kOffsetShare * spread)
        add(Verdict::warn, "offsets", dataset_.records[records[r]].recording.name(),
            fmt::format("the zero is {:.3g} {} away from that of the other recordings",
                        offsets[r] - median, unit_label(dataset_.target)),
            "Remove the zero of each recording in the mapping: zero: [{channel: ..., first: "
            "0.1s}]");
  });
}

}  // namespace torsio

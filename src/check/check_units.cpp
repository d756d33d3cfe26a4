// Units and scales: one number of an angle or a torque is a factor too large, in one recording or in all.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <numbers>
#include <string>
#include <string_view>
#include <vector>

#include "check/checker.hpp"
#include "check/mapping_advice.hpp"
#include "torsio/core/units.hpp"

namespace torsio {
namespace {

bool is_angle(std::string_view channel) {
  const auto parts = split_channel_name(channel);
  return parts && parts->unit->si_suffix == "rad";
}

/// Whether the name is that of the output side of a gear.
bool is_on_output_side(std::string_view channel) {
  return std::ranges::any_of(
      std::to_array<std::string_view>({"joint", "link", "load", "output"}),
      [&](std::string_view word) { return channel.find(word) != std::string_view::npos; });
}

/// The line with the scale of a channel multiplied by `factor`.
std::string scale_line(const Recording& recording, const std::string& name, double factor) {
  const auto rule = rule_of(recording, name);
  if (!rule || rule->scale == 1.0)
    return rule_advice(recording, name, fmt::format("scale: {:.6g}", factor));
  return fmt::format("Mapping: write scale: {:.9g} instead of {:.9g} into the rule of {}.",
                     factor * rule->scale, rule->scale, rule->name);
}

/// A ratio near a power of two is one.
double ratio_of_codes(double ratio) {
  constexpr double kNearPower = 0.02;
  const double power = std::exp2(std::round(std::log2(ratio)));
  return std::abs(ratio / power - 1.0) < kNearPower ? power : ratio;
}

/// What to do where one of two angles moves `ratio` times as far as the other one, and no unit has that factor.
std::string ratio_advice(const Recording& recording, const std::string& further,
                         const std::string& other, double ratio) {
  const auto rule_of_further = rule_of(recording, further);
  const auto rule_of_other = rule_of(recording, other);
  const bool has_ratio = rule_of_other && rule_of_other->gear_ratio != 1.0;
  const bool has_scale = (rule_of_further && rule_of_further->scale != 1.0) ||
                         (rule_of_other && rule_of_other->scale != 1.0);
  const double codes = ratio_of_codes(ratio);
  const bool is_before_gear = !is_on_output_side(further) || is_on_output_side(other);
  if (is_before_gear && !has_scale)
    return fmt::format(
        "That is as far as before a gear of about {1:.3g}: write its ratio in a mapping, with the "
        "column of {0}:  channels: {{{0}: {{from: ..., gear_ratio: {1:.3g}}}}}",
        further, ratio);
  std::string advice =
      "One of the two angles is wrong by that factor, and the recording does not "
      "show which one.";
  if (std::exp2(std::round(std::log2(codes))) == codes)
    advice +=
        " A power of two is that of encoders with another number of bits: compare the counts "
        "of a turn in their data sheets with the scales.";
  advice += fmt::format("\n         If {} moves too far:  {}", further,
                        scale_line(recording, further, 1.0 / codes));
  advice += has_ratio
                ? fmt::format(
                      "\n         If {0} was divided by its gear ratio once too often: remove "
                      "gear_ratio: from the rule of {0}.",
                      other)
                : fmt::format(
                      "\n         If {} does not move far enough, as where it was divided by "
                      "a gear ratio once too often:  {}",
                      other, scale_line(recording, other, codes));
  if (is_before_gear)
    advice +=
        fmt::format("\n         If {} is before a gear:  {}", further,
                    rule_advice(recording, further, fmt::format("gear_ratio: {:.3g}", ratio)));
  return advice;
}

}  // namespace

// The sensors of both sides of a spring turn by the same angle, so one of them in another unit
// turns by a unit's factor as much; and recordings of one joint have one stiffness.
void Checker::check_units() {
  pass_unless_found("units", "the recordings agree", [&] {
    for_each_record([&](std::size_t r) {
      check_units_within(r);
      if (coded_[r] == 0) check_rates_of(r);
      if (spoiled_[r] == 0 && !changes_[r] && !positions_[r]) check_scale(r);
      if (spoiled_[r] == 0) check_twist(r);
    });
    compare_slopes();
    for_each_record([&](std::size_t r) {
      if (spoiled_[r] == 0) check_load(r);
    });
  });
}

void Checker::compare_slopes() {
  if (pairs_.size() < 2) return;
  std::vector<double> slopes(pairs_.size(), 0.0);
  for_each_record([&](std::size_t r) {
    if (is_clear(r)) slopes[r] = std::abs(line_through(pairs_[r]).slope);
  });
  const std::size_t usual = usual_slope(slopes);
  const auto near_usual = std::ranges::count_if(slopes, [&](double slope) {
    return slope > 0.0 && ratio_of(slope, slopes[usual]) < kSlopeRatio;
  });
  for (std::size_t r = 0; r < pairs_.size(); ++r)
    if (slopes[r] > 0.0 && ratio_of(slopes[r], slopes[usual]) >= kSlopeRatio)
      report_slope(r, slopes[r], usual, slopes[usual], near_usual > 1);
}

void Checker::report_slope(std::size_t r, double slope, std::size_t usual, double usual_slope,
                           bool is_majority) {
  const Recording& other = dataset_.records[usual].recording;
  const double torque_ratio =
      extent_of(pairs_[r].target).width() / extent_of(pairs_[usual].target).width();
  const bool by_torque =
      std::abs(std::log(torque_ratio)) > 0.5 * std::log(ratio_of(slope, usual_slope));
  const std::string_view mistake =
      unit_mistake(slope / usual_slope, !by_torque && is_angle(spec_.inputs.front()));
  if (mistake.empty() && !other.conditions().empty()) return;  // the condition explains it
  spoiled_[r] = 1;
  const std::string& own = dataset_.records[r].recording.name();
  add(mistake.empty() ? Verdict::warn : Verdict::fail, "units",
      is_majority ? own : own + " or " + other.name(),
      fmt::format("the slope of {} over {} is {:.4g} times {} in {} than in {}{}", dataset_.target,
                  spec_.inputs.front(), ratio_of(slope, usual_slope),
                  slope > usual_slope ? "larger" : "smaller", own,
                  is_majority ? "the other recordings, as in " : "", other.name()),
      mistake.empty()
          ? "Check spring, units and gear ratio: recordings of one joint have one stiffness."
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
  const bool are_angles = is_angle(sources_[0]) && is_angle(sources_[1]);
  const double ratio = std::max(slope, 1.0 / slope);
  const std::string_view mistake = unit_mistake(slope, are_angles);
  // With a locked gear the joint alone turns, and the torque follows.
  const bool is_without_ratio =
      are_angles && ratio >= kLowestGearRatio &&
      std::abs(correlation(pairs_[r].input, pairs_[r].target)) < kTogether;
  if (mistake.empty() && !is_without_ratio) return;
  spoiled_[r] = 1;
  const std::string& further = slope > 1.0 ? sources_[1] : sources_[0];
  const std::string& other = slope > 1.0 ? sources_[0] : sources_[1];
  add(Verdict::fail, "units", recording.name(),
      fmt::format("{} moves {:.4g} times as far as {}", further, ratio, other),
      mistake.empty()
          ? ratio_advice(recording, further, other,
                         sides_[r] ? ratio_of(1.0 + sides_[r]->excess, 1.0) : ratio)
          : fmt::format("That is the factor between {}: specify the column's unit in its name or "
                        "with unit: in a mapping.",
                        mistake));
}

/// The range without the outermost hundredth of the samples on either side.
double Checker::inner_range(const std::vector<double>& values) {
  std::vector<double> finite;
  finite.reserve(values.size());
  std::ranges::copy_if(values, std::back_inserter(finite), is_finite);
  if (finite.empty()) return 0.0;
  const auto outer = static_cast<std::ptrdiff_t>(kOuter * static_cast<double>(finite.size()));
  const auto low = finite.begin() + outer;
  const auto high = finite.end() - 1 - outer;
  std::ranges::nth_element(finite, low);
  const double lowest = *low;
  std::ranges::nth_element(low, high, finite.end());
  return *high - lowest;
}

// A torque in mNm in every recording: nothing in the recordings contradicts it.
void Checker::check_load(std::size_t r) {
  const auto parts = split_channel_name(dataset_.target);
  if (!parts || parts->unit->si_suffix != "Nm") return;
  const double range_Nm = inner_range(pairs_[r].target);
  if (range_Nm < kHighestLoad_Nm) return;
  add(Verdict::warn, "units", dataset_.records[r].recording.name(),
      fmt::format("{} ranges through {:.3g} Nm", dataset_.target, range_Nm),
      "Hardly any joint with a spring carries so much: check the unit of the torque.");
}

// A wrong unit of both angles, or a column that contains another quantity.
void Checker::check_twist(std::size_t r) {
  if (!is_angle(sources_.front())) return;
  if (order_of_difference(r) == 0 && spec_.inputs.front() != "spring_deflection_rad") return;
  const double width = inner_range(pairs_[r].input);
  if (width < kWidestTwist_rad) return check_turns_between(r);
  spoiled_[r] = 1;
  add(Verdict::warn, "units", dataset_.records[r].recording.name(),
      fmt::format("{} ranges through {:.3g} rad, {:.2g} turns", spec_.inputs.front(), width,
                  width / (2.0 * std::numbers::pi)),
      "No spring of a joint twists so far: check the unit of the angles, their gear ratio, a wrap "
      "by one turn, and whether two columns were interchanged.");
}

// An encoder of one turn that began on another turn than the other one.
void Checker::check_turns_between(std::size_t r) {
  const int order = order_of_difference(r);
  if (order == 0) return;
  const Extent extent = extent_of(pairs_[r].input);
  const double middle = 0.5 * (extent.lowest + extent.highest);
  constexpr double kTurn_rad = 2.0 * std::numbers::pi;
  const double turns = std::round(middle / kTurn_rad);
  if (turns == 0.0 || std::abs(middle - turns * kTurn_rad) > kLargestZero_rad) return;
  const Recording& recording = dataset_.records[r].recording;
  const std::string& subtrahend = sources_[order > 0 ? 1 : 0];
  add(Verdict::warn, "units", recording.name(),
      fmt::format("{} is near {:.4g} rad throughout, {:g} whole turn{} and not 0",
                  spec_.inputs.front(), middle, std::abs(turns), std::abs(turns) == 1.0 ? "" : "s"),
      "One of the two encoders began on another turn. " +
          rule_advice(recording, subtrahend, fmt::format("offset: {:.9g}", turns * kTurn_rad)));
}

// The sensors of both sides of a spring turn by the same angle, apart from the deflection.
void Checker::check_scale(std::size_t r) {
  const auto& sides = sides_[r];
  if (!sides || !has_wrong_scale(*sides)) return;
  if (std::abs(sides->excess) < kScaleOfAGear) return;  // no pair of gears: `check_position`
  spoiled_[r] = 1;
  add(Verdict::fail, "units", dataset_.records[r].recording.name(),
      fmt::format("{} moves {:.4g} times as far as {}, apart from the deflection that {} explains",
                  sources_[0], 1.0 + sides->excess, sources_[1], dataset_.target),
      "Both sides of a spring turn by the same angle: check the gear ratio and the scale of the "
      "columns (scale: in a mapping).");
}

}  // namespace torsio

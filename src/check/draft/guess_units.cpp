// Units that neither the name nor a row of units states.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <numbers>

#include "check/draft/column_relations.hpp"
#include "check/draft/draft_steps.hpp"
#include "check/rate_factor.hpp"
#include "data/mapping/unit_words.hpp"
#include "torsio/core/units.hpp"

namespace torsio {
namespace {

/// A logger whose files never state their units.
struct Logger {
  std::string_view name;
  std::array<std::string_view, 3> names;  ///< each is part of a column's name
  std::string_view angle;
  std::string_view speed;
};
constexpr auto kLoggers = std::to_array<Logger>({
    {"ODrive", {"pos_estimate", "vel_estimate", ""}, "rev", "rev_s"},
    {"moteus", {"position", "q_current", "d_current"}, "rev", "rev_s"},
});

constexpr double kLargestCurrent_A = 200.0;
constexpr double kLargestTorque_Nm = 2000.0;

bool is_ros(std::string_view column) {
  return column.starts_with('/') && column.find('/', 1) != std::string_view::npos;
}

/// The "mdeg" in "ActPos[mdeg]"; a number there may be an index. Empty: the name does not end in brackets.
std::string_view text_in_brackets(std::string_view column) {
  if (column.empty() || (column.back() != ']' && column.back() != ')')) return {};
  const auto open = column.find_last_of(column.back() == ']' ? '[' : '(');
  if (open == std::string_view::npos || open == 0 ||
      std::isdigit(static_cast<unsigned char>(column[open + 1])) != 0)
    return {};
  return without_frame(column.substr(open));
}

const Logger* logger_of(const LogTable& table) {
  const auto has = [&](std::string_view part) {
    return std::ranges::any_of(table.columns, [&](const LogColumn& column) {
      return column.name.find(part) != std::string::npos;
    });
  };
  const auto* const at = std::ranges::find_if(
      kLoggers, [&](const Logger& logger) { return std::ranges::all_of(logger.names, has); });
  return at == kLoggers.end() ? nullptr : &*at;
}

double size_of(const ColumnSummary& summary) {
  return std::max(std::abs(summary.lowest), std::abs(summary.highest));
}

void take_unit(ColumnGuess& guess, std::string_view unit, Certainty at_most, std::string reason) {
  guess.unit = unit;
  guess.add(at_most, std::move(reason));
}

/// What the user has to complete.
std::string scale_of_counts(Quantity quantity) {
  if (quantity == Quantity::angle || quantity == Quantity::deflection)
    return "unit: rev, scale: 1/COUNTS";
  return fmt::format("unit: {}, scale: FACTOR", si_unit_of(quantity));
}

/// Whole numbers over more than a revolution of any other unit, or the word itself.
bool is_counted(const std::vector<double>& values, const ColumnSummary& summary,
                const NameReading& reading) {
  constexpr double kManyCounts = 100.0;
  return reading.is_counted ||
         (has_integers_only(values) && summary.highest - summary.lowest > kManyCounts);
}

/// By the range: a joint does not turn by ten revolutions, nor by less than a degree.
void guess_angle(ColumnGuess& guess, const NameReading& reading) {
  guess.assumption = guess.reasons.size();
  const double width = guess.summary.highest - guess.summary.lowest;
  const double size = size_of(guess.summary);
  const bool is_motor = reading.side == Side::motor;
  const bool is_small = reading.quantity == Quantity::deflection;
  constexpr double kTurn_rad = 2.0 * std::numbers::pi;
  const bool is_rad = is_small ? size < 1.0 : width <= kTurn_rad && size <= 2.0 * kTurn_rad;
  if (is_rad)
    take_unit(guess, "rad", is_motor ? Certainty::unsure : Certainty::likely,
              fmt::format("values: a range of {:.3g} fits radians", width));
  else if (width > 4.0 * kTurn_rad && !is_motor)
    take_unit(guess, "deg", Certainty::likely,
              fmt::format("values: a range of {:.3g} fits degrees", width));
  else
    take_unit(guess, is_motor ? "rad" : "deg", Certainty::unsure,
              fmt::format("values: a range of {:.3g} fits radians and degrees", width));
}

/// @param is_before_spring the angle of the motor is the one that is nearest to the spring
void guess_by_values(ColumnGuess& guess, const NameReading& reading,
                     const std::vector<double>& values, bool is_before_spring) {
  const double size = size_of(guess.summary);
  const auto usual = [&](std::string_view unit, bool is_plausible) {
    take_unit(guess, unit, is_plausible ? Certainty::likely : Certainty::unsure,
              fmt::format("values: up to {:.3g}, {} {}", size,
                          is_plausible ? "plausible in" : "much for", unit));
  };
  if (is_counted(values, guess.summary, reading) && reading.quantity == Quantity::angle &&
      reading.side == Side::motor && !reading.is_goal && is_before_spring) {
    guess.channel = "gear_angle_rad";
    guess.needs_ratio = true;
    guess.missing =
        "counts of the motor's encoder: write those of one turn of the motor in the place of "
        "COUNTS and the gear ratio in that of N (1: without gear)";
    guess.scale = scale_of_counts(reading.quantity);
    guess.add(Certainty::unsure, "values: counts");
    return;
  }
  if (is_counted(values, guess.summary, reading) && reading.quantity != Quantity::mask) {
    guess.missing = "whole numbers: the size of one, with unit: and scale:";
    guess.scale = scale_of_counts(reading.quantity);
    guess.add(Certainty::unsure, "values: counts");
    return;
  }
  switch (reading.quantity) {
    case Quantity::angle:
    case Quantity::deflection: return guess_angle(guess, reading);
    case Quantity::torque: return usual("Nm", size <= kLargestTorque_Nm);
    case Quantity::current: return usual("A", size <= kLargestCurrent_A);
    case Quantity::voltage: return usual("V", size <= 1000.0);
    case Quantity::temperature:
      return size > 200.0 ? usual("K", size < 500.0) : usual("degC", true);
    case Quantity::duty: return usual("1", size <= 1.0);
    case Quantity::speed:
    case Quantity::deflection_rate:
      guess.assumption = guess.reasons.size();
      return take_unit(guess, "rad_s", Certainty::unsure, "values: no angle to compare with");
    case Quantity::force:
    default: return;
  }
}

/// Units of an angle and of its rate that belong together.
constexpr auto kRates = std::to_array<std::pair<std::string_view, std::string_view>>(
    {{"rad_s", "rad"}, {"deg_s", "deg"}, {"rpm", "rev"}, {"rev_s", "rev"}});

/// The unit of a speed that is its factor from the derivative; empty if none is.
std::string_view unit_of_speed(double factor_to_si) {
  constexpr double kNear = 0.06;
  for (const auto& [speed, angle] : kRates)
    if (std::abs(std::abs(factor_to_si) * find_unit(speed)->scale - 1.0) < kNear) return speed;
  return {};
}

/// A speed whose unit is not stated, by the angle of the same side; an angle by the speed.
void compare_with_angle(DraftWork& work, std::size_t speed) {
  ColumnGuess& guess = work.draft.columns[speed];
  if (work.draft.rate_Hz <= 0.0) return;
  for (const std::size_t angle : work.measured(Quantity::angle)) {
    ColumnGuess& of_angle = work.draft.columns[angle];
    const Side side = work.readings[angle].side;
    if (work.readings[speed].side != side && work.readings[speed].side != Side::unknown) continue;
    const auto found =
        factor_of_rate(work.values(speed), work.si_values(angle), work.draft.rate_Hz);
    if (!found) continue;
    const std::string_view unit = unit_of_speed(found->factor);
    if (unit.empty()) continue;
    guess.sign = found->factor < 0.0 ? -1.0 : 1.0;
    guess.certainty = of_angle.certainty;
    guess.replace_assumption(unit, Certainty::likely,
                             fmt::format("relation: {:.4g} times the derivative of '{}' in {}",
                                         found->factor, of_angle.summary.name, of_angle.unit));
    if (guess.sign < 0.0) guess.add(Certainty::unsure, "relation: sign opposite to the angle");
    if (work.readings[speed].side == Side::unknown) {
      work.readings[speed].side = side;
      guess.channel = channel_of(Quantity::speed, side, false) + "_rad_s";
    }
    return;
  }
}

/// What a column was before its gear.
Side side_of_angle(const ColumnGuess& angle, const NameReading& reading) {
  return angle.gear_ratio != 1.0 ? Side::motor : reading.side;
}

void guess_side_of_speed(DraftWork& work, std::size_t speed) {
  constexpr double kNear = 0.06;
  ColumnGuess& guess = work.draft.columns[speed];
  for (const std::size_t angle : work.measured(Quantity::angle)) {
    const ColumnGuess& of_angle = work.draft.columns[angle];
    const auto found =
        factor_of_rate(work.si_values(speed), work.si_values(angle), work.draft.rate_Hz);
    if (!found || std::abs(std::abs(found->factor) - 1.0) > kNear) continue;
    const Side side = side_of_angle(of_angle, work.readings[angle]);
    work.readings[speed].side = side;
    guess.channel = channel_of(Quantity::speed, side, false) + "_rad_s";
    if (found->factor < 0.0) guess.sign = -guess.sign;
    guess.add(found->factor < 0.0 ? Certainty::unsure : Certainty::likely,
              fmt::format("relation: the derivative of '{}'{}", of_angle.summary.name,
                          found->factor < 0.0 ? " with the opposite sign" : ""));
    return;
  }
}

}  // namespace

void guess_sides_of_speeds(DraftWork& work) {
  if (work.draft.rate_Hz <= 0.0) return;
  for (const std::size_t speed : work.measured(Quantity::speed))
    if (work.readings[speed].side == Side::unknown) guess_side_of_speed(work, speed);
}

void guess_units(DraftWork& work) {
  const Logger* const logger = logger_of(work.table);
  const bool is_before_spring = std::ranges::none_of(work.readings, [](const NameReading& reading) {
    return reading.quantity == Quantity::angle && reading.side == Side::gear;
  });
  for (std::size_t i = 0; i < work.size(); ++i) {
    ColumnGuess& guess = work.draft.columns[i];
    const std::string_view in_brackets = text_in_brackets(guess.summary.name);
    if (is_count(in_brackets)) work.readings[i].is_counted = true;
    const NameReading& reading = work.readings[i];
    if (guess.channel.empty() || !guess.unit.empty() || guess.channel == "t_s") continue;
    const std::string_view si = si_unit_of(reading.quantity);
    const bool is_angle = reading.quantity == Quantity::angle;
    const Unit* const word = find_unit(reading.unit);
    if (guess.summary.measured == 0) {
      guess.missing = "it has no numbers";
    } else if (const std::string& written = work.table.columns[i].unknown_unit;
               is_gradian_or_degree(written)) {
      guess.missing = kAdviceOnGradians;
      guess.scale = "unit: deg";
      guess.add(Certainty::unsure, fmt::format("unit: '{}' (row of units)", written));
    } else if (!written.empty() && !is_count(written)) {
      guess.missing = fmt::format("the size of its unit '{}', with unit: and scale:", written);
      guess.scale = scale_of_counts(reading.quantity);
      guess.add(Certainty::unsure, "unit: in the row of units, not known");
    } else if (!in_brackets.empty() && !is_count(in_brackets)) {
      guess.missing = "the size of the unit in its brackets, with unit: and scale:";
      guess.scale = scale_of_counts(reading.quantity);
      guess.add(Certainty::unsure, "unit: in brackets, not known");
    } else if (word != nullptr && word->si_suffix == si) {
      take_unit(guess, word->suffix, Certainty::likely,
                fmt::format("unit: {} (word in the name)", word->suffix));
    } else if (logger != nullptr && (is_angle || reading.quantity == Quantity::speed)) {
      take_unit(guess, is_angle ? logger->angle : logger->speed, Certainty::likely,
                fmt::format("unit: {} writes revolutions", logger->name));
    } else if (is_ros(guess.summary.name) && !si.empty() &&
               reading.quantity != Quantity::temperature) {
      take_unit(guess, si, Certainty::likely, "unit: SI, as ROS prescribes (REP 103)");
    } else {
      guess_by_values(guess, reading, work.values(i), is_before_spring);
    }
    if (guess.unit.empty() && guess.missing.empty())
      guess.missing = reading.quantity == Quantity::force
                          ? "a force: its lever arm, as  torque_Nm: {from: .., scale: ARM_m}"
                          : "its unit";
  }
  for (const std::size_t speed : work.measured(Quantity::speed))
    if (work.draft.columns[speed].assumption) compare_with_angle(work, speed);
}

}  // namespace torsio

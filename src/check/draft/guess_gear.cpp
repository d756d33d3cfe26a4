// Sides, gear ratio and signs: how the angles move together, and with the torque.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <utility>

#include "check/draft/column_relations.hpp"
#include "check/draft/draft_steps.hpp"
#include "check/signal_faults.hpp"
#include "check/signal_pair.hpp"
#include "torsio/core/units.hpp"

namespace torsio {
namespace {

constexpr double kMovesTogether = 0.5;  ///< share of the variance below which nothing is stated
constexpr double kMovesMuch = 0.99;
constexpr double kDoubtful = 0.05;       ///< share of the ratio that is not determined: no ratio
constexpr double kSomeDoubt = 0.01;      ///< up to here a ratio may be sure
constexpr double kTogether = 0.9;        ///< correlation of joint and torque
constexpr double kFreeTravel_rad = 1.0;  ///< five times what most springs of joints twist
constexpr double kDoubtOfSign = 0.3;
constexpr double kByTorque = 0.1;    ///< share of what is left that shows the torque's sign
constexpr double kLeastRatio = 1.5;  ///< for an angle that is named after the gear
constexpr double kSameSide = 0.1;    ///< a ratio that differs less from 1 is none

constexpr std::size_t kNone = static_cast<std::size_t>(-1);

std::size_t of_side(const DraftWork& work, Side side) {
  for (const std::size_t i : work.measured(Quantity::angle))
    if (work.readings[i].side == side) return i;
  return kNone;
}

/// Without steps where a slow sensor holds its value.
std::vector<double> moving(const DraftWork& work, const LogTable& table, std::size_t column) {
  return bridged_or_held(
      {.name = work.draft.columns[column].channel, .values = work.si_values(table, column)});
}

/// @param torque may be `kNone`
std::vector<JointLog> logs_of(const DraftWork& work, std::size_t motor, std::size_t joint,
                              std::size_t torque = kNone) {
  std::vector<JointLog> logs;
  const auto add = [&](const LogTable& table) {
    logs.push_back(
        {.motor = moving(work, table, motor),
         .joint = moving(work, table, joint),
         .torque = torque == kNone ? std::vector<double>() : moving(work, table, torque)});
  };
  add(work.table);
  for (const LogTable& other : work.others) add(other);
  return logs;
}

void take_side(DraftWork& work, std::size_t column, Side side, Certainty at_most,
               std::string reason) {
  ColumnGuess& guess = work.draft.columns[column];
  work.readings[column].side = side;
  guess.channel = channel_of(Quantity::angle, side, false) + "_rad";
  guess.add(at_most, std::move(reason));
}

/// The two angles before and after the spring, whatever the names state.
struct Angles {
  std::size_t before = kNone;
  std::size_t after = kNone;
  bool is_after_gear = false;  ///< by its name, the first one
};

Angles angles_by_name(const DraftWork& work) {
  Angles angles{.before = of_side(work, Side::motor), .after = of_side(work, Side::joint)};
  if (const std::size_t gear = of_side(work, Side::gear); gear != kNone) {
    if (angles.after == kNone) angles.after = gear == angles.before ? kNone : angles.after;
    angles.before = gear;  // nearer to the spring than the rotor
    angles.is_after_gear = true;
  }
  return angles;
}

/// Two angles, at least one of unknown side: the one that moves farther is the motor's.
Angles angles_by_width(DraftWork& work, Angles angles) {
  std::vector<std::size_t> unknown;
  for (const std::size_t i : work.measured(Quantity::angle))
    if (work.readings[i].side == Side::unknown) unknown.push_back(i);
  if (unknown.size() == 1 && (angles.before == kNone) != (angles.after == kNone)) {
    const bool is_joint = angles.after == kNone;
    take_side(work, unknown.front(), is_joint ? Side::joint : Side::gear, Certainty::unsure,
              "name: the other side is named");
    (is_joint ? angles.after : angles.before) = unknown.front();
  } else if (unknown.size() == 1 && angles.before == kNone) {
    take_side(work, unknown.front(), Side::joint, Certainty::likely, "the only angle");
  } else if (unknown.size() == 2 && angles.before == kNone && angles.after == kNone) {
    const auto width = [&](std::size_t i) {
      const ColumnGuess& guess = work.draft.columns[i];
      const Unit* const unit = find_unit(guess.unit);
      return unit->scale * (guess.summary.highest - guess.summary.lowest);
    };
    const bool is_first = width(unknown[0]) >= width(unknown[1]);
    angles.before = unknown[is_first ? 0 : 1];
    angles.after = unknown[is_first ? 1 : 0];
    take_side(work, angles.before, Side::gear, Certainty::unsure,
              "relation: moves farther than the other angle");
    take_side(work, angles.after, Side::joint, Certainty::unsure,
              "relation: moves less than the other angle");
  }
  return angles;
}

/// The unit of the motor's angle in which the ratio is one that gears have; the present one otherwise.
std::string_view unit_by_ratio(const ColumnGuess& motor, double factor) {
  if (!motor.assumption) return motor.unit;
  const double now = find_unit(motor.unit)->scale;
  std::vector<std::string_view> possible;
  for (const std::string_view unit : {"rad", "deg", "rev"}) {
    const double ratio = std::abs(factor) * find_unit(unit)->scale / now;
    if (ratio < 0.95 || ratio > kLargestRatio) continue;
    if (std::abs(ratio - std::round(ratio)) < 0.003 * ratio) return unit;
    possible.push_back(unit);
  }
  return possible.size() == 1 ? possible.front() : std::string_view(motor.unit);
}

Certainty certainty_of(const GearFit& fit, double ratio) {
  const bool is_whole = ratio == std::round(ratio);
  if (fit.doubt > kSomeDoubt) return Certainty::unsure;
  if (fit.explained > 0.9999 && is_whole) return Certainty::sure;
  if (fit.explained > kMovesMuch && (is_whole || fit.error < 1e-3 * ratio))
    return Certainty::likely;
  return Certainty::unsure;
}

/// Why a ratio is no more than `unsure`; empty if it is more.
std::string reason_of_doubt(const GearFit& fit, double ratio) {
  if (certainty_of(fit, ratio) != Certainty::unsure) return {};
  if (fit.doubt > kSomeDoubt)
    return fmt::format(", and {:.4g} to {:.4g} fit alike", (1.0 - fit.doubt) * ratio,
                       (1.0 + fit.doubt) * ratio);
  if (fit.explained > kMovesMuch)
    return fmt::format(", no whole number and determined to {:.2g} % only",
                       100.0 * fit.error / ratio);
  return fmt::format(", which explains {:.3g} % of the variance of its motion only",
                     100.0 * fit.explained);
}

/// The ratio is not written, since others fit as well.
void leave_ratio_open(DraftWork& work, const Angles& angles, const GearFit& fit) {
  ColumnGuess& motor = work.draft.columns[angles.before];
  const std::string& joint = work.draft.columns[angles.after].summary.name;
  const double ratio = std::abs(fit.factor);
  work.readings[angles.before].side = Side::gear;
  motor.channel = "gear_angle_rad";
  motor.add(Certainty::unsure,
            fmt::format("relation: {:.3g} to {:.3g} times '{}' fit alike",
                        std::max(1.0 - fit.doubt, 0.0) * ratio, (1.0 + fit.doubt) * ratio, joint));
  if (angles.is_after_gear) return;
  motor.needs_ratio = true;
  motor.missing = fmt::format(
      "the gear ratio: '{}' {}. Write the ratio in the place of N, or give torsio map a second log "
      "in which the joint moves without load through {:g} rad or more, five times what the spring "
      "twists:  torsio map LOG FREE_LOG",
      joint,
      std::abs(fit.together) > kTogether
          ? fmt::format("and the torque move together (correlation {:.2f})", fit.together)
          : "moves too little beside the spring",
      kFreeTravel_rad);
}

void take_ratio(DraftWork& work, const Angles& angles, GearFit fit) {
  ColumnGuess& motor = work.draft.columns[angles.before];
  const std::string& joint = work.draft.columns[angles.after].summary.name;
  const std::string_view unit = unit_by_ratio(motor, fit.factor);
  const double change = find_unit(unit)->scale / find_unit(motor.unit)->scale;
  fit.factor *= change;
  fit.error *= change;
  const double ratio = plausible_ratio(fit);
  if (unit != motor.unit)
    motor.replace_assumption(unit, Certainty::unsure,
                             fmt::format("relation: only in {} is the ratio one of a gear", unit));
  if (fit.factor < 0.0) motor.sign = -motor.sign;
  std::string reason =
      fmt::format("relation: {:.5g} +- {:.1g} times '{}'", fit.factor, fit.error, joint);
  const bool is_after_gear = work.readings[angles.before].side == Side::gear &&
                             !(ratio >= kLeastRatio && ratio == std::round(ratio));
  motor.channel = "gear_angle_rad";
  work.readings[angles.before].side = Side::gear;
  if (is_after_gear || std::abs(ratio - 1.0) < kSameSide) {
    motor.add(fit.explained > kMovesMuch ? Certainty::sure : Certainty::likely,
              is_after_gear ? reason : reason + ", so that it is after the gear");
  } else if (ratio < 1.0 || ratio > kLargestRatio) {
    motor.add(Certainty::unsure, reason);
    motor.missing = "the gear ratio: check the units of both angles";
  } else {
    motor.gear_ratio = ratio;
    motor.add(certainty_of(fit, ratio), reason + reason_of_doubt(fit, ratio));
  }
  if (motor.sign < 0.0)
    motor.add(Certainty::unsure, "relation: one of the two angles has the wrong sign");
}

/// An elastic load moves the spring with the joint, which only a torque shows.
void limit_without_torque(DraftWork& work, const Angles& angles) {
  double width_rad = 0.0;
  const auto include = [&](const LogTable& table) {
    width_rad = std::max(width_rad, extent_of(work.si_values(table, angles.after)).width());
  };
  include(work.table);
  for (const LogTable& other : work.others) include(other);
  work.draft.columns[angles.before].add(
      width_rad < kFreeTravel_rad ? Certainty::unsure : Certainty::likely,
      width_rad < kFreeTravel_rad ? "relation: without a torque the twist of the spring is in it"
                                  : "");
}

void take_sign_of_torque(DraftWork& work, std::size_t torque, bool rises) {
  ColumnGuess& guess = work.draft.columns[torque];
  if (!rises) guess.sign = -guess.sign;
  guess.add(rises ? Certainty::sure : Certainty::likely,
            rises ? "relation: rises with the deflection"
                  : "relation: falls with the deflection, so that its sign is inverted");
}

enum class SignOfTorque : std::uint8_t { shown, hidden_by_joint, not_shown };

SignOfTorque sign_by_angles(DraftWork& work, const GearFit& fit, std::size_t torque) {
  if (std::abs(fit.together) > kTogether && fit.doubt_of_torque > kDoubtOfSign)
    return SignOfTorque::hidden_by_joint;
  if (fit.by_torque < kByTorque || !shows_sign(fit)) return SignOfTorque::not_shown;
  take_sign_of_torque(work, torque, fit.per_torque * fit.factor > 0.0);
  return SignOfTorque::shown;
}

/// A recorded deflection. Where the angles show the sign of the torque, the deflection takes it over.
/// @returns whether it shows the sign of the torque
bool compare_with_deflection(DraftWork& work, std::size_t torque, bool is_sign_shown) {
  const std::vector<std::size_t> deflections = work.measured(Quantity::deflection);
  if (deflections.empty()) return false;
  const auto fit = fit_gear(logs_of(work, deflections.front(), torque));
  if (!fit || fit->explained < kMovesTogether) return false;
  const bool rises = fit->factor > 0.0;
  if (!is_sign_shown) {
    take_sign_of_torque(work, torque, rises);
  } else if (!rises) {
    ColumnGuess& deflection = work.draft.columns[deflections.front()];
    deflection.sign = -deflection.sign;
    deflection.add(Certainty::likely,
                   "relation: opposite to the difference of the angles, so that its sign is "
                   "inverted");
  }
  return true;
}

/// @param fit of the angles; null: they show nothing
void guess_sign_of_torque(DraftWork& work, const GearFit* fit, std::size_t torque) {
  if (torque == kNone) return;
  const SignOfTorque by_angles =
      fit != nullptr ? sign_by_angles(work, *fit, torque) : SignOfTorque::not_shown;
  if (compare_with_deflection(work, torque, by_angles == SignOfTorque::shown)) return;
  if (by_angles == SignOfTorque::hidden_by_joint)
    work.draft.columns[torque].add(
        Certainty::unsure,
        "relation: it moves together with the joint, which does not show its sign");
}

std::size_t torque_of_spring(const DraftWork& work) {
  for (const std::size_t i : work.measured(Quantity::torque))
    if (work.readings[i].side != Side::motor) return i;
  return kNone;
}

}  // namespace

void guess_gear(DraftWork& work) {
  const Angles angles = angles_by_width(work, angles_by_name(work));
  const std::size_t torque = torque_of_spring(work);
  if (angles.before == kNone || angles.after == kNone || angles.before == angles.after)
    return guess_sign_of_torque(work, nullptr, torque);
  ColumnGuess& before = work.draft.columns[angles.before];
  const auto fit = fit_gear(logs_of(work, angles.before, angles.after, torque));
  if (!fit || !moves_with_joint(*fit)) {
    before.add(Certainty::unsure, fit ? "relation: it does not move with the joint"
                                      : "relation: one of the angles does not move");
    if (work.readings[angles.before].side == Side::motor) {
      before.channel = "gear_angle_rad";
      before.needs_ratio = true;
      before.missing = "the gear ratio, which the angles do not show: write it in the place of N";
    }
    return guess_sign_of_torque(work, nullptr, torque);
  }
  if (fit->doubt > kDoubtful)
    leave_ratio_open(work, angles, *fit);
  else
    take_ratio(work, angles, *fit);
  if (torque == kNone && fit->doubt <= kDoubtful && before.gear_ratio != 1.0)
    limit_without_torque(work, angles);
  guess_sign_of_torque(work, &*fit, torque);
}

}  // namespace torsio

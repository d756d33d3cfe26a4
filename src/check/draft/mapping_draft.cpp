#include "check/draft/mapping_draft.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <optional>
#include <utility>

#include "check/draft/column_relations.hpp"
#include "check/draft/draft_steps.hpp"
#include "data/mapping/column_advice.hpp"
#include "data/mapping/columns.hpp"
#include "data/mapping/measured_recordings.hpp"
#include "data/mapping/unit_words.hpp"
#include "data/names.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/units.hpp"
#include "torsio/data/load.hpp"

namespace torsio {
namespace {

/// A name without what is in brackets or its unit, whose letters would be read as words.
std::string_view name_without_unit(const ColumnSummary& summary) {
  const std::string_view name = summary.name;
  if (summary.unit_origin == UnitOrigin::brackets)
    return name.substr(0, name.find_last_of("[(\xc2"));
  if (const auto parts = split_channel_name(name); parts && summary.unit_origin == UnitOrigin::name)
    return parts->quantity;
  return name;
}

/// "theta_m" is an angle of the motor, not one in metres; a position may be in metres.
bool ends_in_letter(const ColumnSummary& summary) {
  if (summary.unit_origin != UnitOrigin::name || summary.unit.size() != 1 || summary.unit == "1")
    return false;
  const NameReading reading = read_name(name_without_unit(summary));
  const std::string_view si = si_unit_of(reading.quantity);
  return !si.empty() && !reading.word.starts_with("pos") &&
         reading.quantity != Quantity::temperature && si != find_unit(summary.unit)->si_suffix;
}

void require_numbers(const LogTable& table) {
  const bool has_numbers = std::ranges::any_of(table.columns, [](const LogColumn& column) {
    return std::ranges::any_of(column.values, [](double x) { return std::isfinite(x); });
  });
  if (has_numbers) return;
  throw Error({.place = table.source.file,
               .problem = "no column of numbers",
               .expected = "a recording with at least a time and one measured quantity",
               .found = table.column_list(),
               .advice = "torsio check --list shows what a file contains."});
}

void require_motion(const LogTable& table, const MappingDraft& draft) {
  const bool moves = std::ranges::any_of(draft.columns, [](const ColumnGuess& guess) {
    return guess.channel != "t_s" && guess.summary.fresh > 1;
  });
  if (moves) return;
  throw Error({.place = table.source.file,
               .problem = draft.columns.size() > 1 ? "all columns are constant"
                                                   : "the only column is a time or constant",
               .expected = "columns whose values change",
               .found = table.column_list(),
               .advice = "Record while the joint moves, or name the right file."});
}

void require_same_columns(const LogTable& first, const LogTable& other) {
  const bool is_same =
      std::ranges::equal(first.columns, other.columns, [](const LogColumn& a, const LogColumn& b) {
        return a.name == b.name && a.unit == b.unit && a.unknown_unit == b.unknown_unit;
      });
  if (is_same) return;
  throw Error({.place = other.source.file,
               .expected = fmt::format("the columns and units of {}: {}", first.source.file,
                                       first.column_list()),
               .found = other.column_list(),
               .advice = "Give logs of one joint from one logger, or torsio map one by one."});
}

void include_range(const LogTable& table, std::size_t column, ColumnSummary& summary) {
  for (const double value : table.columns[column].values) {
    if (!std::isfinite(value)) continue;
    summary.lowest = std::min(summary.lowest, value);
    summary.highest = std::max(summary.highest, value);
  }
}

/// Columns that cannot be read would be, because of the units in their names: they must be left out
/// by name.
void drop_unreadable(const LogTable& table, MappingDraft& draft) {
  for (const std::string& left_out : table.not_read) {
    const std::string name = left_out.substr(0, left_out.rfind(" ("));
    if (split_channel_name(name)) draft.dropped.push_back(name);
    for (ColumnGuess& guess : draft.columns)
      if (guess.summary.name == name)
        guess.missing = "two columns have this name: rename one of them in the file";
  }
}

/// @returns whether a recording can be read with this clock
bool is_read_with(std::span<const LogTable> tables, MappingDraft& draft) {
  draft.refusal.clear();
  try {
    for (const LogTable& table : tables)
      (void)measured_recordings(table, parse_mapping(draft.yaml(), "draft"));
    return true;
  } catch (const ClockError& error) {
    draft.refusal = error.what();
    return false;
  } catch (const Error& error) {
    draft.refusal = error.what();
    return true;  // another clock does not help
  }
}

constexpr double kExampleLever_m = 0.12;
constexpr auto kClock = "t_s";
constexpr auto kGearAngle = "gear_angle_rad";
constexpr auto kJointAngle = "joint_angle_rad";

/// The line that makes the torque of a force; empty without one.
std::string torque_of_force(const MappingDraft& draft) {
  const ColumnGuess* const force = draft.of("force_N");
  if (force == nullptr) return {};
  return fmt::format(
      "; that of a force at a lever of {0:g} m is  torque_Nm: {{from: {1}, unit: {2}, scale: "
      "{0:g}}}",
      kExampleLever_m, yaml_name(force->summary.name), force->unit);
}

/// What `torsio check` needs besides.
void state_remarks(MappingDraft& draft) {
  draft.remarks.clear();
  if (std::ranges::find(draft.columns, kClock, &ColumnGuess::channel) == draft.columns.end())
    draft.remarks.emplace_back(
        "no column is a clock: state the sample rate,  rate: 1000Hz  in the mapping or --rate");
  if (draft.of("torque_Nm") == nullptr)
    draft.remarks.push_back(
        "no column is the torque of the spring (torque_Nm), the target of a model: name it, or "
        "compute it from a known load (--load)" +
        torque_of_force(draft));
  const bool has_joint = draft.of("joint_angle_rad") != nullptr;
  if (draft.of("spring_deflection_rad") != nullptr ||
      (draft.of("gear_angle_rad") != nullptr && has_joint))
    return;
  const auto unfinished = std::ranges::find_if(draft.columns, [](const ColumnGuess& guess) {
    return guess.channel == "gear_angle_rad" && !guess.is_written();
  });
  if (has_joint && unfinished != draft.columns.end()) {
    draft.remarks.push_back(
        fmt::format("no deflection: it is gear_angle_rad - joint_angle_rad; complete the line of "
                    "gear_angle_rad below, from '{}', and remove the # before it",
                    printable(unfinished->summary.name)));
    return;
  }
  draft.remarks.emplace_back(
      std::string("no deflection: it is gear_angle_rad - joint_angle_rad; ") +
      (has_joint ? "name the angle spring_deflection_rad if the other side is clamped, or add "
                   "--inputs joint_angle_rad"
                 : "name other inputs with --inputs"));
}

double scale_of(const ColumnGuess& guess) {
  const Unit* const unit = find_unit(guess.unit);
  return unit != nullptr ? unit->scale : 0.0;
}

/// Both angles as the ratio was estimated with them.
struct EstimatedRatio {
  std::size_t motor = 0;
  double motor_scale = 0.0;
  double joint_scale = 0.0;
};

/// None if the ratio does not follow from the motion of both angles.
std::optional<EstimatedRatio> estimated_ratio(const MappingDraft& draft) {
  const ColumnGuess* const motor = draft.of(kGearAngle);
  const ColumnGuess* const joint = draft.of(kJointAngle);
  if (motor == nullptr || joint == nullptr || motor->gear_ratio == 1.0) return std::nullopt;
  return EstimatedRatio{.motor = static_cast<std::size_t>(motor - draft.columns.data()),
                        .motor_scale = scale_of(*motor),
                        .joint_scale = scale_of(*joint)};
}

/// The angles did not change, only their units.
void keep_relation(MappingDraft& draft, const EstimatedRatio& before) {
  ColumnGuess& motor = draft.columns[before.motor];
  if (motor.channel != kGearAngle || motor.gear_ratio == 1.0) return;
  const ColumnGuess* const joint = draft.of(kJointAngle);
  if (joint == nullptr) {
    motor.gear_ratio = 1.0;
    motor.sign = 1.0;
    motor.needs_ratio = true;
    motor.missing =
        "the gear ratio, which was that to an angle that is not the joint's: write it in the place "
        "of N";
    motor.add(Certainty::unsure, "");
    return;
  }
  const double change =
      scale_of(motor) / before.motor_scale * before.joint_scale / scale_of(*joint);
  if (change == 1.0) return;
  const double ratio = plausible_ratio({.factor = change * motor.gear_ratio});
  motor.add(Certainty::likely,
            fmt::format("in these units {:.4g} times '{}'", ratio, joint->summary.name));
  if (ratio >= 1.0 && ratio <= kLargestRatio) {
    motor.gear_ratio = ratio;
    return;
  }
  motor.gear_ratio = 1.0;
  motor.needs_ratio = true;
  motor.missing = "the gear ratio: check the units of both angles, or write it in the place of N";
}

}  // namespace

std::string_view name(Certainty certainty) noexcept {
  switch (certainty) {
    case Certainty::none: return "";
    case Certainty::unsure: return "unsure";
    case Certainty::likely: return "likely";
    case Certainty::sure: return "sure";
  }
  return "";
}

void ColumnGuess::add(Certainty at_most, std::string reason) {
  certainty = std::min(certainty, at_most);
  if (!reason.empty()) reasons.push_back(std::move(reason));
}

void ColumnGuess::replace_assumption(std::string_view other_unit, Certainty at_most,
                                     std::string reason) {
  unit = other_unit;
  if (assumption) reasons.erase(reasons.begin() + static_cast<std::ptrdiff_t>(*assumption));
  assumption.reset();
  add(at_most, std::move(reason));
}

std::vector<double> DraftWork::si_values(const LogTable& of, std::size_t column) const {
  const ColumnGuess& guess = draft.columns[column];
  std::vector<double> si = of.columns[column].values;
  if (const Unit* const unit = find_unit(guess.unit); unit != nullptr)
    for (double& value : si) value = guess.sign * unit->si(value);
  return si;
}

std::vector<std::size_t> DraftWork::measured(Quantity quantity) const {
  std::vector<std::size_t> found;
  for (std::size_t i = 0; i < size(); ++i)
    if (readings[i].quantity == quantity && !readings[i].is_goal &&
        !draft.columns[i].unit.empty() && draft.columns[i].is_written() &&
        draft.columns[i].channel != "t_s")
      found.push_back(i);
  return found;
}

const ColumnGuess* MappingDraft::of(std::string_view channel) const {
  const auto at = std::ranges::find_if(columns, [&](const ColumnGuess& guess) {
    return guess.channel == channel && guess.is_written();
  });
  return at == columns.end() ? nullptr : &*at;
}

MappingDraft draft_mapping(std::span<const LogTable> tables) {
  const LogTable& table = tables.front();
  require_numbers(table);
  DraftWork work{.table = table,
                 .others = tables.subspan(1),
                 .draft = {.file = table.source.file},
                 .readings = {}};
  for (const LogTable& other : work.others) {
    require_same_columns(table, other);
    work.draft.file += " " + other.source.file;
  }
  for (ColumnSummary& summary : column_summaries(table)) {
    const bool is_word = ends_in_letter(summary);
    if (is_word) {
      summary.unit.clear();
      summary.unit_origin = UnitOrigin::none;
    }
    work.readings.push_back(read_name(name_without_unit(summary)));
    const LogColumn& column = table.columns[work.readings.size() - 1];
    if (is_count(column.unknown_unit)) work.readings.back().is_counted = true;
    for (const LogTable& other : work.others)
      include_range(other, work.readings.size() - 1, summary);
    work.draft.columns.push_back({.summary = std::move(summary)});
    if (is_word)
      work.draft.columns.back().reasons.emplace_back("name: its last letter is not its unit");
  }
  work.draft.not_read = table.not_read;
  guess_clock(work);
  require_motion(table, work.draft);
  guess_quantities(work);
  guess_units(work);
  settle_torques(work);
  guess_gear(work);
  guess_sides_of_speeds(work);
  settle_twins(work);
  guess_held(work);
  drop_unreadable(table, work.draft);
  state_remarks(work.draft);
  return std::move(work.draft);
}

void try_draft(std::span<const LogTable> tables, MappingDraft& draft) {
  draft.clock.clear();
  if (std::ranges::none_of(draft.columns, &ColumnGuess::is_written)) {
    draft.refusal = "no column was recognised: write channels: by hand";
    return;
  }
  if (is_read_with(tables, draft)) return;
  const std::string even = draft.refusal;
  draft.clock = "{rebuild: true}";
  draft.clock_reason = "the stamps are coarse or jitter: spread evenly";
  if (is_read_with(tables, draft)) return;
  if (draft.rate_Hz > 0.0) {
    draft.clock = fmt::format("{{resample: {:.4g}Hz}}", draft.rate_Hz);
    draft.clock_reason = "the stamps are uneven: interpolated at their usual rate";
    if (is_read_with(tables, draft)) return;
  }
  draft.clock.clear();
  draft.clock_reason.clear();
  draft.refusal = even;
}

void answer(MappingDraft& draft, std::size_t column, std::string_view text) {
  ColumnGuess& guess = draft.columns[column];
  if (text.empty()) return;
  const std::optional<EstimatedRatio> ratio = estimated_ratio(draft);
  const auto settle = [&] {
    if (ratio) keep_relation(draft, *ratio);
    state_remarks(draft);
  };
  if (text == "-") {
    guess = {.summary = guess.summary, .reasons = {"left out by the user"}};
    return settle();
  }
  const auto parts = split_channel_name(text);
  const std::string place = fmt::format("'{}'", printable(guess.summary.name));
  if (!parts)
    throw UsageError({.place = place,
                      .expected = "a channel with the unit of its numbers, such as joint_angle_deg",
                      .found = fmt::format("'{}'", printable(text))});
  const std::string channel = parts->si();
  const ColumnGuess* const other = draft.of(channel);
  if (other != nullptr && other != &guess)
    throw UsageError({.place = place,
                      .problem = fmt::format("{} is '{}' already", channel, other->summary.name)});
  const bool is_same = channel == guess.channel;
  guess.channel = channel;
  guess.unit = parts->unit->suffix;
  guess.missing.clear();
  if (!is_same) guess.sign = guess.gear_ratio = 1.0;
  guess.needs_ratio = false;
  guess.certainty = Certainty::sure;
  guess.reasons.emplace_back("stated by the user");
  settle();
}

}  // namespace torsio

// What names and units state: quantity, side, clock.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "check/draft/column_relations.hpp"
#include "check/draft/draft_steps.hpp"
#include "data/mapping/columns.hpp"
#include "data/mapping/number_coding.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/units.hpp"

namespace torsio {
namespace {

constexpr auto kUnitsOfStamps = std::to_array<std::string_view>({"s", "ms", "us", "ns"});
// Logs have more than 1 Hz and less than 20 kHz.
constexpr double kShortestStep_s = 1.01 / 20e3;
constexpr double kLongestStep_s = 0.99;
constexpr double kUsualRate_Hz = 300.0;

constexpr int kMaxCounterBits = 32;

/// The bits of a counter of these stamps that begins again; 0: none does.
int bits_of_counter(const std::vector<double>& stamps) {
  constexpr double kNear = 2.0;  // usual steps
  double back = 0.0;
  for (std::size_t i = 1; i < stamps.size(); ++i) back = std::max(back, stamps[i - 1] - stamps[i]);
  if (back > std::exp2(kMaxCounterBits - 1)) return kMaxCounterBits;
  const double step = usual_step(stamps);
  const auto [lowest, highest] = std::ranges::minmax(stamps);
  for (const int bits : {16, 24, 31}) {
    const double span = std::exp2(bits);
    if (std::abs(back + step - span) > kNear * step || highest - lowest > span) continue;
    std::vector<double> unwrapped = stamps;
    unwrap(unwrapped, span);
    if (std::ranges::is_sorted(unwrapped)) return bits;
  }
  return 0;
}

std::string reason_of_unit(const ColumnSummary& summary) {
  return fmt::format("unit: {} ({})", summary.unit, name(summary.unit_origin));
}

bool is_rate_of_log(double step_s) { return step_s > 2e-5 && step_s < 5.0; }

/// Its unit by the name, else by the size of the steps.
void state_unit_of_clock(ColumnGuess& guess, const NameReading& reading, double step) {
  if (!guess.summary.unit.empty()) return;
  if (const Unit* const unit = find_unit(reading.unit);
      unit != nullptr && unit->si_suffix == "s" && is_rate_of_log(step * unit->scale)) {
    guess.unit = reading.unit;
    guess.add(Certainty::likely, "unit: " + reading.unit + " (word in the name)");
    return;
  }
  std::vector<std::string_view> possible;  // the nearest to a usual rate first
  const auto distance = [&](std::string_view unit) {
    return std::abs(std::log(step * find_unit(unit)->scale * kUsualRate_Hz));
  };
  for (const std::string_view unit : kUnitsOfStamps)
    if (const double step_s = step * find_unit(unit)->scale;
        step_s > kShortestStep_s && step_s < kLongestStep_s)
      possible.push_back(unit);
  if (possible.empty()) return;
  std::ranges::sort(possible, {}, distance);
  guess.unit = possible.front();
  if (possible.size() == 1)
    guess.add(Certainty::likely,
              fmt::format("values: steps of {:.4g} are those of a log in {}", step, guess.unit));
  else
    guess.add(Certainty::unsure,
              fmt::format("values: steps of {:.4g} are {:.4g} Hz in {} or {:.4g} Hz in {}", step,
                          1.0 / (step * find_unit(possible[0])->scale), possible[0],
                          1.0 / (step * find_unit(possible[1])->scale), possible[1]));
}

/// Rows in a unit of the stamps, without pauses and where a counter begins again; 0: not known. A
/// mean, since coarse stamps have steps of several sizes, also 0.
double usual_rate(const std::vector<double>& stamps, double usual_step) {
  constexpr double kPause = 3.0;  // in usual steps
  double span = 0.0;
  std::size_t steps = 0;
  for (std::size_t i = 1; i < stamps.size(); ++i)
    if (const double step = stamps[i] - stamps[i - 1]; step >= 0.0 && step <= kPause * usual_step) {
      span += step;
      ++steps;
    }
  return span > 0.0 ? static_cast<double>(steps) / span : 0.0;
}

/// How much speaks for a column as the clock; 0: it is none.
int score_of_clock(const LogColumn& column, const ColumnSummary& summary,
                   const NameReading& reading) {
  if (column.time == TimeKind::date_time || column.time == TimeKind::time_of_day) return 5;
  if (column.time == TimeKind::date || summary.empty > 0) return 0;
  const Unit* const unit = find_unit(summary.unit);
  if (unit != nullptr && unit->si_suffix != "s") return 0;
  const bool is_time = reading.quantity == Quantity::time || unit != nullptr;
  const bool has_order = is_rising(column.values);
  const bool is_named =
      is_time && (reading.is_clear || unit != nullptr || bits_of_counter(column.values) > 0);
  if (!has_order && !is_named) return 0;
  if (is_time && has_order) return unit != nullptr ? 7 : reading.is_clear ? 6 : 4;
  if (is_time) return 2;  // it starts again, or rows come late
  return reading.quantity == Quantity::unknown ? 1 : 0;
}

void take_as_clock(DraftWork& work, std::size_t column, int score) {
  ColumnGuess& guess = work.draft.columns[column];
  const NameReading& reading = work.readings[column];
  guess.channel = "t_s";
  guess.unit = guess.summary.unit;
  guess.certainty = Certainty::sure;
  if (score == 1)
    guess.add(Certainty::likely, "values: the only column that rises all the time");
  else if (work.table.columns[column].time != TimeKind::none)
    guess.add(Certainty::sure, "values: dates or times of day");
  else if (reading.quantity == Quantity::time)
    guess.add(Certainty::sure, "name: " + reading.word);
  if (!guess.summary.unit.empty()) guess.add(Certainty::sure, reason_of_unit(guess.summary));
  const double step = usual_step(work.values(column));
  state_unit_of_clock(guess, reading, step);
  const Unit* const unit = find_unit(guess.unit);
  const std::vector<double>& stamps = work.values(column);
  const double scale = work.table.columns[column].time != TimeKind::none ? 1.0
                       : unit != nullptr                                 ? unit->scale
                                                                         : 0.0;
  if (scale > 0.0) work.draft.rate_Hz = usual_rate(stamps, step) / scale;
  if (const int bits = bits_of_counter(stamps); bits > 0) {
    guess.unwrap = std::exp2(bits);
    guess.add(Certainty::likely, fmt::format("values: a counter of {} bits begins again", bits));
  }
  if (unit == nullptr) guess.missing = "the unit of the time: set unit: s, ms, us or ns";
}

/// The unit is that of another quantity than the name's: the unit counts.
Quantity by_unit(const NameReading& reading, const Unit& unit) {
  if (si_unit_of(reading.quantity) == unit.si_suffix) return reading.quantity;
  return quantity_of_unit(unit.si_suffix);
}

/// Whether a unit alone makes a channel likely; a voltage may be one of many.
bool shows_channel(Quantity quantity) {
  return quantity == Quantity::angle || quantity == Quantity::torque ||
         quantity == Quantity::deflection;
}

void guess_one(ColumnGuess& guess, NameReading& reading) {
  const Unit* const unit = find_unit(guess.summary.unit);
  if (unit != nullptr) {
    const Quantity named = reading.quantity;
    reading.quantity = by_unit(reading, *unit);
    if (reading.quantity != named && reading.quantity != Quantity::unknown) reading.is_clear = true;
  }
  const bool is_by_unit_alone = reading.word.empty() && reading.side == Side::unknown;
  if (is_by_unit_alone && !shows_channel(reading.quantity)) return;
  const std::string channel = channel_of(reading.quantity, reading.side, reading.is_goal);
  if (channel.empty() || reading.quantity == Quantity::time) return;
  guess.channel = fmt::format("{}_{}", channel, si_unit_of(reading.quantity));
  guess.certainty = Certainty::sure;
  if (!reading.word.empty())
    guess.add(reading.is_clear ? Certainty::sure : Certainty::likely, "name: " + reading.word);
  if (unit == nullptr) return;
  guess.unit = guess.summary.unit;
  guess.add(reading.word.empty() ? Certainty::likely : Certainty::sure,
            reason_of_unit(guess.summary));
}

}  // namespace

void guess_clock(DraftWork& work) {
  std::size_t best = work.size();
  int best_score = 0;
  std::size_t rising_unknown = 0;
  for (std::size_t i = 0; i < work.size(); ++i) {
    const int score =
        score_of_clock(work.table.columns[i], work.draft.columns[i].summary, work.readings[i]);
    if (score == 1) ++rising_unknown;
    if (score <= best_score) continue;
    best = i;
    best_score = score;
  }
  if (best_score == 0 || (best_score == 1 && rising_unknown > 1)) return;
  take_as_clock(work, best, best_score);
}

void guess_quantities(DraftWork& work) {
  for (std::size_t i = 0; i < work.size(); ++i) {
    ColumnGuess& guess = work.draft.columns[i];
    if (!guess.channel.empty()) continue;
    // A channel of torsio keeps its name.
    if (const auto own = split_channel_name(guess.summary.name);
        own && guess.summary.unit_origin == UnitOrigin::name &&
        !marked_quantity(guess.summary.name).empty()) {
      work.readings[i].quantity = Quantity::mask;
      guess.channel = guess.summary.name;
      guess.unit = own->unit->suffix;
      guess.certainty = Certainty::sure;
      guess.reasons = {"name: of a mask"};
      continue;
    }
    guess_one(guess, work.readings[i]);
  }
}

void state_clock(const LogTable& table, LogSummary& summary) {
  const MappingDraft draft = [&] {
    try {
      return draft_mapping(table);
    } catch (const Error&) {
      return MappingDraft{};  // without a motion there is no draft
    }
  }();
  const ColumnGuess* const clock = draft.of("t_s");
  if (clock == nullptr) return;
  const LogColumn& column = table.columns[static_cast<std::size_t>(clock - draft.columns.data())];
  const Unit* const unit = find_unit(clock->unit);
  if (unit == nullptr || column.values.empty()) return;
  std::vector<double> stamps = column.values;
  if (clock->unwrap > 0.0) unwrap(stamps, clock->unwrap);
  const double scale = column.time == TimeKind::none ? unit->scale : 1.0;
  summary.clock = clock->summary.name;
  summary.duration_s = scale * (stamps.back() - stamps.front());
}

}  // namespace torsio

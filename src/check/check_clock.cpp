// The clock, by the motion: stamps in another unit than that in which they are read make it a thousand times too slow or
// too fast.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <span>
#include <string>

#include "check/checker.hpp"
#include "check/mapping_advice.hpp"
#include "numerics/reversals.hpp"
#include "torsio/core/units.hpp"

namespace torsio {
namespace {

constexpr double kSlowRate_Hz = 5.0;
constexpr double kSlowStroke_s = 200.0;
constexpr double kRowsOfAStroke = 20.0;  ///< a motion that passes slower samples is not smooth
constexpr double kFastRate_Hz = 50e3;
constexpr double kFastStroke_s = 0.03;
constexpr double kUsualRate_Hz = 2.0;
constexpr double kUsualStroke_s = 60.0;
constexpr std::size_t kFewestStrokesOfAClock = 3;

/// Units of time differ by it.
constexpr double kThousandfold = 1000.0;

/// By what the stamps must be divided so that they are in s: 1 if they may be.
double factor_of_stamps(double rate_Hz, double stroke_s) {
  const double rows = rate_Hz * stroke_s;
  double factor = 1.0;
  if (rate_Hz <= kSlowRate_Hz && stroke_s >= kSlowStroke_s && rows >= kRowsOfAStroke) {
    do {
      factor *= kThousandfold;
    } while (factor < 1e9 &&
             (rate_Hz * factor < kUsualRate_Hz || stroke_s / factor > kUsualStroke_s));
  } else if (rate_Hz >= kFastRate_Hz && stroke_s <= kFastStroke_s) {
    do {
      factor /= kThousandfold;
    } while (factor > 1e-9 && rate_Hz * factor >= kFastRate_Hz);
  }
  return factor;
}

/// The unit of time that is so many times smaller; null if none is known.
const Unit* unit_of_stamps(const std::string& assumed, double factor) {
  const Unit* const unit = find_unit(assumed);
  if (unit == nullptr) return nullptr;
  for (const char* const suffix : {"s", "ms", "us", "ns"})
    if (const Unit* const other = find_unit(suffix);
        other != nullptr && std::abs(std::log(unit->scale / factor / other->scale)) < 1e-6)
      return other;
  return nullptr;
}

std::string clock_advice(const Recording& recording, double factor) {
  const ColumnOfChannel* const column = column_of(recording, "t_s");
  if (column == nullptr)
    return "Check the sample rate that was given (--rate, or rate: in a mapping).";
  const Unit* const unit = unit_of_stamps(column->unit, factor);
  if (unit == nullptr) return fmt::format("Check the unit of the stamps in '{}'.", column->column);
  const auto rule = rule_of(recording, "t_s");
  const std::string start =
      fmt::format("If the stamps in '{}' are in {} and not in {}:  ", column->column, unit->suffix,
                  column->unit);
  if (rule && !rule->unit.empty())
    return start + fmt::format(
                       "write unit: {} instead of unit: {} into the rule of t_s in the "
                       "mapping",
                       unit->suffix, rule->unit);
  return start + rule_advice(recording, "t_s", fmt::format("unit: {}", unit->suffix));
}

}  // namespace

void Checker::check_clock() {
  for_each_record([&](std::size_t r) {
    const Recording& recording = dataset_.records[r].recording;
    const std::size_t reversals = count_reversals(pairs_[r].input);
    if (reversals < kFewestStrokesOfAClock) return;
    const double rate_Hz = recording.sample_rate_Hz();
    const double stroke_s =
        static_cast<double>(recording.size()) / rate_Hz / static_cast<double>(reversals);
    const double factor = factor_of_stamps(rate_Hz, stroke_s);
    if (factor == 1.0) return;
    add(Verdict::warn, "clock", recording.name(),
        fmt::format("{} takes {:.3g} s from one reversal to the next, in {:.0f} rows of {:.4g} Hz: "
                    "the clock may be {:g} times too {}",
                    spec_.inputs.front(), stroke_s, stroke_s * rate_Hz, rate_Hz,
                    factor > 1.0 ? factor : 1.0 / factor, factor > 1.0 ? "slow" : "fast"),
        clock_advice(recording, factor));
  });
}

}  // namespace torsio

#include "data/clock_order.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "data/mapping/column_advice.hpp"
#include "data/mapping/number_coding.hpp"
#include "data/mapping/row_order.hpp"
#include "data/names.hpp"
#include "torsio/core/units.hpp"
#include "torsio/data/load.hpp"

namespace torsio {
namespace {

/// How many rows have each stamp, if always as many; 0: another number here and there.
std::size_t rows_per_stamp(std::span<const double> stamps_s) {
  const double first_s = stamps_s.front();
  const auto rows = static_cast<std::size_t>(
      std::ranges::find_if(stamps_s, [&](double stamp_s) { return stamp_s != first_s; }) -
      stamps_s.begin());
  for (std::size_t i = 1; i < stamps_s.size(); ++i)
    if ((stamps_s[i] == stamps_s[i - 1]) != (i % rows != 0)) return 0;
  return rows;
}

/// A counter that overflows.
struct Overflow {
  int bits = 0;
  double tick_s = 0.0;
  double span_s = 0.0;
};

/// The counter that goes back by so much where it begins again.
std::optional<Overflow> find_overflow(double back_s, double step_s) {
  constexpr double kNear = 2.0;  // intervals
  for (const int bits : {16, 24, 31, 32})
    for (const double tick_s : {1.0, 1e-3, 1e-6, 1e-9})
      if (const double span_s = std::exp2(bits) * tick_s;
          std::abs(back_s + step_s - span_s) <= kNear * step_s)
        return Overflow{.bits = bits, .tick_s = tick_s, .span_s = span_s};
  return std::nullopt;
}

/// Whether a counter of that span makes the stamps: they are within it, and unwrapped they never run backward.
bool is_counter_of(const Stamps& stamps, double span_s) {
  const auto [lowest, highest] = std::ranges::minmax(stamps.values_s);
  if (highest - lowest > span_s) return false;
  std::vector<double> values_s(stamps.values_s.begin(), stamps.values_s.end());
  unwrap(values_s, span_s);
  return std::ranges::is_sorted(values_s);
}

/// Whether the stamps jump to later ones than before soon after they went back: single rows came late.
bool is_late_row(const Stamps& stamps, std::size_t back) {
  const double longest_s = kLongestGapIntervals * stamps.report.stamp_step_s;
  const std::size_t end = std::min(stamps.values_s.size(), back + 1 + kMaxLateRows);
  for (std::size_t i = back + 1; i < end; ++i) {
    if (stamps.values_s[i] <= stamps.values_s[back - 1]) continue;
    return stamps.values_s[i] - stamps.values_s[i - 1] > longest_s;
  }
  return back + 1 == stamps.values_s.size();
}

/// The mapping line that unwraps the clock.
std::string unwrap_advice(const Stamps& stamps, double span_s) {
  const auto line = [&](double factor) { return fmt::format("unwrap: {:.10g}", span_s / factor); };
  const auto& rules = stamps.mapping.channels;
  const auto rule = std::ranges::find(rules, stamps.column.name, &ChannelRule::from);
  if (rule != rules.end())
    return fmt::format("Mapping: add  {}  to the rule of {}.",
                       line(column_factor(*rule, stamps.column).value_or(1.0)), rule->name);
  const auto parts = split_channel_name(stamps.column.full_name());
  return fmt::format("Mapping: channels: {{t_s: {{from: {}, {}}}}}", stamps.column.name,
                     line(parts ? parts->unit->scale : 1.0));
}

}  // namespace

void refuse_several_joints(const Stamps& stamps) {
  constexpr double kMore = 3.0;
  constexpr std::size_t kFewestStamps = 10;
  const std::size_t joints = rows_per_stamp(stamps.values_s);
  if (joints < 2 || stamps.rows.size() < kFewestStamps * joints) return;
  for (const TableChannel& column : stamps.columns.channels) {
    const std::vector<double>& values = column.channel.values;
    double within = 0.0;
    double between = 0.0;
    for (std::size_t i = stamps.rows.begin; i + joints < stamps.rows.end; ++i) {
      const bool is_within = (i + 1 - stamps.rows.begin) % joints != 0;
      const double change = std::abs(values[i + 1] - values[i]);
      const double next = std::abs(values[i + joints] - values[i]);
      if (!is_within || !std::isfinite(change) || !std::isfinite(next)) continue;
      within += change;
      between += next;
    }
    if (!(within > kMore * between) || !(between > 0.0)) continue;
    throw ClockError(
        {.place = stamps.place(1),
         .problem =
             fmt::format("{} rows have each time stamp, and {} changes more between them than "
                         "from one stamp to the next: the rows of {} joints alternate",
                         joints, column.channel.name, joints),
         .expected = "the rows of one joint",
         .found = fmt::format("{} s in {} rows", stamps.values_s.front(), joints),
         .advice =
             stamps.table.header_line == 0
                 ? std::string("Save the signals of each joint in a file of their own.")
                 : fmt::format(
                       "Write the rows of each to a file, for example the first:  awk 'NR <= {0} "
                       "|| (NR - {0}) % {1} == 1' LOG.csv > FIRST.csv",
                       stamps.table.header_line, joints)});
  }
}

void refuse_backward(const Stamps& stamps, std::size_t at) {
  throw ClockError(
      {.place = stamps.place(at),
       .problem =
           fmt::format("the rows are not in the order of their time stamps ({} run backward)",
                       stamps.report.backward),
       .expected = fmt::format("at least {} s", stamps.values_s[at - 1]),
       .found = fmt::format("{} s", stamps.values_s[at]),
       .advice = fmt::format(
           "If the stamps are correct and rows came late, write in a mapping  {}\n  If the rows "
           "are in order, taken evenly, and the stamps wrong, leave the stamps out:  "
           "drop: [{}] and  {}",
           sort_line(stamps), yaml_name(stamps.column.name), rate_line(stamps))});
}

void refuse_new_beginning(const Stamps& stamps) {
  const double step_s = stamps.report.stamp_step_s;
  if (!(step_s > 0.0)) return;
  for (std::size_t i = 1; i < stamps.values_s.size(); ++i) {
    const double back_s = stamps.values_s[i - 1] - stamps.values_s[i];
    if (!(back_s > kLongestGapIntervals * step_s)) continue;
    auto overflow = find_overflow(back_s, step_s);
    if (overflow && !is_counter_of(stamps, overflow->span_s)) overflow.reset();
    if (!overflow && is_late_row(stamps, i)) refuse_backward(stamps, i);
    throw ClockError(
        {.place = stamps.place(i),
         .problem = overflow
                        ? fmt::format("the clock begins again after 2^{} of its ticks of {:g} s",
                                      overflow->bits, overflow->tick_s)
                        : "the clock starts again, as if two logs were in one file",
         .expected = fmt::format("more than {} s", stamps.values_s[i - 1]),
         .found = fmt::format("{} s", stamps.values_s[i]),
         .advice = overflow ? unwrap_advice(stamps, overflow->span_s)
                            : fmt::format("Make a recording of each part, in a mapping:  {}",
                                          clock_line(stamps, "", usual_limit_s(stamps)))});
  }
}

void refuse_not_increasing(const Stamps& stamps, const std::string& advice) {
  std::size_t at = stamps.report.first_not_increasing;
  if (at == 0) return;
  if (stamps.report.backward > 0) {
    while (stamps.values_s[at] >= stamps.values_s[at - 1]) ++at;
    refuse_backward(stamps, at);
  }
  throw ClockError({.place = stamps.place(at),
                    .problem = fmt::format("the clock does not advance ({} stamps are repeated)",
                                           stamps.report.duplicated),
                    .expected = fmt::format("more than {} s", stamps.values_s[at - 1]),
                    .found = fmt::format("{} s", stamps.values_s[at]),
                    .advice = advice});
}

}  // namespace torsio

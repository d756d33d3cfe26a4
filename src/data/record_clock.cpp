#include "data/record_clock.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <utility>

#include "data/inspect_clock.hpp"
#include "data/log_table.hpp"
#include "data/mapping/column_advice.hpp"
#include "data/mapping/number_coding.hpp"
#include "data/mapping/row_order.hpp"
#include "data/names.hpp"
#include "numerics/quantile.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/units.hpp"
#include "torsio/data/load.hpp"

namespace torsio {
namespace {

constexpr double kLongestGapIntervals = 5.0;

/// The stamps of one record, with what is needed to complain about them.
struct Stamps {
  const LogTable& table;
  const TableChannels& columns;
  const Mapping& mapping;
  const LogColumn& column;
  Rows rows;
  std::span<const double> values_s;
  ClockReport report;

  [[nodiscard]] std::string place(std::size_t sample) const {
    return table.place(rows.begin + sample, column);
  }
};

/// Whether stamps are repeated, and each time with every value, as where a message comes twice.
bool repeats_are_rows(const Stamps& stamps) {
  if (stamps.report.duplicated == 0) return false;
  for (std::size_t i = 1; i < stamps.values_s.size(); ++i) {
    const std::size_t row = stamps.rows.begin + i;
    if (stamps.values_s[i] == stamps.values_s[i - 1] &&
        !are_equal_rows(stamps.columns, row - 1, row))
      return false;
  }
  return true;
}

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

/// Rows of several joints, one after the other: a channel differs more between two rows of a stamp than from one stamp to
/// the next.
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

/// An estimate of the log's rate, without its gaps; repeated stamps contribute only their number. 0: none
double rate_of_steps(const Stamps& stamps) {
  constexpr double kSimple = 1e-3;
  constexpr double kSimpleOfCoarse = 1e-2;
  const double step_s = stamps.report.stamp_step_s;
  if (!(step_s > 0.0)) return 0.0;
  if (stamps.report.backward > 0) {  // rows in another order
    std::vector<double> sorted_s(stamps.values_s.begin(), stamps.values_s.end());
    std::ranges::sort(sorted_s);
    sorted_s.erase(std::unique(sorted_s.begin(), sorted_s.end()), sorted_s.end());
    return simplest_rate(
        static_cast<double>(sorted_s.size() - 1) / (sorted_s.back() - sorted_s.front()),
        kSimpleOfCoarse);
  }
  if (stamps.report.duplicated == 0 || repeats_are_rows(stamps))
    return simplest_rate(1.0 / step_s, kSimple);
  double duration_s = 0.0;
  double steps = 0.0;
  for (std::size_t i = 1; i < stamps.values_s.size(); ++i) {
    const double interval_s = stamps.values_s[i] - stamps.values_s[i - 1];
    if (interval_s < 0.0 || interval_s > kLongestGapIntervals * step_s) continue;
    duration_s += interval_s;
    steps += 1.0;
  }
  return simplest_rate(steps / duration_s, kSimpleOfCoarse);
}

std::string rate_line(const Stamps& stamps) {
  const double rate_Hz = rate_of_steps(stamps);
  return rate_Hz > 0.0 ? fmt::format("rate: {:.6g}Hz", rate_Hz)
                       : std::string("rate: with the sample rate of the log");
}

std::string resample_entry(const Stamps& stamps) {
  const double wanted_Hz = stamps.mapping.clock.resample_Hz;
  return fmt::format("resample: {:.6g}Hz", wanted_Hz > 0.0 ? wanted_Hz : rate_of_steps(stamps));
}

/// `clock:` of the mapping, with what it has already.
std::string clock_line(const Stamps& stamps, std::string_view entry, double split_at_s = 0.0) {
  if (split_at_s == 0.0) split_at_s = stamps.mapping.clock.split_at_gaps_s;
  std::string line(entry);
  if (stamps.mapping.clock.sort) line += line.empty() ? "sort: true" : ", sort: true";
  if (split_at_s > 0.0)
    line += fmt::format("{}split_at_gaps: {:.4g}s", line.empty() ? "" : ", ", split_at_s);
  return "clock: {" + line + "}";
}

/// `clock:` of the mapping, with the rows sorted.
std::string sort_line(const Stamps& stamps) {
  std::string entry = "sort: true";
  if (stamps.mapping.clock.rebuild) entry += ", rebuild: true";
  if (stamps.mapping.clock.resample_Hz > 0.0) entry += ", " + resample_entry(stamps);
  return clock_line(stamps, entry);
}

std::string remedies(const Stamps& stamps) {
  return fmt::format(
      "If the samples were taken evenly and only the stamps are coarse, write in a mapping  {}\n  "
      "If "
      "they were taken unevenly, write  {}  or another rate.",
      clock_line(stamps, "rebuild: true"), clock_line(stamps, resample_entry(stamps)));
}

/// What straight lines over so many intervals miss in their middle, at most except for a twentieth of the places.
double missed_by_lines(const std::vector<double>& values, Rows rows, std::size_t intervals) {
  constexpr double kUsual = 0.95;
  constexpr std::size_t kEnough = 2000;
  std::vector<double> missed;
  const std::size_t stride = std::max<std::size_t>(1, rows.size() / kEnough);
  for (std::size_t i = rows.begin; i + intervals < rows.end; i += stride) {
    const std::size_t middle = i + intervals / 2;
    const double share = static_cast<double>(middle - i) / static_cast<double>(intervals);
    const double each =
        std::abs(values[middle] - std::lerp(values[i], values[i + intervals], share));
    if (std::isfinite(each)) missed.push_back(each);
  }
  return missed.empty() ? 0.0 : quantile(std::move(missed), kUsual);
}

/// Whether a gap is so short that straight lines over it are as good as the measurements of every channel: they miss
/// at most a hundredth of its range, or twice its noise.
bool is_bridged_well(const Stamps& stamps, double gap_s) {
  constexpr double kMissedShare = 0.01;
  constexpr double kOverNoise = 2.0;
  const auto intervals = static_cast<std::size_t>(std::ceil(gap_s / stamps.report.stamp_step_s));
  if (2 * intervals > stamps.rows.size()) return false;
  return std::ranges::all_of(stamps.columns.channels, [&](const TableChannel& column) {
    const Channel& channel = column.channel;
    if (!channel.fresh.empty()) return true;  // held
    double lowest = HUGE_VAL;
    double highest = -HUGE_VAL;
    for (std::size_t i = stamps.rows.begin; i < stamps.rows.end; ++i)
      if (std::isfinite(channel.values[i]))
        lowest = std::min(lowest, channel.values[i]),
        highest = std::max(highest, channel.values[i]);
    return missed_by_lines(channel.values, stamps.rows, intervals) <=
           std::max(kMissedShare * (highest - lowest),
                    kOverNoise * missed_by_lines(channel.values, stamps.rows, 2));
  });
}

double usual_limit_s(const Stamps& stamps) {
  const double period_s =
      stamps.mapping.clock.resample_Hz > 0.0 ? 1.0 / stamps.mapping.clock.resample_Hz : 0.0;
  return std::max(kLongestGapIntervals * stamps.report.stamp_step_s, period_s);
}

bool is_too_long(const Stamps& stamps, double gap_s) {
  if (stamps.mapping.clock.max_gap_s > 0.0) return gap_s > stamps.mapping.clock.max_gap_s;
  return gap_s > usual_limit_s(stamps) && !is_bridged_well(stamps, gap_s);
}

std::string split_advice(const Stamps& stamps) {
  return fmt::format("Make a recording of each part, in a mapping:  {}",
                     clock_line(stamps, resample_entry(stamps), usual_limit_s(stamps)));
}

/// Samples that a log lacks: whole intervals too many, here and there.
struct Loss {
  std::size_t samples = 0;
  std::size_t longest = 0;  ///< samples lost at one place
  std::size_t first = 0;    ///< the sample after the first gap
};

/// Empty where the stamps may just as well be coarse: their doubled steps come evenly.
Loss lost_samples(const Stamps& stamps) {
  constexpr double kNear = 0.25;
  constexpr std::size_t kCertainlyFew = 3;
  const double step = stamps.report.stamp_step_s;
  Loss loss;
  for (std::size_t i = 1; i < stamps.values_s.size(); ++i) {
    const double steps = (stamps.values_s[i] - stamps.values_s[i - 1]) / step;
    const double whole = std::round(steps);
    if (whole < 1.0 || std::abs(steps - whole) > kNear) return {};
    const auto lost = static_cast<std::size_t>(std::min(whole - 1.0, 1e9));
    if (lost == 0) continue;
    if (loss.samples == 0) loss.first = i;
    loss.samples += lost;
    loss.longest = std::max(loss.longest, lost);
  }
  const bool strays = stamps.report.largest_stray_s > step;
  return strays || loss.samples <= kCertainlyFew ? loss : Loss{};
}

void refuse_lost(const Stamps& stamps) {
  const Loss loss = lost_samples(stamps);
  if (loss.samples == 0) return;
  const double before_s = stamps.values_s[loss.first - 1];
  const double longest_s = static_cast<double>(loss.longest + 1) * stamps.report.stamp_step_s;
  throw ClockError(
      {.place = stamps.place(loss.first),
       .problem = fmt::format("{} {} missing, the first after t = {:.6g} s", loss.samples,
                              loss.samples == 1 ? "sample is" : "samples are", before_s),
       .expected = fmt::format("an interval near {:.6g} s", stamps.report.stamp_step_s),
       .found = fmt::format("{:.6g} s", stamps.values_s[loss.first] - before_s),
       .advice = is_too_long(stamps, longest_s) ? split_advice(stamps)
                                                : "Fill it with straight lines, in a mapping:  " +
                                                      clock_line(stamps, resample_entry(stamps))});
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

[[noreturn]] void refuse_backward(const Stamps& stamps, std::size_t at) {
  throw ClockError(
      {.place = stamps.place(at),
       .problem =
           fmt::format("the rows are not in the order of their time stamps ({} run backward)",
                       stamps.report.backward),
       .expected = fmt::format("at least {} s", stamps.values_s[at - 1]),
       .found = fmt::format("{} s", stamps.values_s[at]),
       .advice = fmt::format("If the stamps are correct and rows came late, write in a mapping  "
                             "{}\n  If the rows are "
                             "in order, taken evenly, and the stamps wrong, leave the stamps out:  "
                             "drop: [{}] and  {}",
                             sort_line(stamps), yaml_name(stamps.column.name), rate_line(stamps))});
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

/// A counter of the logger that overflows, or a second log after the first one.
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

void refuse_unusable(const Stamps& stamps) {
  if (stamps.rows.size() < 2)
    throw ClockError({.place = stamps.place(0),
                      .expected = "at least two samples, to determine the sample rate",
                      .found = "one sample"});
  if (stamps.report.not_finite > 0) {
    const auto missing =
        std::ranges::find_if(stamps.values_s, [](double stamp) { return !std::isfinite(stamp); });
    throw ClockError(
        {.place = stamps.place(static_cast<std::size_t>(missing - stamps.values_s.begin())),
         .expected = "a time stamp",
         .found = "nothing",
         .advice = "Remove the line, or drop the clock column and give the rate."});
  }
  refuse_several_joints(stamps);
  refuse_new_beginning(stamps);
  if (!(stamps.report.sample_rate_Hz > 0.0))
    throw ClockError(
        {.place = stamps.place(stamps.rows.size() - 1),
         .problem = "the last time stamp is not after the first",
         .found = fmt::format("{} s after {} s", stamps.values_s.back(), stamps.values_s.front()),
         .advice = fmt::format(
             "Drop the clock column in a mapping and give the rate:  drop: [{}] and  {}",
             stamps.column.name, rate_line(stamps))});
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

double even_rate(const Stamps& stamps) {
  refuse_not_increasing(
      stamps, repeats_are_rows(stamps)
                  ? "Rows that occur twice are left out by a mapping with  " + sort_line(stamps)
                  : remedies(stamps));
  const ClockReport& report = stamps.report;
  const std::size_t odd = report.worst_interval;
  if (!report.is_uniform()) refuse_lost(stamps);
  if (!report.is_uniform())
    throw ClockError(
        {.place = stamps.place(odd),
         .problem = fmt::format("the clock is not even (a stamp strays by {:.3g} samples)",
                                report.largest_stray_s * report.sample_rate_Hz),
         .expected = fmt::format("an interval near {:.6g} s", report.stamp_step_s),
         .found = fmt::format("{:.6g} s", stamps.values_s[odd] - stamps.values_s[odd - 1]),
         .advice = remedies(stamps)});
  const double first = stamps.values_s.front();
  const double last = stamps.values_s.back();
  const double rounding = 4.0 * std::numeric_limits<double>::epsilon();
  const double tolerance =
      (report.largest_stray_s + rounding * std::max(std::abs(first), std::abs(last))) /
          (last - first) +
      rounding;
  return simplest_rate(report.sample_rate_Hz, tolerance);
}

double rebuilt_rate(const Stamps& stamps, double max_stray_steps) {
  const ClockReport& report = stamps.report;
  const double steps = report.largest_stray_s / report.stamp_step_s;
  if (!(steps <= max_stray_steps))
    throw ClockError(
        {.place = stamps.place(report.max_stray),
         .problem = "the samples were not taken evenly enough to rebuild the clock",
         .expected = fmt::format("at most {} stamp steps of {:.4g} s away from an even spread",
                                 max_stray_steps, report.stamp_step_s),
         .found = fmt::format("{:.2f} steps", steps),
         .advice = fmt::format(
             "Put the samples where their stamps are:  {}\n  Where the stamps are wrong by so much "
             "and "
             "the samples even:  {}",
             clock_line(stamps, resample_entry(stamps)),
             clock_line(stamps,
                        fmt::format("rebuild: true, max_stray_steps: {:.0f}", std::ceil(steps))))});
  return report.sample_rate_Hz;
}

void refuse_gaps(const Stamps& stamps) {
  double longest_s = 0.0;
  std::size_t longest = 0;
  for (std::size_t i = 1; i < stamps.values_s.size(); ++i) {
    const double interval = stamps.values_s[i] - stamps.values_s[i - 1];
    if (interval < 0.0) refuse_backward(stamps, i);
    if (interval > longest_s) longest_s = interval, longest = i;
  }
  if (!is_too_long(stamps, longest_s)) return;
  const double max_gap_s = stamps.mapping.clock.max_gap_s;
  throw ClockError(
      {.place = stamps.place(longest),
       .problem = "a gap too long to interpolate over",
       .expected = max_gap_s > 0.0 ? fmt::format("at most {:.4g} s (max_gap)", max_gap_s)
                                   : fmt::format("at most {:.4g} s, or an interval over which "
                                                 "straight lines follow every channel",
                                                 usual_limit_s(stamps)),
       .found = fmt::format("{:.4g} s", longest_s),
       .advice =
           split_advice(stamps) +
           fmt::format("\n  Beside resample:, max_gap: {:.4g}s accepts straight lines over it.",
                       1.01 * longest_s)});
}

/// The mapping of the first column that may be the clock.
std::string advice_on_clock(const LogTable& table) {
  constexpr const char* kRate =
      "Give the sample rate: --rate 1000, or  rate: 1000Hz  in a mapping.";
  for (const LogColumn& column : table.columns)
    if (column.time != TimeKind::none)
      return fmt::format("Name the column that is the clock in a mapping:  channels: {{t_s: {}}}",
                         yaml_name(column.name));
  const std::vector<std::string> names = table.column_names();
  const auto clock =
      std::ranges::find_if(names, [](const auto& name) { return is_like_clock(name); });
  if (clock == names.end()) return kRate;
  return fmt::format(
      "If '{}' is the clock, write in a mapping  channels: {{t_s: {{from: {}, unit: UNIT}}}}\n  {}",
      printable(*clock), yaml_name(*clock), kRate);
}

double given_rate(const LogTable& table, const Mapping& mapping, double rate_Hz) {
  const double rate = mapping.rate_Hz > 0.0 ? mapping.rate_Hz : rate_Hz;
  if (rate > 0.0) return rate;
  throw Error({.place = table.header_place(),
               .problem = "the log has no clock",
               .expected = "a column t_s (or t_ms, time_us ...)",
               .found = "the columns " + table.column_list(),
               .advice = advice_on_clock(table)});
}

}  // namespace

RecordClock record_clock(const LogTable& table, const TableChannels& columns, Rows rows,
                         const Mapping& mapping, double rate_Hz) {
  if (!columns.clock) return {.sample_rate_Hz = given_rate(table, mapping, rate_Hz)};
  const LogColumn& column = *columns.clock->column;
  if (mapping.rate_Hz > 0.0)
    throw Error({.place = mapping.file + ": rate",
                 .problem = "the log has a clock of its own, column " + column.name,
                 .advice = "Remove 'rate:', or drop the column:  drop: [" + column.name + "]"});
  const std::span<const double> values_s =
      std::span(columns.clock->channel.values).subspan(rows.begin, rows.size());
  const Stamps stamps{table, columns, mapping, column, rows, values_s, inspect_clock(values_s)};
  refuse_unusable(stamps);
  RecordClock clock{.start_s = values_s.front()};
  if (mapping.clock.rebuild) {
    clock.sample_rate_Hz = rebuilt_rate(stamps, mapping.clock.max_stray_steps);
  } else if (mapping.clock.resample_Hz > 0.0) {
    refuse_gaps(stamps);
    clock.sample_rate_Hz = mapping.clock.resample_Hz;
  } else {
    clock.sample_rate_Hz = even_rate(stamps);
  }
  return clock;
}

}  // namespace torsio

#include "data/record_clock.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <utility>

#include "data/clock_order.hpp"
#include "data/clock_stamps.hpp"
#include "data/inspect_clock.hpp"
#include "data/log_table.hpp"
#include "data/mapping/column_advice.hpp"
#include "data/names.hpp"
#include "numerics/quantile.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/units.hpp"
#include "torsio/data/load.hpp"

namespace torsio {
namespace {

std::string remedies(const Stamps& stamps) {
  return fmt::format(
      "If the samples were taken evenly and only the stamps are coarse, write in a mapping  {}\n  "
      "If they were taken unevenly, write  {}  or another rate.",
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
             "and the samples even:  {}",
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

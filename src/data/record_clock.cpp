#include "data/record_clock.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>
#include <string>
#include <utility>

#include "data/finest_step.hpp"
#include "data/inspect_clock.hpp"
#include "data/interpolate.hpp"
#include "data/log_table.hpp"
#include "data/mapping/column_advice.hpp"
#include "data/names.hpp"
#include "data/resample.hpp"
#include "torsio/core/error.hpp"
#include "torsio/data/load.hpp"

namespace torsio {
namespace {

constexpr double kLongestGapIntervals = 5.0;

/// The stamps of one record, with what is needed to complain about them.
struct Stamps {
  const LogTable& table;
  const LogColumn& column;
  Rows rows;
  std::span<const double> values_s;
  ClockReport report;

  [[nodiscard]] std::string place(std::size_t sample) const {
    return table.place(rows.begin + sample, column);
  }
};

/// An estimate of the log's rate; repeated stamps contribute only their number.
double rate_of_steps(const Stamps& stamps) {
  constexpr double kRounding = 1e-3;
  constexpr double kCoarseRounding = 1e-2;
  return stamps.report.duplicated > 0 ? simplest_rate(stamps.report.sample_rate_Hz, kCoarseRounding)
                                      : simplest_rate(1.0 / stamps.report.stamp_step_s, kRounding);
}

std::string remedies(const Stamps& stamps) {
  return fmt::format(
      "If the samples were taken evenly and only the stamps are coarse, write in a mapping  clock: "
      "{{rebuild: true}}\n  If they were taken unevenly, write  clock: {{resample: {:.6g}Hz}}  or "
      "another rate.",
      rate_of_steps(stamps));
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
  const auto gap = static_cast<double>(loss.longest + 1);
  throw ClockError(
      {.place = stamps.place(loss.first),
       .problem = fmt::format("{} {} missing, the first after t = {:.6g} s", loss.samples,
                              loss.samples == 1 ? "sample is" : "samples are", before_s),
       .expected = fmt::format("an interval near {:.6g} s", stamps.report.stamp_step_s),
       .found = fmt::format("{:.6g} s", stamps.values_s[loss.first] - before_s),
       .advice = gap > kLongestGapIntervals
                     ? "Cut the log there into two files: the gap is too long for interpolation."
                     : fmt::format("Fill it with straight lines, in a mapping:  clock: {{resample: "
                                   "{:.6g}Hz}}",
                                   rate_of_steps(stamps))});
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
  if (!(stamps.report.sample_rate_Hz > 0.0))
    throw ClockError(
        {.place = stamps.place(stamps.rows.size() - 1),
         .problem = "the last time stamp is not after the first",
         .found = fmt::format("{} s after {} s", stamps.values_s.back(), stamps.values_s.front()),
         .advice = "Drop the clock column in a mapping and give the rate:  rate: 1000Hz"});
}

void refuse_not_increasing(const Stamps& stamps, const std::string& advice) {
  const std::size_t at = stamps.report.first_not_increasing;
  if (at == 0) return;
  throw ClockError(
      {.place = stamps.place(at),
       .problem = fmt::format("the clock does not advance ({} stamps are repeated, {} run "
                              "backward)",
                              stamps.report.duplicated, stamps.report.backward),
       .expected = fmt::format("more than {} s", stamps.values_s[at - 1]),
       .found = fmt::format("{} s", stamps.values_s[at]),
       .advice = advice});
}

double even_rate(const Stamps& stamps) {
  refuse_not_increasing(stamps, remedies(stamps));
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
         .advice = fmt::format("Leave this record out (keep:), or accept it knowingly:  clock: "
                               "{{rebuild: true, max_stray_steps: {:.0f}}}",
                               std::ceil(steps))});
  return report.sample_rate_Hz;
}

void refuse_gaps(const Stamps& stamps) {
  for (std::size_t i = 1; i < stamps.values_s.size(); ++i) {
    const double interval = stamps.values_s[i] - stamps.values_s[i - 1];
    if (interval < 0.0)
      throw ClockError({.place = stamps.place(i),
                        .problem = "the clock runs backward",
                        .expected = fmt::format("at least {} s", stamps.values_s[i - 1]),
                        .found = fmt::format("{} s", stamps.values_s[i]),
                        .advice = "Cut the log there into two files."});
    if (interval > kLongestGapIntervals * stamps.report.stamp_step_s)
      throw ClockError({.place = stamps.place(i),
                        .problem = "a gap too long to interpolate over",
                        .expected = fmt::format("at most {} intervals of {:.4g} s",
                                                kLongestGapIntervals, stamps.report.stamp_step_s),
                        .found = fmt::format("{:.4g} s", interval),
                        .advice = "Cut the log there into two files."});
  }
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
  const Stamps stamps{table, column, rows, values_s, inspect_clock(values_s)};
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

std::vector<double> spread_within_stamps(std::span<const double> stamps) {
  std::vector<double> spread(stamps.begin(), stamps.end());
  double interval = 0.0;
  for (std::size_t begin = 0, end = 0; begin < spread.size(); begin = end) {
    while (end < spread.size() && stamps[end] == stamps[begin]) ++end;
    if (end < spread.size())
      interval = (stamps[end] - stamps[begin]) / static_cast<double>(end - begin);
    for (std::size_t i = begin; i < end; ++i)
      spread[i] = stamps[begin] + static_cast<double>(i - begin) * interval;
  }
  return spread;
}

Channel on_even_clock(const Channel& channel, std::span<const double> stamps_s,
                      double sample_rate_Hz, std::size_t samples) {
  Channel even{.name = channel.name, .values = {}, .step_before_resampling = finest_step(channel)};
  if (channel.fresh.empty()) {
    even.values = interpolate(stamps_s, channel.values, sample_rate_Hz, samples);
    return even;
  }
  even.values.resize(samples);
  even.fresh.assign(samples, 0);
  std::size_t next = 0;
  for (std::size_t i = 0; i < samples; ++i) {
    const double time = stamps_s.front() + static_cast<double>(i) / sample_rate_Hz;
    for (; next < stamps_s.size() && stamps_s[next] <= time; ++next)
      if (channel.fresh[next] != 0) even.fresh[i] = 1;
    even.values[i] = channel.values[std::max<std::size_t>(next, 1) - 1];
  }
  return even;
}

}  // namespace torsio

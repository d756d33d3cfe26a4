#include "data/clock_stamps.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <vector>

#include "data/mapping/row_order.hpp"

namespace torsio {
namespace {

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

}  // namespace

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

double usual_limit_s(const Stamps& stamps) {
  const double period_s =
      stamps.mapping.clock.resample_Hz > 0.0 ? 1.0 / stamps.mapping.clock.resample_Hz : 0.0;
  return std::max(kLongestGapIntervals * stamps.report.stamp_step_s, period_s);
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

std::string clock_line(const Stamps& stamps, std::string_view entry, double split_at_s) {
  if (split_at_s == 0.0) split_at_s = stamps.mapping.clock.split_at_gaps_s;
  std::string line(entry);
  if (stamps.mapping.clock.sort) line += line.empty() ? "sort: true" : ", sort: true";
  if (split_at_s > 0.0)
    line += fmt::format("{}split_at_gaps: {:.4g}s", line.empty() ? "" : ", ", split_at_s);
  return "clock: {" + line + "}";
}

std::string sort_line(const Stamps& stamps) {
  std::string entry = "sort: true";
  if (stamps.mapping.clock.rebuild) entry += ", rebuild: true";
  if (stamps.mapping.clock.resample_Hz > 0.0) entry += ", " + resample_entry(stamps);
  return clock_line(stamps, entry);
}

}  // namespace torsio

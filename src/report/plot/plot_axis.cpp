#include "report/plot/plot_axis.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

namespace torsio {
namespace {

constexpr double kTickSpace = 20.0;  ///< width of a tick with its number, in points

/// The first digits of the ticks within each power of ten, from few ticks to many.
std::array<std::vector<double>, 5> digits_of_ticks() {
  return {{{1}, {1, 3}, {1, 2, 5}, {1, 2, 3, 5, 7}, {1, 2, 3, 4, 5, 6, 7, 8, 9}}};
}

std::vector<double> ticks_with(const std::vector<double>& digits, const PlotRange& decades,
                               int every) {
  std::vector<double> ticks;
  const auto last = static_cast<int>(std::floor(decades.highest));
  for (auto power = static_cast<int>(std::floor(decades.lowest)); power <= last; ++power) {
    if (power % every != 0) continue;
    for (const double digit : digits) {
      const double at = std::log10(digit) + power;
      if (at > decades.lowest - 1e-9 && at < decades.highest + 1e-9)
        ticks.push_back(digit * std::pow(10.0, power));
    }
  }
  return ticks;
}

std::vector<double> linear_ticks(double lowest, double highest) {
  std::vector<double> ticks;
  const double step = tick_step(highest - lowest);
  const auto first = static_cast<long>(std::ceil(lowest / step));
  const auto last = static_cast<long>(std::floor(highest / step));
  for (long i = first; i <= last; ++i) ticks.push_back(static_cast<double>(i) * step);
  return ticks;
}

/// As many as fit: powers of ten, or steps within them; on a short range multiples of a round number.
std::vector<double> log_ticks(const PlotRange& decades, std::size_t most) {
  std::vector<double> best;
  for (const std::vector<double>& digits : digits_of_ticks())
    if (auto ticks = ticks_with(digits, decades, 1); ticks.size() <= most) best = std::move(ticks);
  if (best.size() >= 3) return best;
  const double width = decades.highest - decades.lowest;
  if (width < 3.0)
    return linear_ticks(std::pow(10.0, decades.lowest), std::pow(10.0, decades.highest));
  const double every = std::ceil(width / static_cast<double>(most));
  return ticks_with({1}, decades, static_cast<int>(every));
}

}  // namespace

PlotAxis::PlotAxis(PlotRange range, bool is_logarithmic, bool has_margin, double from, double to)
    : range_(range), is_logarithmic_(is_logarithmic), from_(from), to_(to) {
  if (range_.is_empty()) range_ = {1.0, is_logarithmic ? 10.0 : 2.0};
  if (is_logarithmic) range_ = {std::log10(range_.lowest), std::log10(range_.highest)};
  double margin = has_margin ? 0.04 * (range_.highest - range_.lowest) : 0.0;
  if (range_.highest - range_.lowest < 1e-12 * std::abs(range_.highest) + 1e-300)
    margin = std::max(0.05 * std::abs(range_.highest), 1e-6);
  range_.lowest -= margin;
  range_.highest += margin;
}

double PlotAxis::at(double value) const {
  if (is_logarithmic_) {
    if (!(value > 0.0)) return std::numeric_limits<double>::quiet_NaN();
    value = std::log10(value);
  }
  return from_ + range_.share(value) * (to_ - from_);
}

std::vector<PlotAxis::Tick> PlotAxis::ticks() const {
  std::vector<Tick> ticks;
  if (is_logarithmic_) {
    for (const double value : log_ticks(
             range_, static_cast<std::size_t>(std::max(std::abs(to_ - from_) / kTickSpace, 3.0))))
      ticks.push_back({value, fmt::format("{:.6g}", value)});
    return ticks;
  }
  for (const double value : linear_ticks(range_.lowest, range_.highest))
    ticks.push_back({value, fmt::format("{:.6g}", value)});
  return ticks;
}

}  // namespace torsio

#include "report/plot/plot_axis.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace torsio {

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
  const double width = range_.highest - range_.lowest;
  std::vector<Tick> ticks;
  if (is_logarithmic_ && width >= 1.0) {
    const auto first = static_cast<int>(std::ceil(range_.lowest));
    const auto last = static_cast<int>(std::floor(range_.highest));
    const int step = std::max((last - first + 5) / 6, 1);
    for (int power = first; power <= last; power += step) {
      const double value = std::pow(10.0, power);
      ticks.push_back({value, fmt::format("{:g}", value)});
    }
    return ticks;
  }
  const double step = tick_step(width);
  const auto first = static_cast<long>(std::ceil(range_.lowest / step));
  const auto last = static_cast<long>(std::floor(range_.highest / step));
  for (long i = first; i <= last; ++i) {
    const double at = static_cast<double>(i) * step;
    const double value = is_logarithmic_ ? std::pow(10.0, at) : at;
    ticks.push_back({value, fmt::format("{:.6g}", value)});
  }
  if (is_logarithmic_)
    for (Tick& tick : ticks) tick.text = fmt::format("{:.3g}", tick.value);
  return ticks;
}

}  // namespace torsio

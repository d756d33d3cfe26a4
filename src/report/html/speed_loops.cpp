#include "report/html/speed_loops.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "torsio/core/estimate.hpp"
#include "torsio/core/units.hpp"

namespace torsio {
namespace {

constexpr std::size_t kBands = 3;
constexpr std::size_t kBins = 60;
constexpr std::size_t kLeastInBin = 5;
constexpr double kAtRest = 0.02;     ///< share of the largest speed
constexpr double kLeastRatio = 1.2;  ///< ratio of the limits of neighbouring bands

/// The limits of the bands of speed: the first is where motion begins.
std::vector<double> band_limits(const std::vector<double>& rate) {
  std::vector<double> speeds;
  for (const double value : rate)
    if (std::isfinite(value)) speeds.push_back(std::abs(value));
  std::ranges::sort(speeds);
  if (speeds.empty() || !(speeds.back() > 0.0)) return {};
  // A single wild value does not decide what rest is.
  const double fast = speeds[speeds.size() * 99 / 100];
  const auto moving = std::ranges::lower_bound(speeds, kAtRest * fast);
  std::vector<double> limits = {kAtRest * fast};
  for (std::size_t k = 1; k < kBands; ++k) {
    const auto at = (speeds.end() - moving) * static_cast<std::ptrdiff_t>(k) /
                    static_cast<std::ptrdiff_t>(kBands);
    const double limit = at < speeds.end() - moving ? moving[at] : fast;
    if (limit > kLeastRatio * limits.back() && fast > kLeastRatio * limit) limits.push_back(limit);
  }
  limits.push_back(std::numeric_limits<double>::infinity());
  return limits;
}

/// "1.2 deg/s", or in the unit of the channel.
std::string speed_text(double speed, const std::string& channel) {
  const std::string unit = unit_label(channel);
  if (unit == "rad") return fmt::format("{:.3g} deg/s", deg_from_rad(speed));
  return fmt::format("{:.3g}{}", speed, unit.empty() ? "/s" : " " + unit + "/s");
}

std::string band_label(double from, double to, bool is_first, const std::string& channel) {
  if (is_first && std::isinf(to)) return "all speeds";
  if (is_first) return "up to " + speed_text(to, channel);
  if (std::isinf(to)) return "above " + speed_text(from, channel);
  return fmt::format("{} to {}", speed_text(from, channel), speed_text(to, channel));
}

struct Bin {
  double sum = 0.0;
  std::size_t count = 0;
};

}  // namespace

std::vector<double> rate_of(std::span<const double> x, double rate_Hz) {
  const auto half = std::max<std::size_t>(static_cast<std::size_t>(0.05 * rate_Hz), 1);
  std::vector<double> rate(x.size(), kNotMeasured);
  for (std::size_t n = half; n + half < x.size(); ++n)
    rate[n] = (x[n + half] - x[n - half]) * rate_Hz / (2.0 * static_cast<double>(half));
  return rate;
}

std::string with_unit(const std::string& channel) {
  const std::string unit = unit_label(channel);
  return unit.empty() ? channel : fmt::format("{} [{}]", channel, unit);
}

std::string rate_label(const std::string& channel) {
  const std::string unit = unit_label(channel);
  return fmt::format("d/dt {} [{}]", channel,
                     unit.empty()      ? "1/s"
                     : unit == "rad/s" ? "rad/s2"
                                       : unit + "/s");
}

XyFigure speed_loops(const std::string& x_name, std::span<const double> x,
                     const std::string& y_name, std::span<const double> y, double rate_Hz) {
  XyFigure figure{.title = fmt::format("Mean {} over {} by speed", y_name, x_name),
                  .x = {with_unit(x_name)},
                  .y = {with_unit(y_name)},
                  .series = {}};
  const std::vector<double> rate = rate_of(x, rate_Hz);
  const std::vector<double> limits = band_limits(rate);
  double lowest = std::numeric_limits<double>::infinity();
  double highest = -lowest;
  for (const double value : x) {
    lowest = std::fmin(lowest, value);
    highest = std::fmax(highest, value);
  }
  if (limits.empty() || !(highest > lowest)) return figure;
  const double width = (highest - lowest) / static_cast<double>(kBins);
  for (std::size_t band = 0; band + 1 < limits.size(); ++band) {
    std::array<std::array<Bin, kBins>, 2> means{};  // while x rises, while it falls
    for (std::size_t n = 0; n < std::min(x.size(), y.size()); ++n) {
      const double speed = std::abs(rate[n]);
      if (!(speed >= limits[band] && speed < limits[band + 1]) || !std::isfinite(y[n])) continue;
      const auto bin = std::min(static_cast<std::size_t>((x[n] - lowest) / width), kBins - 1);
      Bin& mean = means[rate[n] > 0.0 ? 0 : 1][bin];
      mean.sum += y[n];
      ++mean.count;
    }
    XySeries loop{
        .label = band_label(limits[band], limits[band + 1], band == 0, x_name), .x = {}, .y = {}};
    const auto add = [&](std::size_t direction, std::size_t bin) {
      const Bin& mean = means[direction][bin];
      const bool has_mean = mean.count >= kLeastInBin;
      loop.x.push_back(lowest + (static_cast<double>(bin) + 0.5) * width);
      loop.y.push_back(has_mean ? mean.sum / static_cast<double>(mean.count) : kNotMeasured);
    };
    for (std::size_t bin = 0; bin < kBins; ++bin) add(0, bin);
    for (std::size_t bin = kBins; bin-- > 0;) add(1, bin);
    figure.series.push_back(std::move(loop));
  }
  return figure;
}

}  // namespace torsio

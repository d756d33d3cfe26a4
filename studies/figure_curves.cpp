#include "figure_curves.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "core/running_mean.hpp"
#include "torsio/core/estimate.hpp"
#include "torsio/core/units.hpp"

namespace torsio {
namespace {

constexpr double kReversalShare = 0.02;  // share of the range
constexpr std::size_t kLoopBins = 40;

/// +1 where a signal rises and -1 where it falls, with the hysteresis of a reversal; 0 before its first way.
std::vector<int> directions(const std::vector<double>& values) {
  const auto [lowest, highest] = std::ranges::minmax(values);
  const double least = kReversalShare * (highest - lowest);
  double low = values.front();  // since the last reversal
  double high = low;
  int direction = 0;
  std::vector<int> all;
  all.reserve(values.size());
  for (const double value : values) {
    low = std::min(low, value);
    high = std::max(high, value);
    if (direction <= 0 && value > low + least) {
      direction = 1;
      high = value;
    } else if (direction >= 0 && value < high - least) {
      direction = -1;
      low = value;
    }
    all.push_back(direction);
  }
  return all;
}

/// RMS distance of points at equal steps from their regression line.
double residual_of_line(const std::vector<std::pair<double, double>>& points) {
  RunningMean x_mean;
  RunningMean y_mean;
  for (const auto& [x, y] : points) {
    x_mean.add(x);
    y_mean.add(y);
  }
  double xx = 0.0;
  double xy = 0.0;
  for (const auto& [x, y] : points) {
    xx += (x - x_mean.mean()) * (x - x_mean.mean());
    xy += (x - x_mean.mean()) * (y - y_mean.mean());
  }
  double squares = 0.0;
  for (const auto& [x, y] : points) {
    const double rest = y - y_mean.mean() - xy / xx * (x - x_mean.mean());
    squares += rest * rest;
  }
  return std::sqrt(squares / static_cast<double>(points.size()));
}

}  // namespace

std::vector<double> every(const std::vector<double>& values, std::size_t step) {
  std::vector<double> kept;
  for (std::size_t n = 0; n < values.size(); n += step) kept.push_back(values[n]);
  return kept;
}

XyFigure trace_figure(std::string title, const char* unit) {
  return {.title = std::move(title), .x = {"time [s]"}, .y = {unit}, .series = {}};
}

void add_trace(XyFigure& figure, std::string label, const std::vector<double>& values,
               CurveRole role, const Thinning& thinning) {
  XySeries series{
      .label = std::move(label), .role = role, .x = {}, .y = every(values, thinning.step)};
  for (std::size_t n = 0; n < series.y.size(); ++n)
    series.x.push_back(static_cast<double>(n * thinning.step) / thinning.rate_Hz);
  figure.series.push_back(std::move(series));
}

XyFigure loop_figure(std::string title) {
  return {.title = std::move(title), .x = {"deflection [deg]"}, .y = {"torque [Nm]"}, .series = {}};
}

void add_loop(XyFigure& figure, std::string label, const std::vector<double>& deflection_deg,
              const std::vector<double>& torque_Nm, CurveRole role) {
  figure.series.push_back(
      {.label = std::move(label), .role = role, .x = deflection_deg, .y = torque_Nm});
}

std::vector<double> tracking_error(const Recording& run) {
  std::vector<double> error_Nm = run.channel("truth_torque_Nm").values;
  const std::vector<double>& wanted_Nm = run.channel("wanted_torque_Nm").values;
  for (std::size_t n = 0; n < error_Nm.size(); ++n) error_Nm[n] -= wanted_Nm[n];
  return error_Nm;
}

std::vector<double> deflection_curve(const Recording& recording, std::size_t step) {
  std::vector<double> deflection_deg;
  const std::vector<double>& gear_rad = recording.channel("gear_angle_rad").values;
  const std::vector<double>& joint_rad = recording.channel("joint_angle_rad").values;
  for (std::size_t n = 0; n < gear_rad.size(); n += step)
    deflection_deg.push_back(deg_from_rad(gear_rad[n] - joint_rad[n]));
  return deflection_deg;
}

std::vector<std::pair<double, double>> rms_by_frequency(const std::vector<double>& values,
                                                        double rate_Hz,
                                                        const Chirp::Parameters& chirp,
                                                        std::span<const double> edges_Hz) {
  std::vector<RunningMean> squares(edges_Hz.size() - 1);
  for (std::size_t n = 0; n < values.size(); ++n) {
    const double share = static_cast<double>(n) / rate_Hz / chirp.duration_s;
    const double frequency_Hz = chirp.start_Hz + (chirp.end_Hz - chirp.start_Hz) * share;
    const auto above = std::ranges::upper_bound(edges_Hz, frequency_Hz);
    if (above == edges_Hz.begin() || above == edges_Hz.end()) continue;
    squares[static_cast<std::size_t>(above - edges_Hz.begin()) - 1].add(values[n] * values[n]);
  }
  std::vector<std::pair<double, double>> all;
  for (std::size_t b = 0; b < squares.size(); ++b)
    all.emplace_back(0.5 * (edges_Hz[b] + edges_Hz[b + 1]),
                     squares[b].count() == 0 ? kNotMeasured : std::sqrt(squares[b].mean()));
  return all;
}

LoopMeasures loop_measures(const std::vector<double>& deflection_deg,
                           const std::vector<double>& torque_Nm) {
  const auto [low_deg, high_deg] = std::ranges::minmax(deflection_deg);
  const std::vector<int> direction = directions(torque_Nm);
  std::array<std::array<RunningMean, 2>, kLoopBins> bins{};
  for (std::size_t n = 0; n < torque_Nm.size(); ++n) {
    if (direction[n] == 0) continue;
    const double share = (deflection_deg[n] - low_deg) / (high_deg - low_deg);
    const auto bin =
        std::min(kLoopBins - 1, static_cast<std::size_t>(share * static_cast<double>(kLoopBins)));
    bins[bin][direction[n] > 0 ? 1 : 0].add(torque_Nm[n]);
  }
  RunningMean width_Nm;
  std::vector<std::pair<double, double>> middle;
  for (std::size_t b = 0; b < kLoopBins; ++b) {
    const auto& [down, up] = bins[b];
    if (down.count() == 0 || up.count() == 0) continue;
    middle.emplace_back(static_cast<double>(b), 0.5 * (down.mean() + up.mean()));
    if (b >= kLoopBins / 4 && b < 3 * kLoopBins / 4) width_Nm.add(up.mean() - down.mean());
  }
  return {.width_Nm = std::abs(width_Nm.mean()), .nonlinear_Nm = residual_of_line(middle)};
}

}  // namespace torsio

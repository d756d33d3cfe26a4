#include "torsio/sim/closed_loop/tracking_score.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include "numerics/metrics_accumulator.hpp"
#include "sim/closed_loop/tracking_parts.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/fault.hpp"
#include "torsio/numerics/metrics.hpp"

namespace torsio {
namespace {

constexpr double kSettling_s = 2.0;
constexpr double kVisible = 0.02;  // smallest limit cycle, as a share of the reference's amplitude

using Values = std::span<const double>;

double overshoot_of(Values wanted, Values torque) {
  double largest = 0.0;
  double last = 0.0;
  for (std::size_t begin = 0; begin < wanted.size();) {
    std::size_t end = begin;
    const double level = wanted[begin];
    const double height = level - last;
    double beyond = 0.0;
    for (; end < wanted.size() && wanted[end] == level; ++end)
      if (height != 0.0) beyond = std::max(beyond, (torque[end] - level) / height);
    largest = std::max(largest, beyond);
    last = level;
    begin = end;
  }
  return largest;
}

Metrics metrics_of(Values torque, Values wanted, std::size_t first) {
  MetricsAccumulator errors;
  errors.add(torque.subspan(first), wanted.subspan(first));
  return errors.metrics();
}

/// Counted from tick `first` on, where the value is one of those.
template <class Counts>
std::size_t ticks(Values values, std::size_t first, const Counts& counts) {
  return static_cast<std::size_t>(std::ranges::count_if(values.subspan(first), counts));
}

std::size_t rises(Values flags, std::size_t first) {
  std::size_t count = 0;
  for (std::size_t i = first; i < flags.size(); ++i)
    if (flags[i] != 0.0 && (i == 0 || flags[i - 1] == 0.0)) ++count;
  return count;
}

/// sqrt(a² + b²) of y ≈ a sin φ + b cos φ + c, by least squares over whole turns.
double first_harmonic(Values values, std::span<const double> phases) {
  const auto n = static_cast<double>(values.size());
  double mean = 0.0;
  for (const double value : values) mean += value / n;
  double ss = 0.0;
  double sc = 0.0;
  double cc = 0.0;
  double ys = 0.0;
  double yc = 0.0;
  for (std::size_t i = 0; i < values.size(); ++i) {
    const double s = std::sin(phases[i]);
    const double c = std::cos(phases[i]);
    ss += s * s;
    sc += s * c;
    cc += c * c;
    ys += (values[i] - mean) * s;
    yc += (values[i] - mean) * c;
  }
  const double determinant = ss * cc - sc * sc;
  return std::hypot((ys * cc - yc * sc) / determinant, (yc * ss - ys * sc) / determinant);
}

}  // namespace

TrackingScore tracking_score(const Recording& record, double amplitude_Nm, bool has_steps) {
  const Values wanted = record.channel("wanted_torque_Nm").values;
  const Values torque = record.channel("truth_torque_Nm").values;
  const double rate_Hz = record.sample_rate_Hz();
  const auto first = static_cast<std::size_t>(kSettling_s * rate_Hz);
  if (record.size() <= first)
    throw Error({.place = record.name(),
                 .expected = fmt::format("a run of more than {} s", kSettling_s),
                 .found = fmt::format("{} s", static_cast<double>(record.size()) / rate_Hz)});
  const Metrics joint = metrics_of(torque, wanted, first);
  const Metrics load_cell = metrics_of(record.channel("torque_Nm").values, wanted, first);
  std::vector<double> error(wanted.begin(), wanted.end());
  for (std::size_t i = 0; i < error.size(); ++i) error[i] -= torque[i];
  const Values limited = record.channel("is_limited_1").values;
  const auto is_fault = [](double value) { return value != 0.0; };
  TrackingScore score{
      .mad = joint.mad,
      .std_abs = joint.std_abs,
      .rmse = joint.rmse,
      .max_abs = joint.max_abs,
      .error_ratio = joint.mad / amplitude_Nm,
      .load_cell_mad = load_cell.mad,
      .load_cell_rmse = load_cell.rmse,
      .limit_cycle = find_limit_cycle(Values(error).subspan(first), wanted.subspan(first),
                                      kVisible * amplitude_Nm, rate_Hz),
      .limit_events = rises(limited, first),
      .limited_s = static_cast<double>(ticks(limited, first, is_fault)) / rate_Hz,
      .inverse_faults = ticks(record.channel("inverse_fault_1").values, first, is_fault),
      .loop_faults = ticks(record.channel("fault_1").values, first, is_fault)};
  if (has_steps) score.overshoot = overshoot_of(wanted, torque);
  return score;
}

double bandwidth(std::span<const double> torque_Nm, const LogSweep::Parameters& sweep,
                 double sample_rate_Hz) {
  const double log_ratio = std::log(sweep.end_Hz / sweep.start_Hz);
  std::vector<double> phases(torque_Nm.size());
  std::vector<double> frequencies_Hz(torque_Nm.size());
  for (std::size_t i = 0; i < phases.size(); ++i) {
    const double share = static_cast<double>(i) / sample_rate_Hz / sweep.duration_s;
    frequencies_Hz[i] = sweep.start_Hz * std::exp(log_ratio * share);
    phases[i] = 2.0 * std::numbers::pi * sweep.duration_s / log_ratio *
                (frequencies_Hz[i] - sweep.start_Hz);
  }
  const double least = std::numbers::sqrt2 / 2.0 * sweep.amplitude;
  double last_Hz = 0.0;
  double last = 0.0;
  for (std::size_t begin = 0; begin < phases.size();) {
    // Whole turns, as many as a third of an octave has, at least one.
    const double turns = std::max(1.0, std::floor((std::cbrt(2.0) - 1.0) * frequencies_Hz[begin] *
                                                  sweep.duration_s / log_ratio));
    std::size_t end = begin;
    while (end < phases.size() && phases[end] < phases[begin] + 2.0 * std::numbers::pi * turns)
      ++end;
    if (end == phases.size()) break;
    const double gain = first_harmonic(torque_Nm.subspan(begin, end - begin),
                                       std::span(phases).subspan(begin, end - begin));
    const double at_Hz = std::sqrt(frequencies_Hz[begin] * frequencies_Hz[end]);
    if (gain < least) {
      if (last_Hz == 0.0) return 0.0;
      const double share = (last - least) / (last - gain);
      return last_Hz * std::pow(at_Hz / last_Hz, share);
    }
    last = gain;
    last_Hz = at_Hz;
    begin = end;
  }
  return std::numeric_limits<double>::infinity();
}

}  // namespace torsio

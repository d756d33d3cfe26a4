#include "data/resample.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "data/csv/csv_table.hpp"
#include "data/finest_step.hpp"
#include "data/interpolate.hpp"
#include "data/whole_samples.hpp"
#include "torsio/data/write.hpp"

namespace torsio {
namespace {

/// A signal between its samples; positions count source samples.
class PiecewiseLinear {
 public:
  explicit PiecewiseLinear(std::span<const double> values) : values_(values) {}

  [[nodiscard]] double at(double position) const {
    const std::size_t left = index(position);
    const double share = position - static_cast<double>(left);
    if (share == 0.0) return values_[left];
    return values_[left] + share * (values_[left + 1] - values_[left]);
  }

  [[nodiscard]] double mean(double from, double to) const {
    double integral = 0.0;
    double left = from;
    double left_value = at(from);
    while (left < to) {
      const double right = std::min(std::floor(left) + 1.0, to);
      const double right_value = at(right);
      integral += 0.5 * (left_value + right_value) * (right - left);
      left = right;
      left_value = right_value;
    }
    return integral / (to - from);
  }

 private:
  [[nodiscard]] std::size_t index(double position) const {
    return std::min(static_cast<std::size_t>(position), values_.size() - 1);
  }
  std::span<const double> values_;
};

std::vector<double> held(const Channel& channel, double step, std::size_t samples,
                         std::vector<std::uint8_t>& fresh) {
  std::vector<double> values(samples);
  fresh.assign(samples, 0);
  std::size_t next = 0;
  for (std::size_t i = 0; i < samples; ++i) {
    const auto last = std::min(static_cast<std::size_t>(static_cast<double>(i) * step + 1e-9),
                               channel.values.size() - 1);
    for (; next <= last; ++next)
      if (channel.is_fresh(next)) fresh[i] = 1;
    values[i] = channel.values[last];
  }
  return values;
}

std::vector<double> smooth(const Channel& channel, double step, std::size_t samples) {
  const PiecewiseLinear signal(channel.values);
  const auto last = static_cast<double>(channel.values.size() - 1);
  std::vector<double> values(samples);
  for (std::size_t i = 0; i < samples; ++i) {
    const double position = std::min(static_cast<double>(i) * step, last);
    const double half = step > 1.0 ? std::min({0.5 * step, position, last - position}) : 0.0;
    values[i] = half > 0.0 ? signal.mean(position - half, position + half) : signal.at(position);
  }
  return values;
}

}  // namespace

Recording resample(const Recording& recording, double sample_rate_Hz) {
  const double start_s = recording.time_s(0);
  Recording result(recording.name(), sample_rate_Hz, start_s);
  result.source = recording.source;
  result.definitions = recording.definitions;
  result.zeros = recording.zeros;
  result.uncertainties = recording.uncertainties;
  result.columns = recording.columns;
  result.labels = recording.labels;
  if (recording.size() == 0) return result;

  const double step = recording.sample_rate_Hz() / sample_rate_Hz;
  const std::size_t samples =
      1 + whole_samples(static_cast<double>(recording.size() - 1) / step + 1e-9,
                        CsvLimits{}.values / recording.channels().size(),
                        fmt::format("{} at {} Hz", recording.name(), sample_rate_Hz));
  const auto is_condition = [&](const std::string& name) {
    return std::ranges::find(recording.conditions(), name) != recording.conditions().end();
  };
  for (const Channel& channel : recording.channels()) {
    if (is_condition(channel.name)) continue;
    std::vector<std::uint8_t> fresh;
    auto values = channel.fresh.empty() ? smooth(channel, step, samples)
                                        : held(channel, step, samples, fresh);
    result.add({.name = channel.name,
                .values = std::move(values),
                .fresh = std::move(fresh),
                .step_before_resampling = finest_step(channel)});
  }
  for (const std::string& name : recording.conditions())
    result.add_condition(name, recording.channel(name).values.front());
  return result;
}

std::vector<double> interpolate(std::span<const double> stamps, std::span<const double> values,
                                double sample_rate_Hz, std::size_t samples) {
  std::vector<double> even(samples);
  std::size_t left = 0;
  for (std::size_t i = 0; i < samples; ++i) {
    const double time = stamps.front() + static_cast<double>(i) / sample_rate_Hz;
    while (left + 2 < stamps.size() && stamps[left + 1] <= time) ++left;
    const double share = std::min((time - stamps[left]) / (stamps[left + 1] - stamps[left]), 1.0);
    even[i] =
        share == 0.0 ? values[left] : values[left] + share * (values[left + 1] - values[left]);
  }
  return even;
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

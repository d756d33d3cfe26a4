// Targets that were computed from an input and not measured.
#include "fit/common/leak.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>
#include <utility>
#include <vector>

#include "core/all_finite.hpp"
#include "data/finest_step.hpp"
#include "data/recording_rows.hpp"
#include "fit/common/load_leak.hpp"
#include "fit/common/passes.hpp"
#include "numerics/golden_section.hpp"
#include "numerics/least_squares.hpp"
#include "torsio/core/error.hpp"
#include "torsio/fit/common/inputs.hpp"

namespace torsio {
namespace {

constexpr double kUnexplained = 1e-9;  ///< share of the variance of numbers with all their digits
constexpr double kMaxUnexplainedShare = 1e-6;  ///< the same for numbers with few digits
constexpr double kDigits = 2.0;                ///< errors of the digits that are accepted

/// Running sums of a linear model y = a + b x.
class LineSums {
 public:
  void add(double x, double y) {
    n_ += 1.0;
    const double dx = x - mean_x_;
    const double dy = y - mean_y_;
    mean_x_ += dx / n_;
    mean_y_ += dy / n_;
    xx_ += dx * (x - mean_x_);
    xy_ += dx * (y - mean_y_);
    yy_ += dy * (y - mean_y_);
  }
  [[nodiscard]] bool is_determined() const { return n_ > 2.0 && xx_ > 0.0 && yy_ > 0.0; }
  [[nodiscard]] double count() const { return n_; }
  [[nodiscard]] double slope() const { return xy_ / xx_; }
  [[nodiscard]] double target_squares() const { return yy_; }
  [[nodiscard]] double missed() const { return yy_ - xy_ * xy_ / xx_; }

 private:
  double n_ = 0.0, mean_x_ = 0.0, mean_y_ = 0.0, xx_ = 0.0, xy_ = 0.0, yy_ = 0.0;
};

/// The largest resolution of a channel in the recordings.
double resolution_of(const Dataset& dataset, const std::string& channel) {
  double step = 0.0;
  for (const DatasetRecord& record : dataset.records)
    step = std::max(step, finest_step(record.recording.channel(channel)));
  return step;
}

double resolution_of(const Dataset& dataset, const std::vector<std::string>& channels) {
  double squares = 0.0;
  for (const std::string& channel : channels)
    squares += resolution_of(dataset, channel) * resolution_of(dataset, channel);
  return std::sqrt(squares);
}

/// What rounding may leave of a sum of squares `all`, of a target over inputs that are rounded as well.
double accepted(double all, double count, double target_step, double slope, double input_step) {
  const double rounding =
      (target_step * target_step + slope * slope * input_step * input_step) / 12.0;
  return std::clamp(kDigits * count * rounding, kUnexplained * all, kMaxUnexplainedShare * all);
}

/// Whether the inputs together give the target in the same way: each source of a difference of two
/// sensors alone is not a leak.
bool is_plane(const Dataset& dataset, const FeatureSpec& spec) {
  constexpr std::size_t kEnough = 2000;  // samples per record
  std::vector<double> rows;
  std::vector<double> measured;
  LineSums line;  // over the first input
  for (const DatasetRecord& record : dataset.records) {
    const Recording& recording = record.recording;
    const Channel& target = recording.channel(dataset.target);
    FeaturePipeline pipeline(spec, recording.sample_rate_Hz());
    RecordingRows raw_rows(recording, pipeline.raw_inputs());
    const std::size_t stride = recording.size() / kEnough + 1;
    for (std::size_t i = 0; i < recording.size(); ++i) {
      const std::span<const double> raw = raw_rows.at(i);
      if (!all_finite(raw)) continue;
      const std::span<const double> features = pipeline.step(raw);
      if (i % stride != 0 || !target.is_fresh(i) || !std::isfinite(target.values[i])) continue;
      rows.push_back(1.0);
      rows.insert(rows.end(), features.begin(), features.end());
      measured.push_back(target.values[i]);
      line.add(features.front(), measured.back());
    }
  }
  Matrix design(measured.size(), spec.inputs.size() + 1);
  if (design.rows <= design.columns || !line.is_determined()) return false;
  design.values = std::move(rows);
  const std::vector<double> plane = least_squares(design, measured).coefficients;
  double missed = 0.0;
  for (std::size_t i = 0; i < measured.size(); ++i) {
    double computed = 0.0;
    for (std::size_t j = 0; j < plane.size(); ++j) computed += plane[j] * design(i, j);
    missed += (measured[i] - computed) * (measured[i] - computed);
  }
  const FeaturePipeline pipeline(spec, dataset.sample_rate_Hz());
  return missed < accepted(line.target_squares(), line.count(),
                           resolution_of(dataset, dataset.target), plane[1],
                           resolution_of(dataset, pipeline.raw_inputs()));
}

/// The first input of each recording, and the target where it is a new value.
struct FirstInput {
  std::vector<double> values;
  const Channel* target;
};

/// The line over the first input after a low-pass filter y += share (x - y).
LineSums filtered_line(const std::vector<FirstInput>& inputs, double share) {
  LineSums line;
  for (const FirstInput& input : inputs) {
    double y = std::numeric_limits<double>::quiet_NaN();
    for (std::size_t i = 0; i < input.values.size(); ++i) {
      const double x = input.values[i];
      if (!std::isfinite(x)) continue;
      y = std::isfinite(y) ? y + share * (x - y) : x;
      if (input.target->is_fresh(i) && std::isfinite(input.target->values[i]))
        line.add(y, input.target->values[i]);
    }
  }
  return line;
}

/// Whether the target is linear in the first input after a low-pass filter of first order, as drives have.
bool is_filtered_line(const Dataset& dataset, const FeatureSpec& spec) {
  constexpr std::size_t kEnough = 20000;  // samples of a record
  constexpr int kShares = 40;
  constexpr double kSmallestShare = 1e-3;
  constexpr double kNearlyALine = 0.3;
  std::vector<FirstInput> inputs;
  for (const DatasetRecord& record : dataset.records) {
    inputs.push_back(
        {first_feature(record.recording, spec), &record.recording.channel(dataset.target)});
    if (inputs.back().values.size() > kEnough) inputs.back().values.resize(kEnough);
  }
  const auto left_at = [&](double log_share) {
    const LineSums line = filtered_line(inputs, std::exp(log_share));
    return line.is_determined() ? line.missed() / line.target_squares() : 1.0;
  };
  if (!(left_at(0.0) < kNearlyALine)) return false;
  const double step = -std::log(kSmallestShare) / kShares;
  double best = 0.0;
  double least = 1.0;
  for (int k = 0; k < kShares; ++k)
    if (const double left = left_at(-k * step); left < least) least = left, best = -k * step;
  constexpr double kTolerance = 1e-7;
  const LineSums line = filtered_line(
      inputs,
      std::exp(golden_section(left_at, best - step, std::min(best + step, 0.0), kTolerance)));
  FeatureSpec first = spec;
  first.inputs.resize(1);
  const FeaturePipeline pipeline(first, dataset.sample_rate_Hz());
  return line.is_determined() &&
         line.missed() < accepted(line.target_squares(), line.count(),
                                  resolution_of(dataset, dataset.target), line.slope(),
                                  resolution_of(dataset, pipeline.raw_inputs()));
}

}  // namespace

bool is_straight_line(const Dataset& dataset, const std::string& input) {
  LineSums line;
  for (const DatasetRecord& record : dataset.records) {
    const Channel& target = record.recording.channel(dataset.target);
    const std::vector<double>& x = record.recording.channel(input).values;
    for (std::size_t i = 0; i < x.size(); ++i)
      if (target.is_fresh(i) && std::isfinite(x[i]) && std::isfinite(target.values[i]))
        line.add(x[i], target.values[i]);
  }
  return line.is_determined() &&
         line.missed() < accepted(line.target_squares(), line.count(),
                                  resolution_of(dataset, dataset.target), line.slope(),
                                  resolution_of(dataset, input));
}

std::string find_leak(const Dataset& dataset, const FeatureSpec& spec) {
  ++passes().leak_searches;
  const FeaturePipeline pipeline(spec, dataset.sample_rate_Hz());
  for (const std::string& input : pipeline.raw_inputs())
    if (input.starts_with(kTruthPrefix) ||
        std::ranges::find(dataset.target_computed_from, input) !=
            dataset.target_computed_from.end() ||
        is_straight_line(dataset, input))
      return input;
  if (dataset.load_target.is_used())
    if (std::string leak = load_leak(spec); !leak.empty()) return leak;
  FeatureSpec first = spec;
  first.inputs.resize(1);
  if (is_plane(dataset, first)) return spec.inputs.front();
  if (is_plane(dataset, spec)) return fmt::format("{}", fmt::join(spec.inputs, ", "));
  if (is_filtered_line(dataset, spec))
    return fmt::format("a low-pass filter of {}", spec.inputs.front());
  return {};
}

std::string refuse_leak(const Dataset& dataset, const FeatureSpec& spec, bool allow_leak) {
  std::string leak = find_leak(dataset, spec);
  if (!leak.empty() && !allow_leak)
    throw UsageError({.place = leak,
                      .problem = leak.starts_with(kTruthPrefix)
                                     ? "no sensor measures this channel of a simulation"
                                     : dataset.target + " was computed from this input: a model "
                                                        "would learn the formula",
                      .advice = leak_advice(dataset, spec, leak) +
                                " Rows that are marked as leaks are accepted with --allow-leak."});
  return leak;
}

std::string leak_advice(const Dataset& dataset, const FeatureSpec& spec, const std::string& leak) {
  if (dataset.load_target.is_used() && leak == load_leak(spec))
    return "The torque of a known load follows from the joint's angle and acceleration: choose "
           "inputs in which an angle "
           "only occurs in the deflection of the spring, and speeds.";
  const bool is_one_of_several = spec.inputs.size() > 1 && leak != spec.inputs.front() &&
                                 std::ranges::find(spec.inputs, leak) != spec.inputs.end();
  if (is_one_of_several || leak.starts_with(kTruthPrefix) ||
      std::ranges::find(dataset.target_computed_from, leak) != dataset.target_computed_from.end())
    return "Leave it out of --inputs: a model would learn the formula, not the spring.";
  return fmt::format(
      "No sensor measured this {}: record one with a torque sensor, or leave the input out.",
      dataset.target);
}

}  // namespace torsio

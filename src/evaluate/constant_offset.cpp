#include "evaluate/constant_offset.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <optional>
#include <utility>

#include "evaluate/measured_samples.hpp"
#include "torsio/core/units.hpp"

namespace torsio {
namespace {

/// Mean and standard deviation in one pass.
struct Spread {
  std::size_t samples = 0;
  double mean = 0.0;
  double squares = 0.0;

  void add(double value) noexcept {
    ++samples;
    const double change = value - mean;
    mean += change / static_cast<double>(samples);
    squares += change * (value - mean);
  }
  [[nodiscard]] double std_dev() const noexcept {
    return std::sqrt(squares / static_cast<double>(samples));
  }
};

struct Errors {
  Spread error;
  Spread target;
};

/// @param estimate_at NaN where the sample is not scored
template <class EstimateAt>
Errors errors_of(const DatasetRecord& record, const Channel& target, Role role,
                 const EstimateAt& estimate_at) {
  Errors errors;
  std::size_t measured = 0;
  for (const Segment& segment : record.segments)
    for (std::size_t i = segment.begin; segment.role == role && i < segment.end; ++i) {
      if (!is_measured(target, i)) continue;
      const double estimate = estimate_at(i, measured++);
      if (!std::isfinite(estimate)) continue;
      errors.error.add(estimate - target.values[i]);
      errors.target.add(target.values[i]);
    }
  return errors;
}

/// The error of the model on data like those of its training: the least, since error bars are widened without evidence.
double usual_error(const EstimatorSettings& settings) {
  double least = settings.fallback.residual_std;
  for (const double std_dev : settings.residuals.std_dev) least = std::fmin(least, std_dev);
  return std::isfinite(least) ? least : 0.0;
}

/// Without the motion of the target an offset cannot be distinguished from another stiffness.
bool is_constant_offset(const Errors& errors, const EstimatorSettings& settings) {
  constexpr std::size_t kFewest = 100;
  constexpr double kMuchLarger = 4.0;
  constexpr double kExplainedTarget = 0.5;
  const double offset = std::abs(errors.error.mean);
  const double scatter = errors.error.std_dev();
  return errors.error.samples >= kFewest && offset >= kMuchLarger * scatter &&
         scatter <= kExplainedTarget * errors.target.std_dev() &&
         offset >= kMuchLarger * usual_error(settings);
}

/// The raw inputs whose zeros move the deflection.
std::vector<std::string> angles_of(const Estimator& estimator) {
  std::vector<std::string> angles;
  for (const char* name :
       {"spring_deflection_rad", "joint_angle_rad", "gear_angle_rad", "motor_angle_rad"})
    if (std::ranges::find(estimator.raw_inputs(), name) != estimator.raw_inputs().end())
      angles.emplace_back(name);
  return angles;
}

struct OtherZero {
  std::string channel;
  double change_rad = 0.0;
  double scatter = 0.0;  ///< that remains with this zero
};

/// The zero of an angle with which the mean error vanishes; none without such an input or zero.
std::optional<OtherZero> other_zero(const Estimator& estimator, const Dataset& dataset,
                                    const DatasetRecord& record, Role role, double offset) {
  const std::vector<std::string> angles = angles_of(estimator);
  if (angles.empty()) return std::nullopt;
  const Recording& recording = record.recording;
  const Channel& target = recording.channel(dataset.target);
  const auto errors_with = [&](double change_rad) {
    Recording shifted(recording.name(), recording.sample_rate_Hz(), recording.time_s(0));
    for (const std::string& input : estimator.raw_inputs()) {
      Channel channel = recording.channel(input);
      if (input == angles.front())
        for (double& value : channel.values) value += change_rad;
      shifted.add(std::move(channel));
    }
    const Prediction prediction =
        predict(estimator, shifted, {&target, dataset.initialise_samples});
    return errors_of(record, target, role, [&](std::size_t i, std::size_t) {
      const bool is_scored =
          prediction.estimates[i].fault != Fault::warming_up && i >= prediction.initialised;
      return is_scored ? prediction.estimates[i].value : kNotMeasured;
    });
  };
  constexpr int kLargestCount = 6;
  constexpr double kVanished = 0.02;
  double last_rad = 0.0;
  double last = offset;
  const auto& [lowest, highest, margin] = estimator.settings().ranges;
  double next_rad = 0.02 * (highest.front() - lowest.front());
  for (int n = 0; n < kLargestCount && std::isfinite(next_rad); ++n) {
    const Spread error = errors_with(next_rad).error;
    if (std::abs(error.mean) <= kVanished * std::abs(offset))
      return OtherZero{angles.front(), next_rad, error.std_dev()};
    const double step_rad = -error.mean * (next_rad - last_rad) / (error.mean - last);
    last_rad = std::exchange(next_rad, next_rad + step_rad);
    last = error.mean;
  }
  return std::nullopt;
}

std::string warning_of(const Estimator& estimator, const Dataset& dataset,
                       const DatasetRecord& record, Role role, const Errors& errors) {
  constexpr double kBetter = 0.7;
  const double offset = errors.error.mean;
  const double scatter = errors.error.std_dev();
  const std::vector<std::string> angles = angles_of(estimator);
  const auto zero = other_zero(estimator, dataset, record, role, offset);
  const bool is_angle = zero && zero->scatter < kBetter * scatter;
  const bool is_target = zero && kBetter * zero->scatter > scatter;
  const std::string unit = unit_label(dataset.target);
  std::string text = fmt::format(
      "{}: the estimate is {:.3g} {} too {} throughout (constant over the whole recording, +- "
      "{:.2g} "
      "{}): ",
      record.recording.name(), std::abs(offset), unit, offset < 0.0 ? "low" : "high", scatter,
      unit);
  const std::string of_target = fmt::format(
      "is there another zero of {0}, or a constant load on its sensor? Record {0} with its zero "
      "taken "
      "at no load",
      dataset.target);
  if (is_target) return text + of_target;
  text += "was the zero of an encoder changed, as by a power-up?";
  if (zero)
    text += fmt::format(
        " {:.3g} rad added to {} {}.", zero->change_rad, zero->channel,
        is_angle ? "explain it better than another zero of " + dataset.target : "explain it");
  const auto& zeroed = estimator.settings().zeroed_channels;
  if (!zeroed.empty()) {
    text +=
        fmt::format(" The zero of {} is taken from each recording: is there no load at that time?",
                    fmt::join(zeroed, ", "));
  } else if (!angles.empty()) {
    std::vector<std::string> rules;
    rules.reserve(angles.size());
    for (const std::string& angle : angles)
      rules.push_back(fmt::format("{{channel: {}, first: 0.5s}}", angle));
    text += fmt::format(
        " Begin each recording at no load, take the zeros there in the mapping (zero: [{}]), train "
        "again, and call set_zero in the loop after each power-up.",
        fmt::join(rules, ", "));
  }
  if (!is_angle) text += " The data do not distinguish this from another cause: " + of_target;
  return text;
}

}  // namespace

std::vector<std::string> offset_warnings(const Estimator& estimator, const Dataset& dataset,
                                         Role role, const SplitScore& score) {
  std::vector<std::string> warnings;
  std::size_t scored = 0;
  for (const DatasetRecord& record : dataset.records) {
    if (!record.has_role(role)) continue;
    const std::vector<double>& values = score.recordings.at(scored++).estimates.values;
    const Errors errors =
        errors_of(record, record.recording.channel(dataset.target), role,
                  [&](std::size_t, std::size_t measured) { return values[measured]; });
    if (is_constant_offset(errors, estimator.settings()))
      warnings.push_back(warning_of(estimator, dataset, record, role, errors));
  }
  return warnings;
}

}  // namespace torsio

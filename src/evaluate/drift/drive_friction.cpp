#include "evaluate/drift/drive_friction.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <string>
#include <utility>
#include <vector>

#include "evaluate/drift/direction_fit.hpp"
#include "evaluate/drift/verdicts.hpp"
#include "numerics/quantile.hpp"
#include "torsio/core/units.hpp"
#include "torsio/signal/feature_pipeline.hpp"

namespace torsio {
namespace {

constexpr double kTolerance = 0.2;  // 10 K, and the load at which the drive slides
constexpr double kSmallest = 0.5;
constexpr double kSlidingShare = 0.05;  // share of the quantile of the speed
constexpr double kSpeedQuantile = 0.95;
constexpr double kLeastDriveFriction = 0.5;  // over the error of the reference
constexpr std::size_t kDirection = 2;        // column of sgn w

/// The motor current among the inputs of the reference; empty: it has none.
std::string current_of(const ModelFile& reference, double sample_rate_Hz) {
  const FeaturePipeline pipeline(reference.settings.features, sample_rate_Hz);
  const auto& channels = pipeline.raw_inputs();
  const auto current = std::ranges::find(channels, "A", &unit_label);
  return current == channels.end() ? "" : *current;
}

/// The angle of the motor, else of the gear; empty: the recording has neither.
std::string angle_of(const Recording& recording) {
  for (const char* name : {"motor_angle_rad", "gear_angle_rad"})
    if (recording.has(name)) return name;
  return "";
}

/// Samples at which the drive slides.
struct Sliding {
  std::vector<double> current;
  std::vector<double> speed;
  std::vector<double> acceleration;
  std::vector<double> estimated;
  std::vector<double> residual;

  [[nodiscard]] std::size_t size() const noexcept { return current.size(); }
};

Sliding sliding(std::span<const Sequence> features, std::span<const ComparedRun> runs) {
  const auto is_measured = [](const Sequence& of, std::size_t n) {
    return std::ranges::all_of(of.features.row(n),
                               [](double value) { return std::isfinite(value); });
  };
  std::vector<double> speeds;
  for (std::size_t i = 0; i < runs.size(); ++i)
    for (const std::size_t n : runs[i].rows)
      if (is_measured(features[i], n)) speeds.push_back(std::abs(features[i].features(n, 1)));
  if (speeds.empty()) return {};
  const double least = kSlidingShare * quantile(std::move(speeds), kSpeedQuantile);
  Sliding of;
  for (std::size_t i = 0; i < runs.size(); ++i)
    for (const std::size_t n : runs[i].rows) {
      const Matrix& drive = features[i].features;
      if (!is_measured(features[i], n) || !(std::abs(drive(n, 1)) > least)) continue;
      of.current.push_back(drive(n, 0));
      of.speed.push_back(drive(n, 1));
      of.acceleration.push_back(drive(n, 2));
      of.estimated.push_back(runs[i].output[n]);
      of.residual.push_back(runs[i].target->values[n] - runs[i].output[n]);
    }
  return of;
}

/// The columns 1, i, -friction sgn w, dw/dt.
Matrix columns_of(const Sliding& of, double friction) {
  Matrix columns(of.size(), 4);
  for (std::size_t n = 0; n < of.size(); ++n) {
    columns(n, 0) = 1.0;
    columns(n, 1) = of.current[n];
    columns(n, kDirection) = std::copysign(friction, -of.speed[n]);
    columns(n, 3) = of.acceleration[n];
  }
  return columns;
}

}  // namespace

std::optional<DriftQuantity> drive_friction(const ModelFile& reference, const Dataset& dataset,
                                            std::span<const ComparedRun> runs,
                                            const DriftOptions& options) {
  const Recording& first = *runs.front().recording;
  const std::string current = current_of(reference, first.sample_rate_Hz());
  if (current.empty()) return std::nullopt;
  const std::string unit = unit_label(reference.settings.target);
  DriftQuantity result{.name = drift_names::kDriveFriction, .unit = unit, .is_of_joint = false};
  const std::string angle = angle_of(first);
  if (angle.empty()) {
    result.reason = "the recordings have neither motor_angle_rad nor gear_angle_rad";
    return result;
  }
  const std::string speed = "lowpass(rate(" + angle + "), 20Hz)";
  FeatureSpec drive = reference.settings.features;
  drive.inputs = {current, speed, "rate(" + speed + ")"};
  const Sliding of = sliding(training_data(dataset, drive, Role::test).sequences, runs);
  if (of.size() < kLeastDriftSamples) {
    result.reason = "the drive slides in too few samples";
    return result;
  }
  const DirectionFit known =
      fit_directions(columns_of(of, 1.0), of.estimated, options.resamples, options.seed);
  if (!(known.own_rms[kDirection] > 0.0)) {
    result.reason = "the drive slides in one direction: move to and fro";
    return result;
  }
  const double before = known.coefficients[kDirection];
  const Matrix columns = columns_of(of, before);
  const DirectionFit fit = fit_directions(columns, of.residual, options.resamples, options.seed);
  if (!(before > kLeastDriveFriction * fit.residual_rms())) {
    result.reason =
        "the reference has no friction of the drive above its error: give it an input with the "
        "direction of motion, as tanh(lowpass(rate(motor_angle_rad), 50Hz) / 0.6), and --set "
        "rates=true";
    return result;
  }
  result = direction_quantity(drift_names::kDriveFriction, unit, before, fit, kDirection,
                              fit.lasting_error(noise_lag(runs.front())), kTolerance, kSmallest);
  result.is_of_joint = false;
  return result;
}

}  // namespace torsio

#include <fmt/format.h>

#include <cmath>
#include <string>
#include <utility>

#include "evaluate/fit_and_score.hpp"
#include "sim/closed_loop/impedance_checks.hpp"
#include "sim/sensors/sensed_channels.hpp"
#include "sim/sensors/sensor_set.hpp"
#include "torsio/core/error.hpp"
#include "torsio/evaluate/comparison.hpp"
#include "torsio/fit/common/inputs.hpp"
#include "torsio/sim/closed_loop/impedance_tracking.hpp"
#include "torsio/sim/closed_loop/tracking.hpp"
#include "torsio/sim/experiments/experiment.hpp"

namespace torsio {
namespace {

/// A discrete model with memory runs at the rate of its training, which the loop holds.
double estimator_rate_Hz(const ModelFile& model) {
  const double ticks = std::round(kBenchRate_Hz / model.settings.sample_rate_Hz);
  const bool is_whole =
      ticks >= 1.0 && std::abs(ticks * model.settings.sample_rate_Hz - kBenchRate_Hz) < 1e-6;
  return is_whole ? model.settings.sample_rate_Hz : kBenchRate_Hz;
}

/// One sentence, without the place and the advice of the error.
std::string reason_of(const ErrorReport& report) {
  std::string reason = "the model has no inverse";
  for (const auto& [word, part] : {std::pair(": ", &report.problem),
                                   {": expected ", &report.expected},
                                   {", found ", &report.found}})
    if (!part->empty()) reason += word + part->substr(0, part->find('\n'));
  return reason;
}

}  // namespace

ImpedanceModel impedance_model(std::string name, const ModelFile& model, const DataSheet& sheet) {
  std::string reason = "the torque of this actuator's tube is controlled by its twist";
  if (!has_tube(sheet)) {
    try {
      AnyInverse inverse = inverse_of(model);
      return {.name = std::move(name), .use = std::move(inverse)};
    } catch (const Error& error) {
      reason = reason_of(error.report());
    }
  }
  Estimator estimator = make_estimator(model, estimator_rate_Hz(model));
  const EstimatorSettings& settings = estimator.settings();
  if (settings.target != "torque_Nm")
    throw Error({.place = kImpedance,
                 .expected = "a model of torque_Nm, or one with an inverse",
                 .found = fmt::format("a model of {}; {}", settings.target, reason)});
  for (const std::string& channel : settings.zeroed_channels) estimator.set_zero(channel, 0.0);
  (void)sensed_inputs(sheet, estimator.raw_inputs(), kImpedance);
  return {.name = std::move(name), .use = std::move(estimator), .reason = std::move(reason)};
}

LinearInverse spring_line(const DataSheet& sheet, std::uint64_t seed, const Progress& progress) {
  if (has_tube(sheet))
    throw UsageError({.place = kImpedance,
                      .expected = "an actuator whose spring is at the joint",
                      .found = sheet.name});
  if (sheet.family == ActuatorFamily::series_elastic) return sweep_line(sheet, seed, progress);
  Dataset cycle;
  Recording recording = simulate(sheet, {.experiment = "static-cycle", .seed = seed}, progress);
  const std::size_t samples = recording.size();
  cycle.records.push_back({std::move(recording), whole_record(samples, Role::train)});
  const char* const twist = sheet.family == ActuatorFamily::rubber_clutch
                                ? "input_angle_rad - joint_angle_rad"
                                : "spring_deflection_rad";
  const TrainedModel trained =
      train_model(cycle, {.family = "linear", .features = resolve_inputs(cycle, {twist})}, seed);
  const LinearFallback& line = trained.file.settings.fallback;
  return LinearInverse(line.slope.front(), line.intercept);
}

}  // namespace torsio

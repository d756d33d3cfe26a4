#include "evaluate/drift/compared_run.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "fit/common/reference_check.hpp"
#include "torsio/core/error.hpp"
#include "torsio/evaluate/evaluate.hpp"

namespace torsio {
namespace {

constexpr double kLeastDuration_s = 5.0;
constexpr double kManyOutside = 0.5;

std::string seconds(double value) { return fmt::format("{:.3g} s", value); }

void check_torque(const ComparedRun& of) {
  std::vector<double> estimated;
  std::vector<double> measured;
  for (const std::size_t n : of.rows) {
    estimated.push_back(of.output[n]);
    measured.push_back(of.target->values[n]);
  }
  require_plausible_reference(of.recording->name() + ": " + of.target->name, {estimated, measured});
}

[[noreturn]] void refuse_short(const Recording& recording, std::string found) {
  throw Error(
      {.place = recording.name(),
       .problem = "too short to compare it with the model",
       .expected = fmt::format("at least {} and {} measured samples after the model has settled",
                               seconds(kLeastDuration_s), kLeastDriftSamples),
       .found = std::move(found),
       .advice = "Record about a minute of slow motion in both directions."});
}

}  // namespace

void require_length(const Recording& recording) {
  const double measured_s = static_cast<double>(recording.size()) / recording.sample_rate_Hz();
  if (measured_s < kLeastDuration_s) refuse_short(recording, seconds(measured_s));
}

std::size_t noise_lag(const ComparedRun& run) noexcept {
  constexpr double kMemory_s = 0.005;
  const std::vector<std::size_t>& rows = run.rows;
  const auto samples = static_cast<double>(rows.back() - rows.front() + 1);
  const double compared_Hz =
      static_cast<double>(rows.size()) / samples * run.recording->sample_rate_Hz();
  return static_cast<std::size_t>(std::max(1.0, std::round(kMemory_s * compared_Hz)));
}

ComparedRun compared_run(const ModelFile& model, const DatasetRecord& record,
                         const Dataset& dataset, Sequence sequence) {
  const Recording& recording = record.recording;
  ComparedRun of{.x = {},
                 .features = std::move(sequence.features),
                 .output = {},
                 .rows = {},
                 .target = &recording.channel(dataset.target),
                 .recording = &recording};
  const Prediction prediction = predict(make_estimator(model, recording.sample_rate_Hz()),
                                        recording, {of.target, dataset.initialise_samples});
  double last = 0.0;
  for (std::size_t n = 0; n < recording.size(); ++n) {
    if (std::isfinite(of.features(n, 0))) last = of.features(n, 0);
    of.x.push_back(last);
    const Estimate& estimate = prediction.estimates[n];
    of.output.push_back(estimate.value);
    if (sequence.use[n] == 0 || n < prediction.initialised) continue;
    if (estimate.fault == Fault::warming_up) continue;
    if (estimate.fault != Fault::none) {
      ++of.outside;
    } else {
      of.rows.push_back(n);
    }
  }
  if (static_cast<double>(of.outside) >
      kManyOutside * static_cast<double>(of.outside + of.rows.size()))
    throw Error(
        {.place = recording.name(),
         .problem = "the model cannot be compared with it",
         .expected = "a motion within the range of the training",
         .found = fmt::format("{} of {} samples with a fault of the model", of.outside,
                              of.outside + of.rows.size()),
         .advice = "torsio estimate states the faults; record a motion as in the training."});
  if (of.rows.size() < kLeastDriftSamples)
    refuse_short(recording, fmt::format("{} samples", of.rows.size()));
  check_torque(of);
  return of;
}

}  // namespace torsio

#include "report/html/model_run.hpp"

#include <algorithm>
#include <optional>
#include <utility>

#include "numerics/parallel.hpp"
#include "torsio/core/error.hpp"
#include "torsio/evaluate/evaluate.hpp"
#include "torsio/fit/common/inputs.hpp"

namespace torsio {
namespace {

ModelRun run_model(const Dataset& dataset, const DatasetRecord& record, const ReportedModel& model,
                   Role role) {
  const Recording& recording = record.recording;
  const Channel& target = recording.channel(dataset.target);
  const Prediction prediction = predict(make_estimator(*model.file, recording.sample_rate_Hz()),
                                        recording, {&target, dataset.initialise_samples});
  const std::size_t samples = prediction.estimates.size();
  ModelRun run{.label = model.label,
               .value = std::vector<double>(samples, kNotMeasured),
               .std_dev = std::vector<double>(samples, kNotMeasured),
               .residual = std::vector<double>(samples, kNotMeasured),
               .guarded = std::vector<std::uint8_t>(samples, 0)};
  for (std::size_t n = 0; n < samples; ++n) {
    const Estimate& estimate = prediction.estimates[n];
    if (estimate.fault == Fault::warming_up) continue;
    run.value[n] = estimate.value;
    run.std_dev[n] = estimate.std_dev;
    run.guarded[n] = estimate.fault != Fault::none ? 1 : 0;
  }
  for (const Segment& segment : record.segments) {
    if (segment.role != role) continue;
    for (std::size_t n = std::max(segment.begin, prediction.initialised); n < segment.end; ++n)
      if (target.is_fresh(n)) run.residual[n] = run.value[n] - target.values[n];
  }
  return run;
}

}  // namespace

RecordRuns run_models(const Dataset& dataset, const DatasetRecord& record,
                      const std::vector<ReportedModel>& models, Role role) {
  RecordRuns result{.recording = &record.recording,
                    .input = {},
                    .input_name = {},
                    .target = &record.recording.channel(dataset.target),
                    .runs = {},
                    .failures = {}};
  std::vector<std::optional<ModelRun>> runs(models.size());
  std::vector<std::string> failures(models.size());
  for_each_chunk(models.size(), 0, [&](std::size_t m) {
    try {
      runs[m] = run_model(dataset, record, models[m], role);
    } catch (const Error& error) {
      failures[m] = models[m].label + ": " + error.what();
    }
  });
  for (std::size_t m = 0; m < models.size(); ++m) {
    if (!runs[m]) {
      result.failures.push_back(std::move(failures[m]));
      continue;
    }
    result.runs.push_back(std::move(*runs[m]));
    if (!result.input.empty()) continue;
    const FeatureSpec& features = models[m].file->settings.features;
    result.input = first_feature(record.recording, features);
    result.input_name = features.inputs.front();
  }
  return result;
}

}  // namespace torsio

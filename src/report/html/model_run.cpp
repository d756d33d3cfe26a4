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

ModelRun sample_by_sample(const ScoredRun& scored, const std::string& label, Role role) {
  const std::vector<Estimate>& estimates = scored.prediction.estimates;
  const std::size_t samples = estimates.size();
  ModelRun run{.label = label,
               .value = std::vector<double>(samples, kNotMeasured),
               .std_dev = std::vector<double>(samples, kNotMeasured),
               .residual = std::vector<double>(samples, kNotMeasured),
               .guarded = std::vector<std::uint8_t>(samples, 0)};
  for (std::size_t n = 0; n < samples; ++n) {
    const Estimate& estimate = estimates[n];
    if (estimate.fault == Fault::warming_up) continue;
    run.value[n] = estimate.value;
    run.std_dev[n] = scored.compared_std_dev(n);
    run.guarded[n] = estimate.fault != Fault::none ? 1 : 0;
  }
  for (const Segment& segment : scored.record->segments) {
    if (segment.role != role) continue;
    for (std::size_t n = segment.begin; n < segment.end; ++n)
      if (scored.target->is_fresh(n)) run.residual[n] = scored.residual(n);
  }
  return run;
}

ModelRun run_model(const Dataset& dataset, const DatasetRecord& record, const ReportedModel& model,
                   Role role) {
  if (model.runs != nullptr) {
    const auto known = std::ranges::find(*model.runs, &record, &ScoredRun::record);
    if (known != model.runs->end()) return sample_by_sample(*known, model.label, role);
  }
  const Recording& recording = record.recording;
  return sample_by_sample(
      scored_run(make_estimator(*model.file, recording.sample_rate_Hz()), dataset, record),
      model.label, role);
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

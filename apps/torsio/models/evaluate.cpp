#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <string>
#include <utility>
#include <vector>

#include "common/data_flags.hpp"
#include "common/model_doubts.hpp"
#include "common/output.hpp"
#include "common/progress_bar.hpp"
#include "common/report_output.hpp"
#include "common/report_text.hpp"
#include "evaluate/compared_target.hpp"
#include "evaluate/slope_change.hpp"
#include "report/html/model_report.hpp"
#include "report/model_description.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/provenance.hpp"
#include "torsio/data/write.hpp"
#include "torsio/evaluate/comparison.hpp"
#include "torsio/evaluate/estimate_recording.hpp"
#include "torsio/files/model_file.hpp"
#include "torsio/report/html/verb_reports.hpp"
#include "torsio/report/results.hpp"
#include "verbs.hpp"

namespace {

struct EvaluateFlags {
  std::string model;
  DataFlags data;
  std::string predictions;
  JsonOutput json;
  ReportOutput report;
};

/// Target, estimate, error bar and fault of every sample of one recording: the run that is scored.
torsio::Recording prediction_recording(const torsio::ScoredRun& run) {
  const torsio::Recording& recording = run.record->recording;
  const std::string& target = run.target->name;
  torsio::Channel estimate{torsio::estimate_channel(target), {}};
  torsio::Channel std_dev{torsio::error_bar_channel(target), {}};
  torsio::Channel fault{"fault_1", {}};
  for (const torsio::Estimate& output : run.prediction.estimates) {
    estimate.values.push_back(output.value);
    std_dev.values.push_back(output.std_dev);
    fault.values.push_back(static_cast<double>(output.fault));
  }
  torsio::Recording result(recording.name(), recording.sample_rate_Hz(), recording.time_s(0));
  result.add(*run.target);
  result.add(std::move(estimate));
  result.add(std::move(std_dev));
  result.add(std::move(fault));
  return result;
}

/// The part of the error bars without which the shares are counted, where the sensor is that of the training.
std::string common_error_text(const std::vector<torsio::ScoredRun>& runs,
                              const std::string& target) {
  const auto run = std::ranges::find_if(
      runs, [](const torsio::ScoredRun& each) { return each.common.is_stated(); });
  if (run == runs.end()) return {};
  return fmt::format(
      "in 1 sd, in 2 sd: without {} of the reference sensor, whose error these recordings contain, "
      "too.\nThe error bars of --predictions contain it.\n",
      torsio::uncertainty_text(run->common, target));
}

/// Recordings that state another error of the sensor than the training: the table counts them as of the same sensor.
std::string other_sensor_text(const torsio::ModelFile& file, const torsio::Dataset& dataset) {
  const std::string& target = dataset.target;
  const torsio::SensorUncertainty& trained = file.settings.target_uncertainty;
  if (dataset.load_target.is_used() || target != file.settings.target) return {};
  for (const torsio::DatasetRecord& record : dataset.records) {
    const auto& stated = record.recording.uncertainties;
    const auto own = stated.find(target);
    if (own == stated.end() || own->second == trained) continue;
    return fmt::format(
        "{} states {} of its sensor, the training {}.\nThe shares are those of one sensor; of two "
        "sensors the errors add up, and the shares are lower than they should be.\n",
        record.recording.name(), torsio::uncertainty_text(own->second, target),
        trained.is_stated() ? torsio::uncertainty_text(trained, target) : "none");
  }
  return {};
}

/// Without recordings they would be ignored.
void require_no_flags_of_recordings(const EvaluateFlags& flags) {
  for (const auto& [flag, value] : {std::pair{"--predictions", flags.predictions},
                                    {"--mapping", flags.data.mapping},
                                    {"--target", flags.data.target},
                                    {"--load", flags.data.load_file},
                                    {"--rate", flags.data.rate}})
    if (!value.empty())
      throw torsio::UsageError(
          {.place = flag,
           .expected = "a recording that it refers to",
           .found = "none",
           .advice = "Name the recording after the model: torsio evaluate " + flags.model +
                     " log.csv. Without one, the description of the model is shown."});
}

void run(EvaluateFlags& flags) {
  flags.data.check_outputs(
      {flags.predictions, flags.json.destination, flags.report.destination, flags.report.plot},
      {flags.model});
  const torsio::ModelFile file = torsio::load_model(flags.model);
  if (flags.data.recordings.empty()) {
    require_no_flags_of_recordings(flags);
    ProgressBar progress;
    const torsio::SlowCycle cycle = torsio::slow_cycle(file, progress.listener());
    if (flags.json.wants_tables()) print(torsio::model_description(file, cycle));
    flags.json.write(torsio::model_description_json(file, cycle));
    if (flags.report.is_wanted()) {
      torsio::ReportDocument document = torsio::text_report(
          "Description of " + flags.model,
          {"Without recordings, only what the file states and what a slow cycle shows."},
          torsio::model_description(file, cycle));
      document.sections.push_back(torsio::card_section(file, "Card of the model"));
      flags.report.write(std::move(document));
    }
    return;
  }
  DataFlags data = flags.data;
  data.use_model(file, flags.model);
  if (!flags.data.target.empty()) data.target = torsio::compared_target(file, flags.data.target);
  ProgressBar progress;
  torsio::Dataset dataset = data.load_as_test(progress.listener());
  data.compute_target(dataset, file.settings.features, file.card.load_target);
  if (!flags.predictions.empty() && dataset.records.size() != 1)
    throw torsio::UsageError({.place = "--predictions",
                              .expected = "one recording",
                              .found = std::to_string(dataset.records.size()),
                              .advice = "Call evaluate once for each recording."});
  warn_of_seen_recordings(file, dataset);
  warn_of_missing_zeros(file, dataset);
  const std::vector<torsio::ScoredRun> runs = torsio::scored_runs(
      torsio::make_estimator(file, dataset.sample_rate_Hz()), dataset, progress.listener());
  torsio::Results results = torsio::evaluate_model(file, dataset, runs);
  std::ranges::move(torsio::slope_warnings(file, runs), std::back_inserter(results.warnings));
  warn_of_another_unit(file, dataset);
  if (!flags.predictions.empty())
    torsio::write_recording(prediction_recording(runs.front()), flags.predictions);
  if (flags.json.wants_tables())
    print(evaluation_text(results) + common_error_text(runs, dataset.target) +
          other_sensor_text(file, dataset));
  flags.json.write(torsio::results_json(results));
  if (flags.report.is_wanted())
    flags.report.write(
        torsio::evaluation_report(results, runs, file, flags.model, dataset, progress.listener()));
  if (std::ranges::all_of(results.rows,
                          [](const torsio::ResultRow& row) { return row.status != "ok"; }))
    throw torsio::Error({.problem = first_failure(results)});
}

}  // namespace

void add_evaluate(CLI::App& app) {
  auto flags = std::make_shared<EvaluateFlags>();
  CLI::App* verb = app.add_subcommand(
      "evaluate",
      "score a model file on recordings; without recordings, show its description, stiffness, loop "
      "width and friction");
  verb->footer(
      "Example: torsio evaluate joint.safetensors validation.csv --predictions out.csv\n"
      "fault_1 in the predictions is torsio::Fault: 0 none, 1 input not finite, 2 wrong input "
      "count,\n"
      "3 warming up, 4 zero not set, 5 outside the training range, 6 recovering, 7 wrong rate,\n"
      "8 model not finite, 9 diverged (docs/robot/estimator.md)");
  verb->add_option("MODEL", flags->model, "model file written by torsio fit")->required();
  flags->data.add_recordings(*verb, "recordings to score on, or a manifest with roles");
  flags->data.add_model_mapping(*verb);
  verb->add_option("--target", flags->data.target,
                   "channel to compare the estimate with, in the unit of the model's target "
                   "(default: the model's target)");
  flags->data.add_load(*verb,
                       "load file: compare the estimate with the torque of this known load "
                       "(docs/use/known_load.md)");
  flags->data.add_initialise(*verb);
  verb->add_option("-o,--output,--predictions", flags->predictions,
                   "write target, estimate, error bar and fault of one recording as CSV");
  flags->json.add(*verb, "the results");
  flags->report.add(*verb);
  verb->callback([flags] { run(*flags); });
}

#include <memory>
#include <string>
#include <vector>

#include "common/data_flags.hpp"
#include "common/model_doubts.hpp"
#include "common/output.hpp"
#include "common/progress_bar.hpp"
#include "common/report_output.hpp"
#include "report/html/model_report.hpp"
#include "torsio/core/error.hpp"
#include "torsio/evaluate/estimate_recording.hpp"
#include "torsio/files/model_file.hpp"
#include "torsio/report/estimates.hpp"
#include "torsio/report/html/verb_reports.hpp"
#include "torsio/signal/feature_pipeline.hpp"
#include "verbs.hpp"

namespace {

struct EstimateFlags {
  std::string model;
  DataFlags data;
  std::string output;
  JsonOutput json;
  ReportOutput report;
};

void run(EstimateFlags& flags) {
  flags.data.check_outputs(
      {flags.output, flags.json.destination, flags.report.destination, flags.report.plot},
      {flags.model});
  require_ending("--output", flags.output, {".csv", ".gz"});
  const torsio::ModelFile file = torsio::load_model(flags.model);
  flags.data.use_model(file, flags.model);
  ProgressBar progress;
  const std::vector<std::string> inputs =
      torsio::FeaturePipeline(file.settings.features, file.settings.sample_rate_Hz).raw_inputs();
  const torsio::Dataset dataset = flags.data.load_inputs(inputs, progress.listener());
  warn_of_missing_zeros(file, dataset);
  std::vector<torsio::EstimatedRecording> estimated;
  std::vector<torsio::EstimateSummary> summaries;
  for (const torsio::DatasetRecord& record : dataset.records) {
    estimated.push_back(
        torsio::estimate_recording(torsio::make_estimator(file, record.recording.sample_rate_Hz()),
                                   record.recording, progress.listener()));
    summaries.push_back(torsio::summary_of(estimated.back(), file.settings.target));
  }
  if (!flags.output.empty()) torsio::write_estimates(estimated, flags.output);
  if (flags.json.wants_tables() && !is_standard_output(flags.output))
    print(torsio::estimates_text(summaries, file.settings));
  flags.json.write(torsio::estimates_json(summaries, file.settings));
  if (flags.report.is_wanted()) {
    torsio::ReportDocument document =
        torsio::estimate_report(estimated, summaries, file, flags.model);
    document.origin = torsio::origin_of(dataset);
    flags.report.write(std::move(document));
  }
}

}  // namespace

void add_estimate(CLI::App& app) {
  auto flags = std::make_shared<EstimateFlags>();
  CLI::App* verb = app.add_subcommand(
      "estimate", "estimate the torque of recordings without a torque channel with a model file");
  verb->footer(
      "Example: torsio estimate joint.safetensors robot_log.csv -o torque.csv\n"
      "The columns of the output: time, the raw inputs of the model, the estimate, its error bar,\n"
      "the novelty for a model that has one, the fault by its name, the recording. A sample with "
      "an\n"
      "input that was not measured has the fault input_not_finite.");
  verb->add_option("MODEL", flags->model, "model file written by torsio fit")->required();
  flags->data.add_recordings(*verb, "recordings with the inputs of the model, or a manifest");
  flags->data.add_model_mapping(*verb);
  verb->add_option("-o,--output", flags->output,
                   "CSV file to write, compressed if it ends in .gz; - for standard output");
  flags->json.add(*verb, "the summary");
  flags->report.add(*verb);
  verb->callback([flags] { run(*flags); });
}

#include <fmt/format.h>

#include <algorithm>

#include "common/data_flags.hpp"
#include "common/output.hpp"
#include "common/progress_bar.hpp"
#include "common/report_output.hpp"
#include "common/report_text.hpp"
#include "report/plots.hpp"
#include "torsio/core/error.hpp"
#include "torsio/evaluate/comparison.hpp"
#include "torsio/files/model_file.hpp"
#include "torsio/fit/common/inputs.hpp"
#include "torsio/report/html/verb_reports.hpp"
#include "torsio/report/results.hpp"
#include "torsio/report/text_table.hpp"
#include "torsio/sim/experiments/experiment.hpp"
#include "verbs.hpp"

namespace {

struct DemoFlags {
  DataFlags data;
  std::vector<std::string> test;
  std::string actuator = "dfki-50";
  std::string models = "all";
  std::string output = "torsio-demo.safetensors";
  ReportOutput report = {"torsio-demo.html"};
  std::uint64_t seed = kDefaultSeed;
  JsonOutput json;
};

/// The first test record's loop: what was measured against the first input.
std::string loop_plot(const torsio::Dataset& dataset, const torsio::ModelFile& model) {
  const auto is_test = [](const torsio::DatasetRecord& record) {
    return record.has_role(torsio::Role::test);
  };
  const torsio::Recording& recording = std::ranges::find_if(dataset.records, is_test)->recording;
  const torsio::FeatureSpec& features = model.settings.features;
  const std::vector<double> x = torsio::first_feature(recording, features);
  const std::vector<double>& target = recording.channel(dataset.target).values;
  return fmt::format("\n{} over {}, as measured in {}\n", dataset.target, features.inputs.front(),
                     recording.name()) +
         torsio::terminal_plot({{"", x, target}}, {features.inputs.front(), dataset.target});
}

/// Saves the best model, loads it back and streams the test records through it, as a robot would.
std::string deployment(const DemoFlags& flags, const torsio::Dataset& dataset,
                       const torsio::TrainedModel& best) {
  torsio::save_model(flags.output, best.file);
  const torsio::Estimator estimator = torsio::load_estimator(flags.output);
  const torsio::SplitScore score = torsio::evaluate(estimator, dataset, torsio::Role::test);
  const torsio::Score& together = score.together;
  return fmt::format(
      "\nbest model {} saved to {}, loaded back, {} samples streamed through it:\n"
      "RMSE {}, {:.0f} ns per step (99.9 %: {:.0f} ns), {} samples outside the training range "
      "or faulty\n",
      best.file.card.fitted_as, flags.output, together.metrics.samples,
      torsio::fixed_text(together.metrics.rmse, 3), together.step_ns_p50, together.step_ns_p999,
      together.guarded_samples);
}

void run(DemoFlags& flags) {
  flags.data.check_outputs(
      {flags.output, flags.json.destination, flags.report.destination, flags.report.plot},
      flags.test);
  require_model_file(flags.output);
  ProgressBar progress;
  const bool is_simulated = flags.data.recordings.empty();
  if (is_simulated) remark(fmt::format("simulating four sweeps of {} ...", flags.actuator));
  const torsio::Dataset dataset =
      is_simulated ? torsio::sweep_dataset(flags.actuator, flags.seed, progress.listener())
                   : flags.data.load({}, flags.test, progress.listener());
  const auto choices = torsio::model_choices(dataset, flags.models, flags.data.wanted_inputs());
  const torsio::Comparison comparison =
      torsio::compare(dataset, choices, flags.seed, false, progress.listener());
  if (!comparison.best) throw torsio::Error({.problem = first_failure(comparison.results)});
  const std::string deployed = deployment(flags, dataset, *comparison.best);
  if (flags.json.wants_tables())
    print(comparison_text(comparison.results) + loop_plot(dataset, comparison.best->file) +
          deployed);
  flags.json.write(torsio::results_json(comparison.results));
  flags.report.write(torsio::comparison_report(comparison, dataset, progress.listener()));
}

}  // namespace

void add_demo(CLI::App& app) {
  auto flags = std::make_shared<DemoFlags>();
  CLI::App* verb = app.add_subcommand("demo",
                                      "the complete workflow, from recordings to a deployed model, "
                                      "on a simulated bench or on your files");
  verb->footer(
      "Example: torsio demo\n         torsio demo sweep1.csv sweep2.csv --test other_lever.csv");
  flags->data.add_recordings(
      *verb, "recordings to train on, or a manifest with roles; none: simulate a bench");
  flags->data.add_mapping(*verb);
  flags->data.add_target_and_inputs(*verb);
  verb->add_option("--test", flags->test, "held-out recordings");
  verb->add_option("--actuator", flags->actuator, "the simulated bench")->capture_default_str();
  verb->add_option("--models", flags->models, "as for compare")->capture_default_str();
  verb->add_option("-o,--output", flags->output, "file of the best model")->capture_default_str();
  add_seed(*verb, flags->seed, "seed of the random number generators");
  flags->json.add(*verb, "the results of the comparison");
  flags->report.add(*verb);
  verb->callback([flags] { run(*flags); });
}

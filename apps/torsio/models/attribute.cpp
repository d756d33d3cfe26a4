#include <cmath>

#include "common/data_flags.hpp"
#include "common/model_doubts.hpp"
#include "common/output.hpp"
#include "common/progress_bar.hpp"
#include "common/report_output.hpp"
#include "core/quantity.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/units.hpp"
#include "torsio/evaluate/attribution.hpp"
#include "torsio/evaluate/comparison.hpp"
#include "torsio/files/model_file.hpp"
#include "torsio/report/attribution.hpp"
#include "torsio/report/html/verb_reports.hpp"
#include "verbs.hpp"

namespace {

struct AttributeFlags {
  std::string model;
  DataFlags data;
  torsio::AttributionOptions options = {.seed = kDefaultSeed};
  std::string window = "auto";
  JsonOutput json;
  ReportOutput report;
};

/// 0: found from the model.
std::size_t window_samples(const AttributeFlags& flags, double sample_rate_Hz) {
  if (flags.window == "auto") return 0;
  const double window_s = torsio::signed_quantity_with_unit(flags.window, "s", "--window");
  const double samples = std::round(window_s * sample_rate_Hz);
  if (!(samples >= 1.0 && samples <= 1e9))
    throw torsio::UsageError({.place = "--window",
                              .expected = "auto, or a time of at least one sample",
                              .found = flags.window});
  return static_cast<std::size_t>(samples);
}

/// All recordings, whatever their roles in a manifest.
torsio::Dataset load(const AttributeFlags& flags, const torsio::ModelFile& file,
                     const torsio::Progress& progress) {
  DataFlags data = flags.data;
  data.use_model(file, flags.model);
  torsio::Dataset dataset = data.load_as_test(progress);
  for (torsio::DatasetRecord& record : dataset.records)
    record.segments = torsio::whole_record(record.recording.size(), torsio::Role::test);
  dataset.check();
  return dataset;
}

void run(AttributeFlags& flags) {
  flags.data.check_outputs({flags.json.destination, flags.report.destination, flags.report.plot},
                           {flags.model});
  const torsio::ModelFile file = torsio::load_model(flags.model);
  ProgressBar progress;
  const torsio::Dataset dataset = load(flags, file, progress.listener());
  warn_of_missing_zeros(file, dataset);
  // Refuses a sample rate that the model cannot run at.
  (void)torsio::make_estimator(file, dataset.sample_rate_Hz());
  torsio::AttributionOptions options = flags.options;
  options.window_samples = window_samples(flags, dataset.sample_rate_Hz());
  const torsio::AnyModel model(file.parameters);
  const torsio::TrainingData data =
      torsio::training_data(dataset, file.settings.features, torsio::Role::test);
  const torsio::Attribution attribution =
      torsio::attribute(model, data, options, progress.listener());
  const torsio::AttributionSubject subject{.model = flags.model,
                                           .family = file.card.fitted_as,
                                           .target = dataset.target,
                                           .sample_rate_Hz = dataset.sample_rate_Hz()};
  if (flags.json.wants_tables()) print(torsio::attribution_text(attribution, subject));
  flags.json.write(torsio::attribution_json(attribution, subject));
  if (flags.report.is_wanted())
    flags.report.write(torsio::attribution_report(attribution, subject));
}

}  // namespace

void add_attribute(CLI::App& app) {
  auto flags = std::make_shared<AttributeFlags>();
  CLI::App* verb = app.add_subcommand(
      "attribute", "which inputs does a model use? Shapley values and permutation importance");
  verb->footer(
      "Example: torsio attribute joint.safetensors validation.csv\n"
      "Cost: windows x background x (2^inputs - 2) x window length steps of the model for the "
      "exact\n"
      "Shapley values (three inputs, no memory: 60 000 steps; a memory of 200 samples: 12 "
      "million),\n"
      "and inputs x repeats passes over the recordings for the shuffling. At most 12 inputs. "
      "Ctrl-C\n"
      "stops it.");
  verb->add_option("MODEL", flags->model, "model file written by torsio fit")->required();
  flags->data.add_recordings(*verb, "recordings on which the model is evaluated, or a manifest");
  flags->data.add_model_mapping(*verb);
  verb->add_option("--windows", flags->options.windows, "samples (or windows) that are explained")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  verb->add_option("--background", flags->options.background,
                   "samples (or windows) from which the values of absent inputs are taken")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  verb->add_option("--window", flags->window, "length of a window: 0.2s; auto: the model's memory")
      ->capture_default_str();
  verb->add_option("--repeats", flags->options.repeats, "shuffles of each input")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  add_seed(*verb, flags->options.seed, "seed of the random number generators");
  flags->json.add(*verb, "the results");
  flags->report.add(*verb);
  verb->callback([flags] { run(*flags); });
}

#include <algorithm>
#include <map>
#include <string>
#include <utility>

#include "common/data_flags.hpp"
#include "common/model_doubts.hpp"
#include "common/output.hpp"
#include "common/progress_bar.hpp"
#include "common/report_output.hpp"
#include "common/report_text.hpp"
#include "core/quantity.hpp"
#include "report/cross_validation.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/units.hpp"
#include "torsio/evaluate/comparison.hpp"
#include "torsio/fit/common/inputs.hpp"
#include "torsio/fit/families.hpp"
#include "torsio/report/html/verb_reports.hpp"
#include "verbs.hpp"

namespace {

struct CrossValidateFlags {
  DataFlags data;
  std::string models = "all";
  std::vector<std::string> settings;
  std::size_t folds = torsio::FoldScheme{}.folds;
  std::string by;
  std::string embargo = "1s";
  std::uint64_t seed = kDefaultSeed;
  bool allow_leak = false;
  JsonOutput json;
  ReportOutput report;
};

std::vector<torsio::ModelChoice> choices_of(const CrossValidateFlags& flags,
                                            const std::map<std::string, std::string>& settings,
                                            const torsio::Dataset& dataset) {
  auto choices = torsio::model_choices(dataset, flags.models, flags.data.wanted_inputs());
  if (settings.empty()) return choices;
  if (has_all(flags.models))
    throw torsio::UsageError({.place = "--set",
                              .expected = "models that have the setting, named with --models",
                              .found = "--models " + flags.models});
  for (torsio::ModelChoice& choice : choices) {
    for (const auto& [option, value] : settings) choice.options[option] = value;
    // Refuses unknown options before any work is done.
    (void)torsio::Options(torsio::find_family(choice.family).options, choice.options);
  }
  return choices;
}

/// Compares the motion of what each fold holds out with that of the rest.
void warn_of_other_motions_in_folds(torsio::Dataset dataset, const torsio::FeatureSpec& features,
                                    const torsio::FoldScheme& scheme, std::uint64_t seed) {
  torsio::FoldPlan plan = torsio::plan_folds(dataset, scheme, seed);
  for (torsio::Fold& fold : plan.folds) {
    for (std::size_t i = 0; i < dataset.records.size(); ++i)
      dataset.records[i].segments = std::move(fold.segments[i]);
    warn_of_other_motions(dataset, features, fold.name + ": ");
  }
}

void run(CrossValidateFlags& flags) {
  const auto settings = parse_settings(flags.settings);  // before a stray value is read as a file
  flags.data.check_outputs({flags.json.destination, flags.report.destination, flags.report.plot});
  const torsio::FoldScheme scheme{
      .folds = flags.folds,
      .embargo_s = torsio::signed_quantity_with_unit(flags.embargo, "s", "--embargo"),
      .by = flags.by};
  ProgressBar progress;
  torsio::Dataset dataset = flags.data.load({}, {}, progress.listener());
  const auto choices = choices_of(flags, settings, dataset);
  const torsio::FeatureSpec features = torsio::resolve_inputs(dataset, flags.data.wanted_inputs());
  flags.data.compute_target(dataset, features);
  warn_of_failed_checks(dataset, features);
  warn_of_other_motions_in_folds(dataset, features, scheme, flags.seed);
  const torsio::CrossValidation validation = torsio::cross_validate(
      dataset, choices, scheme, flags.seed, flags.allow_leak, progress.listener());
  flags.json.write(torsio::cross_validation_json(validation));
  if (flags.json.wants_tables()) print(cross_validation_text(validation));
  if (flags.report.is_wanted())
    flags.report.write(torsio::cross_validation_report(validation, dataset));
  if (std::ranges::none_of(validation.ranking,
                           [](const torsio::FoldSummary& summary) { return summary.folds > 0; }) ||
      !validation.ranked().is_possible())
    throw torsio::Error({.problem = first_failure(validation.results)});
}

}  // namespace

void add_crossvalidate(CLI::App& app) {
  auto flags = std::make_shared<CrossValidateFlags>();
  CLI::App* verb = app.add_subcommand(
      "crossvalidate", "rank models by training them several times, each time holding out a part");
  verb->footer(
      "Example: torsio crossvalidate sweep*.csv --folds 5 --models linear,dgmm\n"
      "         torsio crossvalidate bench.yaml --by support_m --models dgmm --set components=100\n"
      "Whole recordings are assigned to the folds; if there are fewer recordings than folds, each\n"
      "recording is cut into contiguous blocks. Of a manifest only recordings with the role train "
      "are\n"
      "used. Cost: one compare per fold.");
  flags->data.add_recordings(*verb, "recordings, or a manifest with roles");
  flags->data.add_mapping(*verb);
  flags->data.add_initialise(*verb);
  flags->data.add_target_and_inputs(*verb);
  flags->data.add_load(*verb,
                       "load file: the target is the torque of this known load "
                       "(docs/use/known_load.md)");
  add_models(*verb, flags->models, ", which are added by name: all,lstm");
  verb->add_option("--set", flags->settings, "set an option of every model, option=value")
      ->allow_extra_args(false);
  CLI::Option* folds =
      verb->add_option("--folds", flags->folds, "number of folds")->capture_default_str();
  verb->add_option("--by", flags->by,
                   "record: hold out one recording at a time; a condition (support_m): all "
                   "recordings of one value at a time")
      ->excludes(folds);
  verb->add_option("--embargo", flags->embargo,
                   "time between a held-out block and the training samples; whole recordings need "
                   "none")
      ->capture_default_str();
  add_seed(*verb, flags->seed, "seed of the random number generators");
  verb->add_flag("--allow-leak", flags->allow_leak,
                 "accept an input that the target was computed from; the results are marked");
  flags->json.add(*verb, "the results");
  flags->report.add(*verb);
  verb->callback([flags] { run(*flags); });
}

#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <optional>
#include <string>
#include <vector>

#include "common/data_flags.hpp"
#include "common/model_doubts.hpp"
#include "common/output.hpp"
#include "common/progress_bar.hpp"
#include "common/report_output.hpp"
#include "common/report_text.hpp"
#include "report/cross_validation.hpp"
#include "torsio/core/error.hpp"
#include "torsio/evaluate/comparison.hpp"
#include "torsio/fit/common/inputs.hpp"
#include "torsio/report/html/verb_reports.hpp"
#include "torsio/report/results.hpp"
#include "torsio/search/structure_study.hpp"
#include "verbs.hpp"

namespace {

struct CompareFlags {
  DataFlags data;
  std::vector<std::string> validation;
  std::vector<std::string> test;
  std::string models = "all";
  std::string output;
  std::uint64_t seed = kDefaultSeed;
  bool allow_leak = false;
  JsonOutput json;
  ReportOutput report;
};

void run(CompareFlags& flags) {
  flags.data.check_outputs(
      {flags.output, flags.report.destination, flags.report.plot, flags.json.destination},
      flags.test);
  require_model_file(flags.output);
  ProgressBar progress;
  torsio::Dataset dataset = flags.data.load(flags.validation, flags.test, progress.listener());
  const torsio::FeatureSpec features = torsio::resolve_inputs(dataset, flags.data.wanted_inputs());
  flags.data.compute_target(dataset, features);
  warn_of_failed_checks(dataset, features);
  const std::vector<std::string> other_motions = other_motion_warnings(dataset, features);
  for (const std::string& warning : other_motions) remark("warning: " + warning);
  std::optional<torsio::StructureSearch> search;
  if (flags.models == torsio::kSearch) {
    torsio::require_test_recordings(dataset);  // before the search, which may take hours
    const auto candidates = torsio::search_candidates(dataset, flags.data.wanted_inputs());
    remark(fmt::format(
        "search: {} structures on {} folds, then the best of each family: minutes to hours, and "
        "nothing is kept after Ctrl-C. torsio search --study NAME keeps it; --models with fewer "
        "families is quicker.",
        candidates.size(), torsio::kSearchFolds));
    search = torsio::search_structures(dataset, candidates,
                                       {.seed = flags.seed, .allow_leak = flags.allow_leak},
                                       progress.listener());
    if (search->winners.empty())
      throw torsio::Error({.problem = first_failure(search->scores.results)});
    if (flags.json.wants_tables()) print(cross_validation_text(search->scores) + "\n");
  }
  const auto choices =
      search ? search->winners
             : torsio::model_choices(dataset, flags.models, flags.data.wanted_inputs());
  auto comparison =
      torsio::compare(dataset, choices, flags.seed, flags.allow_leak, progress.listener());
  flags.json.write(search ? torsio::search_json(comparison.results, search->scores)
                          : torsio::results_json(comparison.results));
  if (flags.json.wants_tables()) print(comparison_text(comparison.results));
  for (const torsio::Ranking& ranking : comparison.results.rankings)
    if (const std::string note = torsio::ranking_note(ranking);
        !flags.json.wants_tables() && !note.empty())
      remark(std::string(torsio::name(ranking.split)) + ": " + note);
  for (const std::string& warning : comparison.results.warnings) remark("warning: " + warning);
  std::ranges::copy(other_motions, std::back_inserter(comparison.results.warnings));
  if (has_all(flags.models))
    remark(
        fmt::format("note: all leaves out {} families, which --help lists: add them by name, as in "
                    "all,lstm",
                    families_beyond_all().size()));
  if (flags.report.is_wanted())
    flags.report.write(torsio::comparison_report(comparison, dataset, progress.listener()));
  if (!comparison.best) throw torsio::Error({.problem = first_failure(comparison.results)});
  if (flags.output.empty()) return;
  torsio::save_model(flags.output, comparison.best->file);
  remark("best model (" + comparison.best->file.card.fitted_as + ") written to " + flags.output);
}

}  // namespace

void add_compare(CLI::App& app) {
  auto flags = std::make_shared<CompareFlags>();
  CLI::App* verb =
      app.add_subcommand("compare", "fit many models and rank them on held-out recordings");
  verb->footer(
      "Example: torsio compare sweep1.csv sweep2.csv --test other_lever.csv --models all --json -");
  flags->data.add_recordings(*verb, "recordings to train on, or a manifest with roles");
  flags->data.add_mapping(*verb);
  flags->data.add_initialise(*verb);
  flags->data.add_target_and_inputs(*verb);
  flags->data.add_load(*verb,
                       "load file: the target is the torque of this known load "
                       "(docs/use/known_load.md)");
  verb->add_option("--test", flags->test, "held-out recordings, on which the models are ranked");
  verb->add_option("--validation", flags->validation, "recordings that error bars are taken from");
  add_models(*verb, flags->models,
             ", which take longer or are for other data and are added by name: all,viscoelastic; "
             "search: orders and structures of each family by cross-validation within the training "
             "records, the best then compared: minutes to hours");
  verb->add_option("-o,--output", flags->output, "write the best model to this file");
  flags->report.add(*verb);
  add_seed(*verb, flags->seed, "seed of the random number generators");
  verb->add_flag("--allow-leak", flags->allow_leak,
                 "accept an input that the target was computed from; the results are marked");
  flags->json.add(*verb, "the results");
  verb->callback([flags] { run(*flags); });
}

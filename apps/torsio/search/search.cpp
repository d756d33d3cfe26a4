#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <utility>

#include "common/data_flags.hpp"
#include "common/model_doubts.hpp"
#include "common/output.hpp"
#include "common/progress_bar.hpp"
#include "common/report_text.hpp"
#include "core/quantity.hpp"
#include "report/cross_validation.hpp"
#include "search/slurm.hpp"
#include "search/specimen_study.hpp"
#include "search/study_flags.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/version.hpp"
#include "torsio/evaluate/comparison.hpp"
#include "torsio/fit/common/inputs.hpp"
#include "torsio/report/results.hpp"
#include "torsio/search/structure_study.hpp"
#include "verbs.hpp"

namespace {

struct SearchFlags {
  DataFlags data;
  std::string specimens;
  std::string duration = "10s";
  std::vector<std::string> validation;
  std::vector<std::string> inputs;
  std::string models{torsio::kSearch};
  std::string halving = "family";
  std::size_t folds = torsio::kSearchFolds;
  std::uint64_t seed = kDefaultSeed;
  bool allow_leak = false;
  std::string output;
  JsonOutput json;
  WorkerFlags worker;
  std::string engine = "local";
  SlurmFlags slurm;
};

torsio::SearchRequest request_of(const SearchFlags& flags) {
  torsio::SearchRequest request{.recordings = flags.data.recordings,
                                .validation = flags.validation,
                                .mapping = flags.data.mapping,
                                .joint = flags.data.joint,
                                .target = flags.data.target,
                                .load_file = flags.data.load_file,
                                .initialise = flags.data.initialise,
                                .models = flags.models};
  if (!flags.data.rate.empty())
    request.rate_Hz = torsio::signed_quantity_with_unit(flags.data.rate, "Hz", "--rate");
  for (const std::string& set : flags.inputs) request.inputs.push_back(torsio::split_inputs(set));
  request.settings = {.folds = flags.folds,
                      .seed = flags.seed,
                      .allow_leak = flags.allow_leak,
                      .halving = flags.halving == "off"      ? torsio::Halving::off
                                 : flags.halving == "family" ? torsio::Halving::by_family
                                                             : torsio::Halving::by_all};
  return request;
}

torsio::StoreAddress address_of(const SearchFlags& flags) {
  if (!flags.worker.store.empty()) return torsio::store_address(flags.worker.store);
  if (flags.worker.study.empty()) return {};
  const auto folder = flags.data.recordings.empty()
                          ? std::filesystem::path()
                          : std::filesystem::path(flags.data.recordings.front()).parent_path();
  return torsio::store_address((folder / "torsio-studies.sqlite").string());
}

void check_call(const SearchFlags& flags) {
  if (flags.worker.study.empty() && !flags.worker.store.empty())
    throw torsio::UsageError({.place = "--store",
                              .problem = "a study that is kept needs a name",
                              .advice = "Give it with --study NAME."});
  if (flags.engine != "slurm") {
    if (flags.slurm.only_submits)
      throw torsio::UsageError({.place = "--submit-only",
                                .problem = "only a job of Slurm is submitted",
                                .advice = "Add --engine slurm."});
    return;
  }
  if (flags.worker.study.empty() || flags.worker.store.empty())
    throw torsio::UsageError(
        {.place = "--engine slurm",
         .problem = "workers on other machines need a store that they share",
         .advice = "Give --study NAME and --store postgresql://user@host/name."});
}

/// Runs the study here, or waits for the workers that run it.
/// @returns false if they are not waited for.
bool complete(const SearchFlags& flags, torsio::StudyStore& store, const torsio::StoredStudy& study,
              torsio::StudyKind& kind, const torsio::Progress& progress) {
  try {
    if (flags.engine == "slurm") {
      return run_on_slurm(flags.slurm, flags.worker, store, study, kind, progress);
    }
    torsio::run_workers(store, study, kind, flags.worker.options(), progress);
    return true;
  } catch (const torsio::Cancelled&) {
    if (!flags.worker.study.empty())
      remark(fmt::format("study '{}' is kept in {}: the same command continues", study.name,
                         store.address().name()));
    throw;
  }
}

void write_best(const SearchFlags& flags, const torsio::Dataset& dataset,
                const torsio::StructureSearch& search, const torsio::Progress& progress) {
  const torsio::ModelChoice& best = search.winners.front();
  torsio::TrainedModel model = torsio::train_model(dataset, best, flags.seed, progress);
  const torsio::FoldSummary& summary = search.scores.ranking.front();
  model.file.card.held_out = fmt::format("{}; this score selected the structure among {}",
                                         search.scores.plan.label, search.scores.ranking.size());
  model.file.card.metrics = {{"rmse", summary.common_rmse.mean}};
  torsio::save_model(flags.output, model.file);
  remark(fmt::format("{} fitted on all recordings, written to {}", summary.family, flags.output));
}

/// The spread of the errors, and the specimens at both ends.
std::string specimen_table(torsio::StudyStore& store, std::int64_t study) {
  std::vector<torsio::TrialRecord> records = store.trials(study);
  std::string failed;
  for (const torsio::TrialRecord& record : records)
    if (record.state == torsio::TrialState::failed)
      failed += fmt::format("  {}: {}\n", record.trial.device, record.result.reason);
  std::erase_if(records, [](const torsio::TrialRecord& record) {
    return !std::isfinite(record.result.value);
  });
  std::ranges::stable_sort(records, {},
                           [](const torsio::TrialRecord& record) { return record.result.value; });
  std::string text = counted(records.size(), "specimen") + "\n";
  if (!records.empty()) {
    const auto line = [&](const char* what, std::size_t index) {
      text += fmt::format("  {:7}  {:<16}  RMSE {:.4g}\n", what, records[index].trial.device,
                          records[index].result.value);
    };
    line("lowest", 0);
    line("median", records.size() / 2);
    line("highest", records.size() - 1);
  }
  return failed.empty() ? text : text + "failed:\n" + failed;
}

std::string specimen_json(torsio::StudyStore& store, std::int64_t study) {
  nlohmann::ordered_json document{{"specimens", nlohmann::ordered_json::array()}};
  for (const torsio::TrialRecord& record : store.trials(study)) {
    nlohmann::ordered_json json{{"device", record.trial.device},
                                {"state", torsio::name(record.state)},
                                {"attempts", record.attempt},
                                {"rmse", nullptr},
                                {"reason", nullptr}};
    if (std::isfinite(record.result.value)) json["rmse"] = record.result.value;
    if (!record.result.reason.empty()) json["reason"] = record.result.reason;
    document["specimens"].push_back(std::move(json));
  }
  return document.dump(2) + "\n";
}

/// Refuses what a search over recordings has and simulated specimens do not use.
void refuse_unused(const CLI::App& verb) {
  constexpr auto kOfRecordings = std::to_array<const char*>(
      {"--mapping", "--joint", "--rate", "--initialise", "--target", "--inputs", "--load",
       "--validation", "--halving", "--folds", "--output", "--allow-leak"});
  for (const char* option : kOfRecordings)
    if (verb.count(option) > 0)
      throw torsio::UsageError({.place = option,
                                .problem = "--specimens does not use this option",
                                .advice = "Leave it out: one model is fitted on a simulated "
                                          "recording of each specimen, and none is written."});
}

void run_specimens(const CLI::App& verb, SearchFlags& flags) {
  refuse_unused(verb);
  if (!flags.data.recordings.empty())
    throw torsio::UsageError({.place = "--specimens",
                              .expected = "no recordings: they are simulated",
                              .found = flags.data.recordings.front()});
  torsio::SpecimenRequest request = torsio::specimen_range(flags.specimens);
  request.duration_s = torsio::signed_quantity_with_unit(flags.duration, "s", "--duration");
  request.seed = flags.seed;
  if (verb.count("--models") > 0) request.model = flags.models;
  torsio::SpecimenStudy kind(request);
  torsio::StudyStore store(address_of(flags), wait_for_server);
  const torsio::StoredStudy study =
      store.create_or_resume({.name = flags.worker.study.empty() ? "search" : flags.worker.study,
                              .kind = std::string(torsio::kSpecimenStudy),
                              .spec = torsio::request_text(request),
                              .torsio_version = torsio::kVersion},
                             kind.first_trials());
  take_back_of_dead(store, study);
  ProgressBar progress;
  if (!complete(flags, store, study, kind, progress.listener())) return;
  flags.json.write(specimen_json(store, study.id));
  if (flags.json.wants_tables()) print(specimen_table(store, study.id));
}

void run(const CLI::App& verb, SearchFlags& flags) {
  check_call(flags);
  if (!flags.specimens.empty()) return run_specimens(verb, flags);
  flags.data.check_outputs({flags.output, flags.json.destination}, flags.validation);
  require_model_file(flags.output);
  const torsio::SearchRequest request = request_of(flags);
  ProgressBar progress;
  torsio::Dataset dataset = flags.data.load(flags.validation, {}, progress.listener());
  const torsio::FeatureSpec features = torsio::resolve_inputs(
      dataset, request.inputs.empty() ? std::vector<std::string>{} : request.inputs.front());
  flags.data.compute_target(dataset, features);
  warn_of_failed_checks(dataset, features);
  const std::vector<torsio::ModelChoice> choices = torsio::search_choices(dataset, request);
  torsio::StructureStudy kind(dataset, choices, request.settings);
  torsio::StudyStore store(address_of(flags), wait_for_server);
  const std::string name = flags.worker.study.empty() ? "search" : flags.worker.study;
  if (const auto known = store.find_study(name); known && known->kind == torsio::kStructureStudy)
    torsio::refuse_changed_data(*known, dataset);
  const torsio::StoredStudy study =
      store.create_or_resume({.name = name,
                              .kind = std::string(torsio::kStructureStudy),
                              .spec = torsio::request_text(request, dataset),
                              .torsio_version = torsio::kVersion},
                             kind.first_trials());
  take_back_of_dead(store, study);
  const torsio::StudyCounts counts = store.counts(study.id);
  remark(fmt::format(
      "search: {}, {}, {} to run{}{}", counted(choices.size(), "structure"),
      counted(flags.folds, "fold"), counted(counts.waiting + counts.running, "trial"),
      counts.finished > 0 ? fmt::format(", {} done before", counts.finished) : "",
      flags.worker.study.empty() ? ". Nothing is kept if it is stopped; --study NAME keeps it"
                                 : fmt::format(", kept in {}", store.address().name())));
  if (!complete(flags, store, study, kind, progress.listener())) return;
  const torsio::StructureSearch search = kind.result(store, study.id);
  flags.json.write(torsio::cross_validation_json(search.scores));
  if (flags.json.wants_tables()) print(cross_validation_text(search.scores));
  if (search.winners.empty())
    throw torsio::Error({.problem = first_failure(search.scores.results)});
  if (!flags.output.empty()) write_best(flags, dataset, search, progress.listener());
}

}  // namespace

void add_search(CLI::App& app) {
  auto flags = std::make_shared<SearchFlags>();
  CLI::App* verb = app.add_subcommand(
      "search", "try families, orders and inputs by cross-validation, on one machine or many");
  verb->footer(
      "Example: torsio search sweep1.csv sweep2.csv sweep3.csv --study elbow -o elbow.safetensors\n"
      "The same command after a stop continues. docs/search.md: on several machines and on Slurm.");
  flags->data.add_recordings(*verb, "recordings to train on, or a manifest");
  flags->data.add_mapping(*verb);
  flags->data.add_initialise(*verb);
  verb->add_option("--target", flags->data.target, "target channel (default torque_Nm)");
  verb->add_option("--inputs", flags->inputs,
                   "the model's inputs, separated by commas; given several times, each is a set "
                   "that is tried");
  flags->data.add_load(*verb,
                       "load file: the target is the torque of this known load "
                       "(docs/use/known_load.md)");
  verb->add_option("--validation", flags->validation, "recordings that error bars are taken from");
  CLI::Option* specimens = verb->add_option(
      "--specimens", flags->specimens,
      "in place of recordings: simulated specimens with their tolerances, the one model of "
      "--models (default grey_box) fitted on each: dfki-50#0001..#1000");
  verb->add_option("--duration", flags->duration, "length of a recording of --specimens")
      ->capture_default_str()
      ->needs(specimens);
  verb->add_option("--models", flags->models,
                   "search: families with the orders, sizes and structures that people vary first; "
                   "or families with settings: linear,mlp:layers=8,mlp:layers=16-16")
      ->capture_default_str();
  verb->add_option("--halving", flags->halving,
                   "family: structures of families that are slow to fit are fitted in part first, "
                   "and the better "
                   "half of each family continues; all: of all families together; off: each is "
                   "fitted on every fold")
      ->check(CLI::IsMember({"family", "all", "off"}))
      ->capture_default_str();
  verb->add_option("--folds", flags->folds, "folds of the cross-validation")->capture_default_str();
  flags->worker.add(*verb,
                    "SQLite file or postgresql:// URL that keeps the study (default: "
                    "torsio-studies.sqlite beside the first recording)",
                    "keep the study under this name; without it, it is kept in memory only");
  verb->add_option("--engine", flags->engine,
                   "local: this process runs the trials, together with all `torsio work` on the "
                   "same store; slurm: a job array of workers does")
      ->check(CLI::IsMember({"local", "slurm"}))
      ->capture_default_str();
  flags->slurm.add(*verb);
  verb->add_option("-o,--output", flags->output,
                   "fit the best structure on all recordings and write the model to this file");
  add_seed(*verb, flags->seed, "seed of the random number generators");
  verb->add_flag("--allow-leak", flags->allow_leak,
                 "accept an input that the target was computed from; the results are marked");
  flags->json.add(*verb, "the results");
  verb->callback([flags, verb] { run(*verb, *flags); });
}

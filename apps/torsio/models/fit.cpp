#include <fmt/format.h>
#include <fmt/ranges.h>

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "common/data_flags.hpp"
#include "common/interrupt.hpp"
#include "common/model_doubts.hpp"
#include "common/output.hpp"
#include "common/progress_bar.hpp"
#include "common/report_output.hpp"
#include "common/report_text.hpp"
#include "evaluate/unused_inputs.hpp"
#include "files/training_checkpoint.hpp"
#include "report/fit_report.hpp"
#include "torsio/core/error.hpp"
#include "torsio/data/mapping.hpp"
#include "torsio/evaluate/comparison.hpp"
#include "torsio/evaluate/fit_report.hpp"
#include "torsio/files/model_file.hpp"
#include "torsio/fit/common/inputs.hpp"
#include "torsio/fit/families.hpp"
#include "torsio/report/html/verb_reports.hpp"
#include "torsio/signal/feature_pipeline.hpp"
#include "verbs.hpp"

namespace {

struct FitFlags {
  DataFlags data;
  std::vector<std::string> validation;
  std::vector<std::string> test;
  std::string family;
  std::vector<std::string> settings;
  std::string output;
  std::string device_serial;
  std::uint64_t seed = kDefaultSeed;
  bool allow_leak = false;
  bool list = false;
  bool resume = false;
  JsonOutput json;
  ReportOutput report;

  /// The checkpoint of a fit that was stopped.
  [[nodiscard]] std::string checkpoint() const { return output + ".checkpoint"; }
};

std::string family_list() {
  std::string text;
  for (const torsio::FamilyInfo& family : torsio::families()) {
    text += fmt::format("{}: {}\n", family.name, family.summary);
    for (const torsio::OptionInfo& option : family.options) {
      text += fmt::format("  --set {}={}  {}{}\n", option.name,
                          option.default_value.empty() ? "(none)" : option.default_value,
                          option.help, torsio::range_of(option));
    }
  }
  return text;
}

/// `fit_and_report` from the start or from the checkpoint; if it is stopped, it writes a checkpoint.
torsio::ReportedFit fitted(const FitFlags& flags, const torsio::Dataset& dataset,
                           const torsio::FitCheck& check, const torsio::ModelChoice& choice,
                           torsio::Progress progress) {
  torsio::TrainingCheckpoint start;
  torsio::FitContext context{.seed = flags.seed, .progress = std::move(progress)};
  if (flags.resume) {
    start = torsio::load_checkpoint(flags.checkpoint());
    context.resume = &start;
  }
  bool is_kept = false;
  context.keep = [&](const torsio::TrainingCheckpoint& reached) {
    lift_interrupt_deadline();  // a large network takes its time to be written
    torsio::save_checkpoint(flags.checkpoint(), reached);
    is_kept = true;
  };
  try {
    return torsio::fit_and_report(dataset, check, choice, context);
  } catch (const torsio::Cancelled&) {
    if (!is_kept) throw;
    throw torsio::Error({.problem = "stopped on request; the best parameters so far are saved in " +
                                    flags.checkpoint(),
                         .advice = "The same call with --resume continues from there."});
  }
}

/// @param on_training the model's scores on all of its training data.
void refuse_diverged(const torsio::ResultRow& on_training) {
  if (on_training.status != "diverged") return;
  throw torsio::Error({.place = on_training.family,
                       .problem = "diverged " + on_training.reason + "; no model was written",
                       .advice = "Run torsio check on the recordings, or choose other inputs, "
                                 "settings (--set) or another --model."});
}

constexpr std::string_view kJointPlace = "{joint}";

std::string with_joint(std::string path, const std::string& joint) {
  if (const std::size_t at = path.find(kJointPlace); at != std::string::npos)
    path.replace(at, kJointPlace.size(), joint);
  return path;
}

void run_one(FitFlags& flags);

/// One model for each joint of the mapping, or of those that `--joint` lists.
void run_each_joint(const FitFlags& flags) {
  const std::vector<std::string> joints = flags.data.joint.empty()
                                              ? torsio::joints_of_mapping(flags.data.mapping)
                                              : torsio::split_inputs(flags.data.joint);
  if (joints.empty())
    throw torsio::UsageError({.place = "--output " + flags.output,
                              .expected = "--joint NAME,NAME or a mapping that lists joints:",
                              .found = "no joints"});
  for (const std::string& joint : joints) {
    FitFlags one = flags;
    one.data.joint = joint;
    const auto place = [&](std::string& destination) {
      const std::string given = std::exchange(destination, with_joint(destination, joint));
      if (joints.size() > 1 && !given.empty() && given == destination)
        throw torsio::UsageError({.place = given,
                                  .problem = "the results of every joint would be written to it",
                                  .advice = "Put {joint} into its name."});
    };
    place(one.output);
    place(one.json.destination);
    place(one.report.destination);
    place(one.report.plot);
    remark(fmt::format("joint {}", joint));
    run_one(one);
  }
}

/// Its range would guard all the same.
void remark_inputs_without_effect(const torsio::ModelFile& file) {
  const torsio::AnyModel model(file.parameters);
  const std::vector<std::string>& inputs = file.settings.features.inputs;
  std::vector<std::string> without;
  std::string others;
  for (std::size_t i = 0; i < inputs.size(); ++i) {
    const std::string_view reason = torsio::reason_to_leave_out(file.settings, model, i);
    if (!reason.empty())
      without.push_back(fmt::format("{} {}", inputs[i], reason));
    else
      others += (others.empty() ? "" : ",") + inputs[i];
  }
  const bool are_many = without.size() > 1;
  if (!without.empty())
    remark(fmt::format(
        "{}, but a guard reports where {} range is left: leave {} out with  --inputs '{}'",
        fmt::join(without, " and "), are_many ? "their" : "its", are_many ? "them" : "it", others));
}

void run(FitFlags& flags) {
  if (flags.list) return print(family_list());
  if (flags.output.find(kJointPlace) != std::string::npos) return run_each_joint(flags);
  run_one(flags);
}

std::vector<std::string> further_recordings(const FitFlags& flags) {
  std::vector<std::string> all = flags.validation;
  all.insert(all.end(), flags.test.begin(), flags.test.end());
  return all;
}

void run_one(FitFlags& flags) {
  const auto settings = parse_settings(flags.settings);  // before a stray value is read as a file
  std::vector<std::string> missing;
  if (flags.data.recordings.empty()) missing.emplace_back("recordings");
  if (flags.family.empty()) missing.emplace_back("--model FAMILY (torsio fit --list)");
  if (flags.output.empty()) missing.emplace_back("-o FILE");
  if (!missing.empty())
    throw torsio::UsageError(
        {.place = "torsio fit",
         .problem = fmt::format("{} missing", fmt::join(missing, " and ")),
         .advice = "Example: torsio fit sweep.csv --model dgmm -o joint.safetensors"});
  flags.data.check_outputs(
      {flags.output, flags.json.destination, flags.report.destination, flags.report.plot},
      further_recordings(flags));
  require_model_file(flags.output);
  ProgressBar progress;
  torsio::Dataset dataset = flags.data.load(flags.validation, flags.test, progress.listener());
  const torsio::FeatureSpec features = torsio::resolve_inputs(dataset, flags.data.wanted_inputs());
  flags.data.add_target(dataset, features);
  const torsio::FitCheck check = torsio::check_for_fit(dataset, features, flags.allow_leak);
  warn_of_failed_checks(check);
  torsio::ReportedFit fit =
      fitted(flags, dataset, check, {flags.family, settings, "", features}, progress.listener());
  auto& [trained, runs, results, report] = fit;
  trained.file.card.device_serial = flags.device_serial;
  if (flags.json.wants_tables()) print(evaluation_text(results) + torsio::fit_report_text(report));
  flags.json.write(torsio::fit_json(results, report, trained.notes));
  if (flags.report.is_wanted())
    flags.report.write(torsio::fit_page(fit, flags.output, dataset, progress.listener()));
  refuse_diverged(results.rows.front());
  torsio::save_model(flags.output, trained.file);  // last: untouched unless all else succeeded
  if (flags.resume) std::filesystem::remove(flags.checkpoint());
  for (const std::string& note : trained.notes) remark_note(note);
  remark_inputs_without_effect(trained.file);
  for (const torsio::ResultRow& row : results.rows)
    if (row.status != "ok" && !row.recording)
      remark(fmt::format("warning: {} on {}: {}", row.status, torsio::name(row.split), row.reason));
  remark(fmt::format("{} written in {:.2f} s of fitting", flags.output, trained.fit_seconds));
}

}  // namespace

void add_fit(CLI::App& app) {
  auto flags = std::make_shared<FitFlags>();
  CLI::App* verb = app.add_subcommand("fit", "train one model and save it");
  verb->footer(
      "Example: torsio fit sweep.csv --model dgmm --set components=300 -o joint.safetensors");
  flags->data.add_recordings(*verb, "recordings to train on, or a manifest with roles");
  flags->data.add_mapping(*verb);
  flags->data.add_target_and_inputs(*verb);
  flags->data.add_load(
      *verb,
      "load file: the target is the torque of this known load instead of that of a "
      "sensor (docs/use/known_load.md)");
  verb->add_option("--model", flags->family, "family; --list shows them");
  verb->add_option("--set", flags->settings, "set an option of the family, option=value")
      ->allow_extra_args(false);
  verb->add_option("--validation", flags->validation, "recordings that error bars are taken from");
  verb->add_option("--test", flags->test, "recordings to score on, which the fit does not use");
  verb->add_option(
      "-o,--output", flags->output,
      "model file; untouched unless the fit succeeds; {joint} in its name: a model for each "
      "joint of the mapping");
  verb->add_option("--device-serial", flags->device_serial,
                   "serial number of the joint that the model belongs to");
  add_seed(*verb, flags->seed, "seed of the random number generators");
  verb->add_flag("--allow-leak", flags->allow_leak,
                 "accept an input that the target was computed from; the results are marked");
  verb->add_flag("--resume", flags->resume,
                 "continue from <output>.checkpoint, which a stopped fit of a network writes");
  verb->add_flag("--list", flags->list, "show the families and their settings");
  flags->json.add(*verb, "the scores");
  flags->report.add(*verb);
  verb->callback([flags] { run(*flags); });
}

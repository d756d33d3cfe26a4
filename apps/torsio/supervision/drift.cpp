#include "torsio/evaluate/drift.hpp"

#include <fmt/format.h>

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/data_flags.hpp"
#include "common/model_doubts.hpp"
#include "common/output.hpp"
#include "common/progress_bar.hpp"
#include "common/report_output.hpp"
#include "report/drift.hpp"
#include "sim/campaign/drift_campaign.hpp"
#include "torsio/core/error.hpp"
#include "torsio/files/model_file.hpp"
#include "torsio/report/html/verb_reports.hpp"
#include "verbs.hpp"

namespace {

struct DriftFlags {
  std::string model;
  DataFlags data;
  std::string serial;
  std::string reference;
  std::size_t campaign = 0;
  torsio::DriftCampaignSettings settings;
  JsonOutput json;
  ReportOutput report;
};

void run_campaign(DriftFlags& flags) {
  if (!flags.model.empty())
    throw torsio::UsageError({.place = "torsio drift --campaign",
                              .expected = "no model file: each simulated joint gets its own",
                              .found = flags.model});
  DataFlags().check_outputs(
      {flags.json.destination, flags.settings.resume, flags.report.destination, flags.report.plot});
  flags.settings.specimens = flags.campaign;
  ProgressBar progress;
  const torsio::DriftCampaignResult result =
      torsio::run_drift_campaign(flags.settings, progress.listener());
  if (flags.json.wants_tables()) print(torsio::drift_campaign_text(result));
  flags.json.write(torsio::drift_campaign_json(result));
  if (flags.report.is_wanted())
    flags.report.write(
        torsio::text_report("Campaign of changed joints", {}, torsio::drift_campaign_text(result)));
}

void run(DriftFlags& flags) {
  if (flags.campaign > 0) return run_campaign(flags);
  if (flags.model.empty())
    throw torsio::UsageError({.place = "torsio drift",
                              .expected = "MODEL REC..., or --campaign N",
                              .found = "no model file",
                              .advice = "torsio drift joint.safetensors today.csv"});
  std::vector<std::string> models{flags.model};
  if (!flags.reference.empty()) models.push_back(flags.reference);
  flags.data.check_outputs({flags.json.destination, flags.report.destination, flags.report.plot},
                           models);
  const torsio::ModelFile file = torsio::load_model(flags.model, flags.serial);
  flags.data.use_model(file, flags.model);
  ProgressBar progress;
  const torsio::Dataset dataset = flags.data.load_as_test(progress.listener());
  warn_of_seen_recordings(file, dataset);
  warn_of_missing_zeros(file, dataset);
  torsio::DriftOptions options;
  std::optional<torsio::ModelFile> reference;
  if (!flags.reference.empty()) {
    reference = torsio::load_model(flags.reference, flags.serial);
    if (reference->card.mapping != file.card.mapping)
      throw torsio::UsageError({.place = flags.reference,
                                .expected = "the mapping of " + flags.model,
                                .found = "another one",
                                .advice = "Train both models from the same recordings."});
    options.reference = &*reference;
  }
  const torsio::Drift drift = torsio::detect_drift(file, dataset, options, progress.listener());
  if (flags.json.wants_tables()) print(torsio::drift_text(drift, file.settings.target));
  flags.json.write(torsio::drift_json(drift, file.settings.target));
  if (flags.report.is_wanted())
    flags.report.write(torsio::drift_report(drift, file, dataset, progress.listener()));
}

}  // namespace

void add_drift(CLI::App& app) {
  auto flags = std::make_shared<DriftFlags>();
  CLI::App* verb = app.add_subcommand("drift",
                                      "compare new recordings with a model: what has changed in "
                                      "the joint since its calibration, and "
                                      "is a new one worth it");
  verb->footer(
      "Example: torsio drift joint.safetensors today.csv\n"
      "docs/robot/drift.md has the method, its limits and what it cannot decide.");
  verb->add_option("MODEL", flags->model, "model file written by torsio fit");
  flags->data.add_recordings(*verb,
                             "recordings of today with the inputs and the torque, or a manifest");
  flags->data.add_model_mapping(*verb);
  flags->data.add_initialise(*verb);
  verb->add_option(
      "--reference", flags->reference,
      "model of the same torque from the motor current or the twist of the gear: it "
      "separates the gain of the torque sensor from the stiffness, and the current shows the "
      "friction of the drive");
  verb->add_option("--device-serial", flags->serial,
                   "serial number of the joint; a model of another one is refused");
  verb->add_option("--campaign", flags->campaign,
                   "instead of recordings: so many simulated joints that have changed, and as many "
                   "that have not");
  verb->add_option("--actuators", flags->settings.actuators,
                   "of the campaign, separated by commas (default: the series-elastic ones)")
      ->delimiter(',');
  verb->add_option("--model", flags->settings.family, "family of the models of the campaign")
      ->capture_default_str();
  verb->add_option(
      "--resume", flags->settings.resume,
      "file that keeps the results of the campaign, so that an interrupted one continues");
  add_seed(*verb, flags->settings.seed, "seed of the campaign");
  flags->json.add(*verb, "the result");
  flags->report.add(*verb);
  verb->callback([flags] { run(*flags); });
}

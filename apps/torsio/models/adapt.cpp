#include <fmt/format.h>

#include "common/data_flags.hpp"
#include "common/model_doubts.hpp"
#include "common/output.hpp"
#include "common/progress_bar.hpp"
#include "common/report_output.hpp"
#include "core/quantity.hpp"
#include "report/adaptation.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/units.hpp"
#include "torsio/evaluate/adaptation.hpp"
#include "torsio/files/model_file.hpp"
#include "torsio/model/adaptive_model.hpp"
#include "torsio/report/html/verb_reports.hpp"
#include "verbs.hpp"

namespace {

struct AdaptFlags {
  std::string model;
  DataFlags data;
  std::vector<std::string> test;
  double held_out = 0.3;
  std::string embargo = "1s";
  std::string method = "auto";
  std::vector<std::string> settings;
  std::string output;
  std::string device_serial;
  JsonOutput json;
  ReportOutput report;
};

std::string settings_list() {
  std::string text = "Settings, --set option=value:\n";
  for (const torsio::OptionInfo& option : torsio::adaptation_options())
    text += fmt::format("  {}={}  {} ({:g} to {:g})\n", option.name, option.default_value,
                        option.help, option.minimum, option.maximum);
  return text;
}

torsio::Dataset load(const AdaptFlags& flags, const torsio::ModelFile& file,
                     const torsio::Progress& progress) {
  DataFlags data = flags.data;
  data.use_model(file, flags.model);
  torsio::Dataset dataset = data.load({}, flags.test, progress);
  if (!dataset.has_role(torsio::Role::test))
    torsio::hold_out_ends(dataset, flags.held_out,
                          torsio::signed_quantity_with_unit(flags.embargo, "s", "--embargo"));
  return dataset;
}

void run(AdaptFlags& flags) {
  std::vector<std::string> read = flags.test;
  read.push_back(flags.model);
  flags.data.check_outputs(
      {flags.output, flags.json.destination, flags.report.destination, flags.report.plot}, read);
  require_model_file(flags.output);
  const auto settings = torsio::adaptation_settings(flags.method, parse_settings(flags.settings));
  const torsio::ModelFile file = torsio::load_model(flags.model);
  torsio::require_adaptable(file.parameters);  // before recordings are read
  ProgressBar progress;
  const torsio::Dataset dataset = load(flags, file, progress.listener());
  warn_of_seen_recordings(file, dataset);
  warn_of_missing_zeros(file, dataset);
  torsio::AdaptedModel adapted = torsio::adapt_model(file, dataset, settings, progress.listener());
  if (!flags.device_serial.empty()) adapted.file.card.device_serial = flags.device_serial;
  if (flags.json.wants_tables()) print(torsio::adaptation_text(adapted, flags.model));
  flags.json.write(torsio::adaptation_json(adapted, flags.model));
  if (flags.report.is_wanted())
    flags.report.write(
        torsio::adaptation_report(adapted, file, flags.model, dataset, progress.listener()));
  const torsio::AdaptationScore& held_out = adapted.held_out.back();
  if (held_out.adapted.rmse > held_out.frozen.rmse)
    remark(
        "warning: on the held-out samples the adapted model is worse than the frozen one; try a "
        "smaller step_size (rls: initial_covariance, em: more component_samples), or comparison_s "
        "as long as a cycle");
  if (flags.output.empty()) return;
  torsio::save_model(flags.output, adapted.file);  // last: untouched unless all else succeeded
  remark(flags.output + " written");
}

}  // namespace

void add_adapt(CLI::App& app) {
  auto flags = std::make_shared<AdaptFlags>();
  CLI::App* verb = app.add_subcommand(
      "adapt",
      "replay recordings through a model and adapt it to them: the last layer of a network, a "
      "mixture, or the coefficients of a grey box");
  verb->footer(
      "Example: torsio adapt joint.safetensors other_specimen.csv -o other_joint.safetensors\n"
      "         torsio adapt joint.safetensors warm.csv --test warm2.csv --method rls\n"
      "Without --test, the last 30 % of each recording are used for the scores only. In a "
      "manifest,\n"
      "recordings with the role train are used for the adaptation and those with the role test "
      "for\n"
      "the scores.\n" +
      settings_list());
  verb->add_option("MODEL", flags->model, "model file of an mlp, lstm, gru, dgmm or grey_box")
      ->required();
  flags->data.add_recordings(*verb, "recordings to adapt to, in this order, or a manifest");
  flags->data.add_model_mapping(*verb);
  CLI::Option* test =
      verb->add_option("--test", flags->test, "recordings that are used for the scores only");
  verb->add_option("--held-out", flags->held_out,
                   "share of each recording, at its end, that is used for the scores only")
      ->capture_default_str()
      ->excludes(test);
  verb->add_option("--embargo", flags->embargo, "time before that part that is used in neither")
      ->capture_default_str();
  verb->add_option(
          "--method", flags->method,
          "nlms: cheap and robust; rls: converges in fewer samples, its cost is quadratic in the "
          "number of weights; em: of a dgmm; auto: nlms for a network, rls for a grey_box, em for "
          "a "
          "dgmm")
      ->capture_default_str();
  verb->add_option("--set", flags->settings, "set an option, option=value; listed below")
      ->allow_extra_args(false);
  verb->add_option("-o,--output", flags->output,
                   "adapted model file; untouched unless all else succeeds");
  verb->add_option("--device-serial", flags->device_serial,
                   "serial number of the joint that the adapted model belongs to");
  flags->json.add(*verb, "the results");
  flags->report.add(*verb);
  verb->callback([flags] { run(*flags); });
}

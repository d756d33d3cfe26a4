#include "report/transfer.hpp"

#include <fmt/format.h>

#include "common/data_flags.hpp"
#include "common/model_doubts.hpp"
#include "common/output.hpp"
#include "common/progress_bar.hpp"
#include "common/report_output.hpp"
#include "core/quantity.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/units.hpp"
#include "torsio/evaluate/transfer_curve.hpp"
#include "torsio/files/model_file.hpp"
#include "torsio/report/html/verb_reports.hpp"
#include "torsio/sim/bench/sheet_file.hpp"
#include "verbs.hpp"

namespace {

struct TransferFlags {
  std::string model;
  DataFlags data;
  std::vector<std::string> test;
  std::string use = "10s";
  std::string method = "auto";
  std::string base_actuator;
  std::string actuator;
  double stiffness_ratio = 0.0;
  double torque_ratio = 0.0;
  std::vector<std::string> curve;
  std::string output;
  std::string device_serial;
  std::uint64_t seed = kDefaultSeed;
  JsonOutput json;
  ReportOutput report;
};

std::optional<torsio::TransferMethod> method_of(const std::string& text) {
  if (text == "auto") return {};
  std::string known = "auto";
  for (int i = 0; i <= static_cast<int>(torsio::TransferMethod::refit); ++i) {
    const auto method = static_cast<torsio::TransferMethod>(i);
    if (torsio::name(method) == text) return method;
    known += fmt::format(", {}", torsio::name(method));
  }
  throw torsio::UsageError({.place = "--method", .expected = "one of " + known, .found = text});
}

std::optional<torsio::TransferRatios> ratios_of(const TransferFlags& flags) {
  const bool has_sheets = !flags.base_actuator.empty() || !flags.actuator.empty();
  const bool has_ratios = flags.stiffness_ratio != 0.0 || flags.torque_ratio != 0.0;
  if (has_sheets && (flags.base_actuator.empty() || flags.actuator.empty()))
    throw torsio::UsageError({.place = "--base-actuator and --actuator",
                              .expected = "both or none",
                              .found = "one of them"});
  if (has_sheets)
    return torsio::transfer_ratios(torsio::find_data_sheet(flags.base_actuator),
                                   torsio::find_data_sheet(flags.actuator));
  if (!has_ratios) return {};
  const auto or_one = [](double ratio) { return ratio == 0.0 ? 1.0 : ratio; };
  return torsio::TransferRatios{.stiffness = or_one(flags.stiffness_ratio),
                                .torque = or_one(flags.torque_ratio)};
}

std::vector<double> curve_times(const TransferFlags& flags) {
  std::vector<double> seconds;
  for (const std::string& time : flags.curve)
    seconds.push_back(torsio::signed_quantity_with_unit(time, "s", "--curve"));
  return seconds;
}

torsio::Dataset load(const TransferFlags& flags, const torsio::ModelFile& base,
                     const torsio::Progress& progress) {
  DataFlags data = flags.data;
  data.use_model(base, flags.model);
  torsio::Dataset dataset = data.load({}, flags.test, progress);
  const double use_s = torsio::signed_quantity_with_unit(flags.use, "s", "--use");
  if (!dataset.has_role(torsio::Role::test))
    torsio::hold_out_after(dataset, use_s);
  else
    dataset = torsio::with_training_time(std::move(dataset), use_s);
  return dataset;
}

void run(TransferFlags& flags) {
  std::vector<std::string> read = flags.test;
  read.push_back(flags.model);
  flags.data.check_outputs(
      {flags.output, flags.json.destination, flags.report.destination, flags.report.plot}, read);
  if (!flags.output.empty()) require_model_file(flags.output);
  const torsio::TransferOptions options{.method = method_of(flags.method),
                                        .ratios = ratios_of(flags)};
  const std::vector<double> times = curve_times(flags);
  const torsio::ModelFile base = torsio::load_model(flags.model);
  ProgressBar progress;
  const torsio::Dataset dataset = load(flags, base, progress.listener());
  warn_of_missing_zeros(base, dataset);
  torsio::TransferEvaluation evaluation =
      torsio::evaluate_transfer(base, dataset, options, flags.seed, progress.listener());
  torsio::TransferCurve curve;
  if (!times.empty())
    curve = torsio::transfer_curve(base, dataset, times, options, flags.seed, progress.listener());
  const std::string& target = base.settings.target;
  if (flags.json.wants_tables()) print(torsio::transfer_text(evaluation, curve, target));
  flags.json.write(torsio::transfer_json(evaluation, curve, target));
  if (flags.report.is_wanted())
    flags.report.write(
        torsio::transfer_report(evaluation, curve, base, dataset, progress.listener()));
  if (flags.output.empty()) return;
  torsio::ModelFile file = evaluation.transfer.best().file;
  file.card.device_serial = flags.device_serial;
  torsio::save_model(flags.output, file);  // last: untouched unless all else succeeded
  remark(flags.output + " written");
}

}  // namespace

void add_transfer(CLI::App& app) {
  auto flags = std::make_shared<TransferFlags>();
  CLI::App* verb =
      app.add_subcommand("transfer", "use a model of one joint on another one, with few new data");
  verb->footer(
      "Example: torsio transfer dfki_300.safetensors new_joint.csv --use 10s -o new.safetensors\n"
      "         torsio transfer base.safetensors chirp.csv --test walk.csv \\\n"
      "           --base-actuator dfki-300 --actuator dfki-120 --curve 2s,5s,10s --plot curve.svg\n"
      "Methods: none, offset (paper 000, equations 12 to 14), gain_offset, data_sheets, scaled, "
      "refit;\n"
      "auto takes the one with the least error on the last 30 % of what is used.");
  verb->add_option("MODEL", flags->model, "model file of the base")->required();
  flags->data.add_recordings(*verb, "recordings of the new joint, or a manifest");
  flags->data.add_model_mapping(*verb);
  verb->add_option("--test", flags->test,
                   "recordings for the scores; without them, what follows the used part");
  verb->add_option("--use", flags->use, "time of the new data that is used")->capture_default_str();
  verb->add_option("--method", flags->method, "one method, or auto")->capture_default_str();
  verb->add_option("--base-actuator", flags->base_actuator,
                   "data sheet of the base's actuator: a name, or a file");
  verb->add_option("--actuator", flags->actuator, "data sheet of the new joint's");
  verb->add_option("--stiffness-ratio", flags->stiffness_ratio,
                   "in place of data sheets: stiffness of the new spring over that of the base");
  verb->add_option("--torque-ratio", flags->torque_ratio, "likewise, of the rated torques");
  verb->add_option("--curve", flags->curve,
                   "times of a learning curve, separated by commas: 2s,5s,10s")
      ->delimiter(',');
  verb->add_option("-o,--output", flags->output,
                   "model file of the new joint; untouched unless all else succeeds");
  verb->add_option("--device-serial", flags->device_serial, "serial number of the new joint");
  add_seed(*verb, flags->seed, "of the fit to the new data alone");
  flags->json.add(*verb, "the results");
  flags->report.add(*verb, "Error over the time of the new data");
  verb->callback([flags] { run(*flags); });
}

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "data_flags.hpp"
#include "output.hpp"
#include "progress_bar.hpp"
#include "torsio/actuator/data_sheet.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/units.hpp"
#include "torsio/data/csv.hpp"
#include "torsio/report/text_table.hpp"
#include "torsio/sim/experiment.hpp"
#include "verbs.hpp"

namespace {

struct SimulateFlags {
  std::string actuator;
  std::string experiment;
  std::string output;
  std::string duration;
  std::string lever;
  std::string inclination;
  std::string amplitude;
  std::string frequency;
  std::string impedance = "high";
  std::string describe;
  std::uint64_t seed = kDefaultSeed;
  bool with_truth = false;
  bool list = false;
  JsonOutput json;
};

std::string bench_list() {
  torsio::TextTable actuators;
  actuators.header({"actuator", "what it is"});
  for (const torsio::DataSheet& sheet : torsio::data_sheets())
    actuators.row({std::string(sheet.name), std::string(sheet.title)});
  torsio::TextTable experiments;
  experiments.header({"experiment", "actuators", "what is done"});
  for (const torsio::ExperimentInfo& info : torsio::experiments())
    experiments.row(
        {std::string(info.name), std::string(info.actuators), std::string(info.description)});
  return actuators.text() + "\n" + experiments.text();
}

std::string description(const torsio::DataSheet& sheet) {
  torsio::TextTable table;
  table.header({"parameter", "value", "unit", "origin"});
  for (const torsio::SheetRow& row : torsio::describe(sheet))
    table.row({row.name, fmt::format("{:.6g}", row.value.value), std::string(row.unit),
               std::string(1, static_cast<char>(row.value.origin))});
  return fmt::format(
      "{}: {}\n{}origin: P printed in a paper, D derived from printed numbers, A assumed\n",
      torsio::full_name(sheet), sheet.title, table.text());
}

/// Nm or rad, as the experiment has it.
std::string_view amplitude_unit(const SimulateFlags& flags) {
  for (const torsio::ExperimentInfo& info :
       torsio::experiments(torsio::data_sheet(flags.actuator))) {
    if (info.name == flags.experiment && !info.amplitude_unit.empty()) return info.amplitude_unit;
  }
  return "Nm";
}

torsio::ExperimentSpec experiment_spec(const SimulateFlags& flags) {
  torsio::ExperimentSpec spec{.actuator = flags.actuator,
                              .experiment = flags.experiment,
                              .seed = flags.seed,
                              .with_truth = flags.with_truth};
  if (!flags.duration.empty())
    spec.duration_s = torsio::si_quantity(flags.duration, "s", "--duration");
  if (!flags.lever.empty()) spec.lever_m = torsio::si_quantity(flags.lever, "m", "--lever");
  if (!flags.inclination.empty())
    spec.inclination_rad = torsio::si_quantity(flags.inclination, "rad", "--inclination");
  if (!flags.amplitude.empty())
    spec.amplitude = torsio::si_quantity(flags.amplitude, amplitude_unit(flags), "--amplitude");
  if (!flags.frequency.empty())
    spec.frequency_Hz = torsio::si_quantity(flags.frequency, "Hz", "--frequency");
  spec.is_impedance_zero = flags.impedance == "zero";
  return spec;
}

using Json = nlohmann::ordered_json;

Json list_json() {
  Json document{{"actuators", Json::array()}, {"experiments", Json::array()}};
  for (const torsio::DataSheet& sheet : torsio::data_sheets())
    document["actuators"].push_back({{"name", sheet.name}, {"title", sheet.title}});
  for (const torsio::ExperimentInfo& info : torsio::experiments())
    document["experiments"].push_back(
        {{"name", info.name}, {"actuators", info.actuators}, {"description", info.description}});
  return document;
}

Json sheet_json(const torsio::DataSheet& sheet) {
  Json document{
      {"name", torsio::full_name(sheet)}, {"title", sheet.title}, {"parameters", Json::array()}};
  for (const torsio::SheetRow& row : torsio::describe(sheet))
    document["parameters"].push_back(
        {{"name", row.name},
         {"value", row.value.value},
         {"unit", row.unit},
         {"origin", std::string(1, static_cast<char>(row.value.origin))}});
  return document;
}

Json recording_json(const SimulateFlags& flags, const torsio::Recording& recording) {
  Json document{{"actuator", flags.actuator},  {"experiment", flags.experiment},
                {"seed", flags.seed},          {"recording", flags.output},
                {"samples", recording.size()}, {"sample_rate_Hz", recording.sample_rate_Hz()},
                {"channels", Json::array()}};
  for (const torsio::Channel& channel : recording.channels())
    document["channels"].push_back(channel.name);
  return document;
}

/// What a person or, with --json, a machine is shown.
void show(const SimulateFlags& flags, const std::string& text, const Json& document) {
  if (flags.json.wants_tables()) print(text);
  flags.json.write(document.dump(2) + "\n");
}

void run(const SimulateFlags& flags) {
  if (flags.list) return show(flags, bench_list(), list_json());
  if (!flags.describe.empty()) {
    const torsio::DataSheet sheet = torsio::data_sheet(flags.describe);
    return show(flags, description(sheet), sheet_json(sheet));
  }
  if (flags.actuator.empty() || flags.experiment.empty() || flags.output.empty())
    throw torsio::UsageError({.place = "torsio simulate",
                              .expected = "ACTUATOR EXPERIMENT -o FILE",
                              .advice = "torsio simulate --list shows what there is; example: "
                                        "torsio simulate dfki-50 sweep -o sweep.csv"});
  if (flags.output == "-" && flags.json.destination == "-")
    throw torsio::UsageError(
        {.place = "torsio simulate", .problem = "-o and --json cannot both be standard output"});
  require_folder_of(flags.output);
  ProgressBar bar;
  const torsio::Recording recording = torsio::simulate(experiment_spec(flags), bar.listener());
  torsio::write_csv(recording, flags.output);
  flags.json.write(recording_json(flags, recording).dump(2) + "\n");
  remark(fmt::format("{}: {} samples at {:g} Hz", flags.output, recording.size(),
                     recording.sample_rate_Hz()));
}

}  // namespace

void add_simulate(CLI::App& app) {
  auto flags = std::make_shared<SimulateFlags>();
  CLI::App* verb = app.add_subcommand("simulate", "record a run of a simulated bench");
  verb->footer("Example: torsio simulate dfki-50 sweep --lever 0.17m --seed 2 -o sweep.csv");
  verb->add_option("ACTUATOR", flags->actuator, "--list shows the names");
  verb->add_option("EXPERIMENT", flags->experiment, "--list shows the names");
  verb->add_option("-o,--output", flags->output, "CSV file to write, or - for standard output");
  verb->add_option("--duration", flags->duration, "length of the record (default: the protocol's)");
  verb->add_option("--lever", flags->lever, "where the 9 kg mass hangs on the lever: 0.17m");
  verb->add_option("--inclination", flags->inclination,
                   "of the lever's plane of motion from the vertical: 37.8deg");
  verb->add_option("--amplitude", flags->amplitude, "of the excitation: 20Nm or 9deg");
  verb->add_option("--frequency", flags->frequency, "of the excitation: 0.4Hz");
  verb->add_option("--impedance", flags->impedance, "of the joint's controller: high or zero")
      ->check(CLI::IsMember({"high", "zero"}))
      ->capture_default_str();
  verb->add_option("--seed", flags->seed, "seed of every sensor's noise")->capture_default_str();
  verb->add_flag("--truth", flags->with_truth, "add the truth_ channels that no sensor sees");
  verb->add_flag("--list", flags->list, "show actuators and experiments");
  verb->add_option("--describe", flags->describe, "show an actuator's data sheet");
  verb->add_option(
      "--json", flags->json.destination,
      "write what was recorded, or the list, as JSON to a file, or - for standard output");
  verb->callback([flags] { run(*flags); });
}

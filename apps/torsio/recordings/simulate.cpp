#include <fmt/format.h>

#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "common/data_flags.hpp"
#include "common/output.hpp"
#include "common/progress_bar.hpp"
#include "common/report_output.hpp"
#include "core/quantity.hpp"
#include "report/json_text.hpp"
#include "torsio/actuator/data_sheet.hpp"
#include "torsio/actuator/electrical_sheet.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/units.hpp"
#include "torsio/data/write.hpp"
#include "torsio/report/html/verb_reports.hpp"
#include "torsio/report/text_table.hpp"
#include "torsio/sim/bench/sheet_file.hpp"
#include "torsio/sim/experiments/experiment.hpp"
#include "verbs.hpp"

namespace {

using Json = nlohmann::ordered_json;

struct SimulateFlags {
  std::string actuator;
  std::string experiment;
  std::string output;
  std::string duration;
  std::string lever;
  std::string mass;
  std::string inclination;
  std::string amplitude;
  std::string frequency;
  std::string lowest;
  std::string highest;
  std::string impedance = "high";
  std::string faults;
  std::string temperature;
  std::string warm_up;
  std::string warm_up_time;
  std::string age;
  std::string describe;
  std::string yaml;
  std::uint64_t seed = kDefaultSeed;
  bool with_truth = false;
  bool is_electrical = false;
  bool list = false;
  JsonOutput json;
  ReportOutput report;
};

/// The first one is the default.
std::vector<std::string_view> variants(const torsio::DataSheet& sheet) {
  std::vector<std::string_view> names(sheet.variants.begin(), sheet.variants.end());
  std::erase(names, "");
  return names;
}

/// What goes into a model of an actuator whose spring does not lie between `gear_angle_rad` and
/// `joint_angle_rad`; empty: what every verb takes by itself.
std::string inputs_for(torsio::ActuatorFamily family, std::string_view variant) {
  if (family == torsio::ActuatorFamily::rubber_clutch)
    return "input_angle_rad - joint_angle_rad, lowpass(rate(input_angle_rad - joint_angle_rad), "
           "10Hz)";
  if (family != torsio::ActuatorFamily::harmonic_drive) return {};
  // A rigid tube's twist cannot be measured: the twist of gear and tube is used instead.
  const std::string twist = variant == "rigid"
                                ? "lowpass(motor_angle_rad / 2 - 51 * joint_angle_rad, 10Hz)"
                                : "motor_angle_rad / 2 - wave_generator_angle_rad";
  return twist + ", motor_torque_Nm, lowpass(rate(wave_generator_angle_rad), 10Hz)";
}

std::string bench_list() {
  torsio::TextTable actuators;
  actuators.header({"actuator", "variants (NAME:VARIANT)", "description"});
  for (const torsio::DataSheet& sheet : torsio::data_sheets())
    actuators.row({std::string(sheet.name), fmt::format("{}", fmt::join(variants(sheet), ", ")),
                   std::string(sheet.title)});
  std::string inputs;
  for (const torsio::DataSheet& sheet : torsio::data_sheets())
    if (const std::string named = inputs_for(sheet.family, sheet.variant); !named.empty())
      inputs += fmt::format("check and train {} with --inputs '{}'\n", sheet.name, named);
  torsio::TextTable experiments;
  experiments.header({"experiment", "actuators", "description"});
  for (const torsio::ExperimentInfo& info : torsio::experiments())
    experiments.row(
        {std::string(info.name), std::string(info.actuators), std::string(info.description)});
  return actuators.text() +
         "\nA specimen with manufacturing tolerances, by serial number: NAME#03\n" + inputs + "\n" +
         experiments.text();
}

std::vector<torsio::SheetRow> sheet_rows(const torsio::DataSheet& sheet, bool is_electrical) {
  std::vector<torsio::SheetRow> rows = torsio::describe(sheet);
  if (!is_electrical) return rows;
  for (torsio::SheetRow& row : torsio::describe(torsio::electrical_sheet(sheet)))
    rows.push_back(std::move(row));
  for (torsio::SheetRow& row : torsio::describe(torsio::brake_sheet(sheet)))
    rows.push_back(std::move(row));
  return rows;
}

std::string rows_text(std::string_view heading, const std::vector<torsio::SheetRow>& rows) {
  torsio::TextTable table;
  table.header({std::string(heading), "value", "unit", "origin"});
  for (const torsio::SheetRow& row : rows)
    table.row({row.name, fmt::format("{:.6g}", row.value.value), std::string(row.unit),
               std::string(1, static_cast<char>(row.value.origin))});
  return table.text();
}

std::string description(const torsio::DataSheet& sheet, bool is_electrical) {
  std::string tables = rows_text("parameter", sheet_rows(sheet, is_electrical));
  if (const auto facts = torsio::printed_facts(sheet); !facts.empty())
    tables += "\n" + rows_text("printed, not used", facts) + "\n";
  const torsio::PlantFigures plant = torsio::plant_figures(sheet);
  const auto [low_Hz, high_Hz] = plant.natural_frequencies_Hz;
  return fmt::format(
      "{}: {}\n{}origin: P printed in a paper, D derived from printed numbers, A assumed\n"
      "longest step: {:.3g} us\n"
      "natural frequencies, both ends free: {:.4g} Hz, {:.4g} Hz\n"
      "faults can be simulated in the sensors {} and in {}\n",
      torsio::full_name(sheet), sheet.title, tables, 1e6 * plant.longest_step_s, low_Hz, high_Hz,
      fmt::join(torsio::fault_sensors(sheet), ", "), fmt::join(torsio::fault_parts(sheet), ", "));
}

/// Nm or rad, as the experiment has it. An unknown experiment, or one without amplitude, is refused
/// where it is run, whatever the unit.
std::string_view amplitude_unit(const SimulateFlags& flags, const torsio::DataSheet& sheet) {
  for (const torsio::ExperimentInfo& info : torsio::experiments(sheet)) {
    if (info.name == flags.experiment && !info.amplitude_unit.empty()) return info.amplitude_unit;
  }
  return "Nm";
}

torsio::OperatingConditions conditions(const SimulateFlags& flags) {
  torsio::OperatingConditions of;
  const auto set = [](double& value, const std::string& text, const char* unit, const char* flag) {
    if (!text.empty()) value = torsio::signed_quantity_with_unit(text, unit, flag);
  };
  set(of.temperature_K, flags.temperature, "K", "--temperature");
  set(of.warm_up_K, flags.warm_up, "K", "--warm-up");
  set(of.warm_up_time_s, flags.warm_up_time, "s", "--warm-up-time");
  set(of.age, flags.age, "1", "--age");
  return of;
}

torsio::ExperimentSpec experiment_spec(const SimulateFlags& flags, const torsio::DataSheet& sheet,
                                       const torsio::Progress& progress) {
  torsio::ExperimentSpec spec{.experiment = flags.experiment,
                              .seed = flags.seed,
                              .is_electrical = flags.is_electrical,
                              .with_truth = flags.with_truth};
  const auto set = [](auto& value, const std::string& text, const char* unit, const char* flag) {
    if (!text.empty()) value = torsio::signed_quantity_with_unit(text, unit, flag);
  };
  set(spec.duration_s, flags.duration, "s", "--duration");
  set(spec.lever_m, flags.lever, "m", "--lever");
  set(spec.mass_kg, flags.mass, "kg", "--mass");
  set(spec.inclination_rad, flags.inclination, "rad", "--inclination");
  set(spec.frequency_Hz, flags.frequency, "Hz", "--frequency");
  set(spec.lowest_frequency_Hz, flags.lowest, "Hz", "--lowest");
  set(spec.highest_frequency_Hz, flags.highest, "Hz", "--highest");
  if (!flags.amplitude.empty()) {
    const std::string_view unit = amplitude_unit(flags, sheet);
    (unit == "rad" ? spec.angle_amplitude_rad : spec.torque_amplitude_Nm) =
        torsio::signed_quantity_with_unit(flags.amplitude, unit, "--amplitude");
  }
  spec.is_impedance_zero = flags.impedance == "zero";
  spec.conditions = conditions(flags);
  if (!flags.faults.empty())
    spec.faults = torsio::read_fault_schedule(flags.faults, sheet, progress);
  return spec;
}

Json list_json() {
  Json document{{"actuators", Json::array()}, {"experiments", Json::array()}};
  for (const torsio::DataSheet& sheet : torsio::data_sheets())
    document["actuators"].push_back(
        {{"name", sheet.name}, {"variants", variants(sheet)}, {"title", sheet.title}});
  for (const torsio::ExperimentInfo& info : torsio::experiments())
    document["experiments"].push_back(
        {{"name", info.name},
         {"actuators", info.actuators},
         {"amplitude_unit",
          info.amplitude_unit.empty() ? Json(nullptr) : Json(info.amplitude_unit)},
         {"description", info.description}});
  return document;
}

Json rows_json(const std::vector<torsio::SheetRow>& rows) {
  Json json = Json::array();
  for (const torsio::SheetRow& row : rows)
    json.push_back({{"name", row.name},
                    {"value", row.value.value},
                    {"unit", row.unit},
                    {"origin", std::string(1, static_cast<char>(row.value.origin))}});
  return json;
}

Json sheet_json(const torsio::DataSheet& sheet, bool is_electrical) {
  const torsio::PlantFigures plant = torsio::plant_figures(sheet);
  Json document{{"name", torsio::full_name(sheet)},
                {"title", sheet.title},
                {"variant", sheet.variant.empty() ? Json(nullptr) : Json(sheet.variant)},
                {"variants", variants(sheet)},
                {"longest_step_s", plant.longest_step_s},
                {"natural_frequencies_Hz", plant.natural_frequencies_Hz},
                {"fault_sensors", torsio::fault_sensors(sheet)},
                {"fault_parts", torsio::fault_parts(sheet)},
                {"parameters", rows_json(sheet_rows(sheet, is_electrical))},
                {"printed_facts", rows_json(torsio::printed_facts(sheet))}};
  return document;
}

/// null: the experiment's own.
Json optional(const std::optional<double>& value) { return value ? Json(*value) : Json(nullptr); }

Json recording_json(const SimulateFlags& flags, const torsio::ExperimentSpec& spec,
                    const torsio::Recording& recording) {
  Json document{{"actuator", flags.actuator},
                {"experiment", flags.experiment},
                {"seed", flags.seed},
                {"duration_s", static_cast<double>(recording.size()) / recording.sample_rate_Hz()},
                {"lever_m", optional(spec.lever_m)},
                {"mass_kg", optional(spec.mass_kg)},
                {"inclination_rad", spec.inclination_rad},
                {"torque_amplitude_Nm", optional(spec.torque_amplitude_Nm)},
                {"angle_amplitude_rad", optional(spec.angle_amplitude_rad)},
                {"frequency_Hz", optional(spec.frequency_Hz)},
                {"lowest_frequency_Hz", optional(spec.lowest_frequency_Hz)},
                {"highest_frequency_Hz", optional(spec.highest_frequency_Hz)},
                {"impedance", flags.impedance},
                {"electrical", spec.is_electrical},
                {"conditions",
                 {{"temperature_K", spec.conditions.temperature_K},
                  {"warm_up_K", spec.conditions.warm_up_K},
                  {"warm_up_time_s", spec.conditions.warm_up_time_s},
                  {"age", spec.conditions.age}}},
                {"fault_schedule", flags.faults},
                {"faults", spec.faults.faults.size()},
                {"recording", flags.output},
                {"samples", recording.size()},
                {"sample_rate_Hz", recording.sample_rate_Hz()},
                {"channels", Json::array()}};
  for (const torsio::Channel& channel : recording.channels())
    document["channels"].push_back(channel.name);
  return document;
}

/// Prints text or, with --json, JSON.
void show(const SimulateFlags& flags, const std::string& text, const Json& document) {
  if (flags.json.wants_tables()) print(text);
  flags.json.write(torsio::json_text(document));
}

/// The file of an actuator that is named by one; empty: none.
std::string sheet_file(const std::string& actuator) {
  return torsio::is_sheet_file(actuator) ? actuator : std::string();
}

void describe(const SimulateFlags& flags) {
  if (!flags.actuator.empty())
    throw torsio::UsageError({.place = "torsio simulate --describe",
                              .expected = "one name and no simulation",
                              .found = flags.actuator});
  DataFlags().check_outputs({flags.json.destination, flags.yaml}, {sheet_file(flags.describe)});
  require_ending("--yaml", flags.yaml, {".yaml", ".yml"});
  if (flags.is_electrical && !flags.yaml.empty())
    throw torsio::UsageError({.place = "--yaml",
                              .problem = "a data sheet as a file has no values of the electrical "
                                         "side and of the brake, which follow from the others",
                              .advice = "Leave out --electrical."});
  const torsio::OperatingConditions of = conditions(flags);
  torsio::check(of);
  const torsio::DataSheet sheet = torsio::aged(torsio::find_data_sheet(flags.describe), of.age);
  const JsonOutput yaml{flags.yaml};
  if (yaml.wants_tables() && flags.json.wants_tables())
    print(description(sheet, flags.is_electrical));
  flags.json.write(torsio::json_text(sheet_json(sheet, flags.is_electrical)));
  yaml.write(torsio::data_sheet_yaml(sheet));
}

void run(const SimulateFlags& flags) {
  if (flags.list) return show(flags, bench_list(), list_json());
  if (!flags.describe.empty()) return describe(flags);
  if (!flags.yaml.empty())
    throw torsio::UsageError({.place = "torsio simulate --yaml",
                              .expected = "--describe NAME, whose data sheet is written",
                              .advice = "Write a recording with -o FILE."});
  if (flags.actuator.empty() || flags.experiment.empty() || flags.output.empty())
    throw torsio::UsageError({.place = "torsio simulate",
                              .expected = "ACTUATOR EXPERIMENT -o FILE",
                              .advice = "torsio simulate --list shows all names; example: "
                                        "torsio simulate dfki-50 sweep -o sweep.csv"});
  DataFlags().check_outputs(
      {flags.output, flags.json.destination, flags.report.destination, flags.report.plot},
      {flags.faults, sheet_file(flags.actuator)});
  ProgressBar progress;
  const torsio::DataSheet sheet = torsio::find_data_sheet(flags.actuator, progress.listener());
  const torsio::ExperimentSpec spec = experiment_spec(flags, sheet, progress.listener());
  const torsio::Recording recording = torsio::simulate(sheet, spec, progress.listener());
  torsio::write_recording(recording, flags.output, progress.listener());
  flags.json.write(torsio::json_text(recording_json(flags, spec, recording)));
  if (flags.report.is_wanted())
    flags.report.write(
        torsio::simulation_report(recording, torsio::measured_twist(sheet, recording),
                                  fmt::format("{} {}", flags.actuator, flags.experiment)));
  remark(fmt::format("{}: {} samples at {:g} Hz", flags.output, recording.size(),
                     recording.sample_rate_Hz()));
  if (const std::string inputs = inputs_for(sheet.family, sheet.variant); !inputs.empty())
    remark("check it and train on it with --inputs '" + inputs + "'");
}

}  // namespace

void add_simulate(CLI::App& app) {
  auto flags = std::make_shared<SimulateFlags>();
  CLI::App* verb = app.add_subcommand("simulate", "record an experiment on a simulated bench");
  verb->footer(
      "Example: torsio simulate dfki-50 sweep --lever 0.17m --seed 2 -o sweep.csv\n"
      "An actuator of your own:\n"
      "  torsio simulate --describe dfki-50 --yaml my_joint.yaml\n"
      "  (edit the values, or give the torque curve of the spring as a table: "
      "docs/simulation/actuators.md)\n"
      "  torsio simulate my_joint.yaml sweep -o sweep.csv");
  verb->add_option("ACTUATOR", flags->actuator,
                   "--list shows the names; or a data sheet, FILE.yaml");
  verb->add_option("EXPERIMENT", flags->experiment, "--list shows the names");
  verb->add_option(
      "-o,--output", flags->output,
      fmt::format("file to write; its ending names the format: {}; or - for CSV on standard "
                  "output",
                  torsio::kRecordingEndings));
  verb->add_option("--duration", flags->duration,
                   "length of the recording (default: that of the protocol)");
  verb->add_option("--lever", flags->lever, "distance of the mass from the joint axis: 0.17m");
  verb->add_option("--mass", flags->mass, "mass on the lever (default 9kg; elastomer: 1kg)");
  verb->add_option("--inclination", flags->inclination,
                   "angle between the lever's plane of motion and the vertical: 37.8deg");
  verb->add_option("--amplitude", flags->amplitude, "amplitude of the excitation: 20Nm or 9deg");
  verb->add_option("--frequency", flags->frequency, "frequency of the excitation: 0.4Hz");
  verb->add_option("--lowest", flags->lowest,
                   "lowest frequency of an experiment in the air (default 0.1Hz)");
  verb->add_option("--highest", flags->highest,
                   "highest frequency of an experiment in the air (default 8Hz)");
  verb->add_option("--impedance", flags->impedance,
                   "impedance of the joint's controller: high or zero")
      ->check(CLI::IsMember({"high", "zero"}))
      ->capture_default_str();
  verb->add_option(
      "--faults", flags->faults,
      "YAML schedule of faults (docs/simulation/faults.md); --describe shows the possible ones");
  verb->add_option(
      "--temperature", flags->temperature,
      "gear temperature, -40degC to 85degC (default 25degC): friction decreases with it");
  verb->add_option("--warm-up", flags->warm_up, "temperature rise of the gear: 20K (default 0)");
  verb->add_option("--warm-up-time", flags->warm_up_time,
                   "time constant of the warm-up (default 20min)");
  verb->add_option(
      "--age", flags->age,
      "0 (default) to 1: the used share of the service life; softer, more friction and play");
  add_seed(*verb, flags->seed, "seed of the sensors' noise and of random excitations");
  verb->add_flag("--electrical", flags->is_electrical,
                 "the motor has windings and field-oriented current control; phase and supply "
                 "currents and the stator temperature are recorded. With --describe: its values");
  verb->add_flag("--truth", flags->with_truth, "add the truth_ channels, which no sensor measures");
  verb->add_flag("--list", flags->list, "show actuators with their variants, and experiments");
  verb->add_option(
      "--describe", flags->describe,
      "show a data sheet: dfki-50, dfki-50:bouc-wen, dfki-50#03, FILE.yaml; with --age a worn one");
  verb->add_option("--yaml", flags->yaml,
                   "with --describe: write the data sheet as YAML to a file, or - for standard "
                   "output; simulate and track take it as an actuator");
  flags->json.add(*verb, "the description of the recording, or the list,");
  flags->report.add(*verb);
  verb->callback([flags] { run(*flags); });
}

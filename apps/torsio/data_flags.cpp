#include "data_flags.hpp"

#include <filesystem>
#include <utility>

#include "output.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/units.hpp"
#include "torsio/data/load.hpp"
#include "torsio/signal/feature_pipeline.hpp"

namespace {

torsio::LoadOptions load_options(const DataFlags& flags, const torsio::Progress& progress) {
  torsio::LoadOptions options;
  options.progress = progress;
  if (!flags.mapping.empty()) options.mapping = flags.mapping;
  if (!flags.rate.empty()) options.rate_Hz = torsio::si_quantity(flags.rate, "Hz", "--rate");
  options.target = flags.target;
  return options;
}

}  // namespace

void DataFlags::add_recordings(CLI::App& verb, const char* help) {
  verb.add_option("REC", recordings, help);
}

void DataFlags::add_mapping(CLI::App& verb) {
  verb.add_option("--mapping", mapping,
                  "YAML file that renames and converts the columns of a foreign log");
  verb.add_option("--rate", rate, "resample to this rate, or the rate of a log without a clock");
}

void DataFlags::add_target_and_inputs(CLI::App& verb) {
  verb.add_option("--target", target, "channel to be told (default torque_Nm)");
  verb.add_option("--inputs", inputs,
                  "the model's inputs, separated by commas (default: the manifest's, else the "
                  "deflection, its filtered rate and the filtered joint speed)");
}

torsio::Dataset DataFlags::load(const std::vector<std::string>& validation,
                                const std::vector<std::string>& test,
                                const torsio::Progress& progress) const {
  if (recordings.empty())
    throw torsio::UsageError(
        {.place = "REC", .expected = "at least one recording or manifest", .found = "none"});
  const torsio::LoadOptions options = load_options(*this, progress);
  torsio::Dataset dataset = torsio::load_dataset(recordings, test, options);
  if (validation.empty()) return dataset;
  torsio::Dataset held_out = torsio::load_dataset({}, validation, options);
  for (torsio::DatasetRecord& record : held_out.records) {
    for (torsio::Segment& segment : record.segments) segment.role = torsio::Role::validation;
    dataset.records.push_back(std::move(record));
  }
  dataset.check();
  return dataset;
}

torsio::Dataset DataFlags::load_as_test(const torsio::Progress& progress) const {
  if (recordings.empty())
    throw torsio::UsageError(
        {.place = "REC", .expected = "at least one recording or manifest", .found = "none"});
  torsio::LoadOptions options = load_options(*this, progress);
  options.role = torsio::Role::test;
  return torsio::load_dataset(recordings, {}, options);
}

std::vector<std::string> DataFlags::wanted_inputs() const {
  return inputs.empty() ? std::vector<std::string>{} : torsio::split_inputs(inputs);
}

void DataFlags::check_output(const std::string& output,
                             const std::vector<std::string>& more_inputs) const {
  require_folder_of(output);
  std::vector<std::string> inputs_read = recordings;
  inputs_read.insert(inputs_read.end(), more_inputs.begin(), more_inputs.end());
  for (const std::string& input : inputs_read) {
    std::error_code absent;
    if (!output.empty() && std::filesystem::equivalent(input, output, absent))
      throw torsio::UsageError({.place = output,
                                .problem = "this output would replace a file that is read",
                                .advice = "Give the output another name."});
  }
}

std::map<std::string, std::string> parse_settings(const std::vector<std::string>& settings) {
  std::map<std::string, std::string> options;
  for (const std::string& setting : settings) {
    const std::size_t equals = setting.find('=');
    if (equals == std::string::npos)
      throw torsio::UsageError(
          {.place = "--set", .expected = "option=value", .found = "'" + setting + "'"});
    options[setting.substr(0, equals)] = setting.substr(equals + 1);
  }
  return options;
}

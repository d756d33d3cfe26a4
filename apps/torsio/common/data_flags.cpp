#include "common/data_flags.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <numbers>
#include <string_view>
#include <system_error>
#include <utility>

#include "common/output.hpp"
#include "core/quantity.hpp"
#include "data/load_roles.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/units.hpp"
#include "torsio/data/load.hpp"
#include "torsio/fit/common/load_target.hpp"
#include "torsio/fit/families.hpp"
#include "torsio/joint_load/known_load.hpp"
#include "torsio/signal/feature_pipeline.hpp"

namespace {

/// `--mapping` of a verb with a model file: the columns as they are named.
constexpr const char* kNoMapping = "none";

/// Whether both paths are the same file, or both are standard output. Devices and
/// pipes may be given more than once.
bool is_same_file(const std::string& one, const std::string& other) {
  if (one.empty() || other.empty()) return false;
  if (is_standard_output(one) || is_standard_output(other))
    return is_standard_output(one) && is_standard_output(other);
  std::error_code absent;
  if (std::filesystem::exists(one, absent) && !std::filesystem::is_regular_file(one, absent))
    return false;
  return std::filesystem::weakly_canonical(one, absent) ==
         std::filesystem::weakly_canonical(other, absent);
}

/// CLI11 alone would read "-1" as a number near 2^64, and cut longer ones.
std::string refuse_unless_whole(const std::string& text) {
  std::uint64_t seed = 0;
  const char* const end = text.data() + text.size();
  const auto [at, code] = std::from_chars(text.data(), end, seed);
  if (code == std::errc{} && at == end) return {};
  return "expected a whole number from 0 to 18446744073709551615, found '" + text + "'";
}

}  // namespace

double angular_frequency_rad_s(const std::string& text, const char* option) {
  constexpr std::string_view kSlash = "rad/s";
  std::string in_words = text;
  if (text.ends_with(kSlash)) in_words.replace(text.size() - kSlash.size(), kSlash.size(), "rad_s");
  if (in_words.ends_with("rad_s"))
    return above_zero(torsio::signed_quantity_with_unit(in_words, "rad_s", option), option);
  return 2.0 * std::numbers::pi *
         above_zero(torsio::signed_quantity_with_unit(text, "Hz", option), option);
}

std::vector<std::string_view> families_beyond_all() {
  std::vector<std::string_view> names;
  for (const torsio::FamilyInfo& family : torsio::families())
    if (family.only_if_named) names.push_back(family.name);
  return names;
}

void add_models(CLI::App& verb, std::string& models, std::string_view more) {
  verb.add_option(
          "--models", models,
          fmt::format("families with settings: linear,polynomial:degree=7:branch=true; all: "
                      "every family but {}{}",
                      fmt::join(families_beyond_all(), ", "), more))
      ->capture_default_str();
}

bool has_all(const std::string& models) {
  const std::vector<std::string> each = torsio::split_inputs(models);
  return std::ranges::find(each, "all") != each.end();
}

void add_seed(CLI::App& verb, std::uint64_t& seed, const char* help) {
  verb.add_option("--seed", seed, help)->check(refuse_unless_whole)->capture_default_str();
}

double above_zero(double value, const char* flag) {
  if (value > 0.0 && std::isfinite(value)) return value;
  throw torsio::UsageError(
      {.place = flag, .expected = "a finite number above 0", .found = fmt::format("{}", value)});
}

void DataFlags::add_recordings(CLI::App& verb, const char* help) {
  verb.add_option("REC", recordings, help);
}

void DataFlags::add_mapping(CLI::App& verb) {
  verb.add_option(
      "--mapping", mapping,
      "YAML file that renames and converts the columns of a foreign log, or the name of "
      "a mapping that comes with torsio (docs/use/recordings.md)");
  add_rate_and_joint(verb);
}

void DataFlags::add_model_mapping(CLI::App& verb) {
  verb.add_option("--mapping", mapping,
                  "YAML file that renames and converts the columns of a foreign log (default: the "
                  "mapping that the model was trained with; none: the columns as they are named)");
  add_rate_and_joint(verb);
}

void DataFlags::add_rate_and_joint(CLI::App& verb) {
  verb.add_option("--joint", joint, "joint of a mapping for several, whose names it uses");
  verb.add_option("--rate", rate, "resample to this rate, or the rate of a log without a clock");
}

void DataFlags::add_target_and_inputs(CLI::App& verb) {
  verb.add_option("--target", target, "target channel (default torque_Nm)");
  verb.add_option("--inputs", inputs,
                  "the model's inputs, separated by commas (default: the manifest's, else the "
                  "deflection, its filtered rate and the filtered joint speed)");
}

void DataFlags::add_initialise(CLI::App& verb) {
  verb.add_option("--initialise", initialise,
                  "measured samples at the start of a recording from which the memory of a model "
                  "is initialised; "
                  "they are not scored; 0: no initialisation")
      ->capture_default_str();
}

void DataFlags::add_load(CLI::App& verb, const char* help) {
  verb.add_option("--load", load_file, help);
}

void DataFlags::add_target(torsio::Dataset& dataset, const torsio::FeatureSpec& features,
                           const torsio::LoadTarget& before) const {
  if (load_file.empty()) return;
  torsio::add_load_target(dataset, torsio::read_load_sheet(load_file), features, before);
}

void DataFlags::compute_target(torsio::Dataset& dataset, const torsio::FeatureSpec& features,
                               const torsio::LoadTarget& before) const {
  add_target(dataset, features, before);
  if (load_file.empty()) return;
  for (const std::string& note : torsio::load_target_notes(dataset.load_target)) remark(note);
}

void DataFlags::require_recordings() const {
  if (recordings.empty())
    throw torsio::UsageError(
        {.place = "REC", .expected = "at least one recording or manifest", .found = "none"});
}

void DataFlags::use_model_mapping(const std::string& text, const std::string& model) {
  model_mapping_place_ = model + ": mapping";
  if (mapping == kNoMapping) {
    mapping.clear();
  } else if (mapping.empty()) {
    model_mapping_ = text;
  }
}

void DataFlags::use_model(const torsio::ModelFile& file, const std::string& path) {
  target = file.settings.target;
  use_model_mapping(file.card.mapping, path);
}

torsio::LoadOptions DataFlags::load_options(const torsio::Progress& progress) const {
  torsio::LoadOptions options;
  options.progress = progress;
  if (!mapping.empty()) options.mapping = mapping;
  if (!joint.empty() && mapping.empty())
    throw torsio::UsageError({.place = "--joint " + joint,
                              .problem = "there is no mapping to choose a joint of",
                              .advice = "Give one with --mapping FILE."});
  options.default_mapping = model_mapping_;
  options.default_mapping_place = model_mapping_place_;
  if (!rate.empty()) options.rate_Hz = torsio::signed_quantity_with_unit(rate, "Hz", "--rate");
  options.target = target;
  options.computes_target = !load_file.empty();
  options.joint = joint;
  return options;
}

void DataFlags::remark_on_mapping(const torsio::Dataset& dataset) const {
  if (model_mapping_.empty()) return;
  if (std::ranges::any_of(dataset.records, [&](const torsio::DatasetRecord& record) {
        return record.recording.mapping == model_mapping_;
      }))
    remark("recordings are read with the mapping that the model was trained with (" +
           model_mapping_place_ + ")");
}

template <class Load>
torsio::Dataset DataFlags::checked(const Load& load) const {
  try {
    torsio::Dataset dataset = load();
    check_not_read(dataset.files);
    dataset.initialise_samples = initialise;
    remark_on_mapping(dataset);
    std::vector<const torsio::Recording*> all;
    for (const torsio::DatasetRecord& record : dataset.records) all.push_back(&record.recording);
    remark_on_reading(all);
    return dataset;
  } catch (const torsio::Error& error) {
    torsio::ErrorReport report = error.report();
    if (model_mapping_.empty() || !report.place.starts_with(model_mapping_place_)) throw;
    report.advice +=
        "The model was trained with this mapping; --mapping FILE gives another one, --mapping none "
        "reads the columns as they are named.";
    throw torsio::Error(std::move(report));
  }
}

void DataFlags::remark_on_reading(std::span<const torsio::Recording* const> recordings) {
  std::map<std::string, std::vector<std::string>>
      files_of_note;  // each note once, for all its files
  for (const torsio::Recording* const recording : recordings) {
    if (recording->is_unfinished)
      remark("warning: " + recording->name() + ": " + std::string(torsio::kUnfinishedText));
    std::vector<std::string> notes = recording->notes;
    if (!recording->not_read.empty())
      notes.push_back(
          fmt::format("arrays that are not read: {}", fmt::join(recording->not_read, ", ")));
    for (const std::string& note : notes) {
      std::vector<std::string>& files = files_of_note[note];
      if (std::ranges::find(files, recording->source.file) == files.end())
        files.push_back(recording->source.file);
    }
  }
  for (const auto& [note, files] : files_of_note) {
    const std::string more =
        files.size() > 1
            ? fmt::format(" and {} other file{}", files.size() - 1, files.size() > 2 ? "s" : "")
            : std::string();
    remark(fmt::format("{}{}: {}", files.front(), more, note));
  }
}

torsio::Dataset DataFlags::load_inputs(const std::vector<std::string>& channels,
                                       const torsio::Progress& progress) const {
  require_recordings();
  return checked([&] { return torsio::load_inputs(recordings, channels, load_options(progress)); });
}

torsio::Dataset DataFlags::load(const std::vector<std::string>& validation,
                                const std::vector<std::string>& test,
                                const torsio::Progress& progress) const {
  require_recordings();
  return checked([&] {
    return torsio::load_with_validation(recordings, validation, test, load_options(progress));
  });
}

torsio::Dataset DataFlags::load_as_test(const torsio::Progress& progress) const {
  require_recordings();
  torsio::LoadOptions options = load_options(progress);
  options.role = torsio::Role::test;
  return checked([&] { return torsio::load_dataset(recordings, {}, options); });
}

std::vector<std::string> DataFlags::wanted_inputs() const {
  return inputs.empty() ? std::vector<std::string>{} : torsio::split_inputs(inputs);
}

void DataFlags::check_not_read(const std::vector<std::string>& files_read) const {
  for (const std::string& output : outputs_)
    for (const std::string& file : files_read)
      if (is_same_file(file, output))
        throw torsio::UsageError({.place = output,
                                  .problem = "this output would replace a file that is read",
                                  .advice = "Give the output another name."});
}

void DataFlags::check_outputs(const std::vector<std::string>& outputs,
                              const std::vector<std::string>& more_inputs) {
  outputs_ = outputs;
  check_not_read(recordings);
  check_not_read(more_inputs);
  check_not_read({mapping});
  check_not_read({load_file});
  for (std::size_t i = 0; i < outputs.size(); ++i) {
    if (outputs[i].empty()) continue;
    require_writable(outputs[i]);
    for (std::size_t j = 0; j < i; ++j) {
      if (!is_same_file(outputs[j], outputs[i])) continue;
      throw torsio::UsageError({.place = outputs[i],
                                .problem = "two outputs would be written to it",
                                .advice = "Give each output a different name."});
    }
  }
}

std::map<std::string, std::string> parse_settings(const std::vector<std::string>& settings) {
  std::map<std::string, std::string> options;
  for (const std::string& setting : settings) {
    const std::size_t equals = setting.find('=');
    if (equals == std::string::npos)
      throw torsio::UsageError({.place = "--set",
                                .expected = "option=value in one word, such as degree=3",
                                .found = "'" + setting + "'",
                                .advice = "Give one --set for each setting."});
    options[setting.substr(0, equals)] = setting.substr(equals + 1);
  }
  return options;
}

#include "torsio/data/load.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <iterator>
#include <map>
#include <set>
#include <thread>
#include <utility>

#include "data/channel_names.hpp"
#include "data/facts_of_run.hpp"
#include "data/load_roles.hpp"
#include "data/mapping/canonical_channels.hpp"
#include "data/mapping/columns.hpp"
#include "data/mapping/measured_recordings.hpp"
#include "data/mapping/needed_definitions.hpp"
#include "data/names.hpp"
#include "data/read_log.hpp"
#include "data/resample.hpp"
#include "data/whole_samples.hpp"
#include "numerics/parallel.hpp"
#include "numerics/shared_progress.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/units.hpp"
#include "torsio/data/mapping.hpp"
#include "torsio/data/write.hpp"

namespace torsio {
namespace {

constexpr const char* kDefaultTarget = "torque_Nm";

bool is_manifest(const std::string& path) {
  return path.ends_with(".yaml") || path.ends_with(".yml");
}

/// One log with its options.
struct Log {
  std::string path;
  ManifestFile entry = {};
  Mapping mapping = {};
  double rate_Hz = 0.0;  ///< 0: its own
};

bool contains(const std::vector<std::string>& names, const std::string& name) {
  return std::ranges::find(names, name) != names.end();
}

/// Removes what a log does not need: definitions, and rules for channels that it does not have.
void keep_needed(Mapping& mapping, const LogTable& table, std::vector<std::string> needed) {
  needed.insert(needed.end(), {"t_s", "time_s"});
  mapping.derive = needed_definitions(mapping.derive, needed);
  std::vector<std::string> left = needed;
  for (const LogColumn& column : table.columns) {
    const std::string full_name = column.full_name();  // `name` refers to it
    if (const auto name = split_channel_name(full_name)) left.push_back(name->si());
  }
  std::erase_if(mapping.channels, [&](const ChannelRule& rule) {
    const auto name = split_channel_name(rule.name);
    const bool is_there = table.find(rule.from) != nullptr;
    if (is_there && name) left.push_back(name->si());
    return !is_there && name && !contains(needed, name->si());
  });
  const auto is_missing = [&](const std::string& channel) { return !contains(left, channel); };
  std::erase_if(mapping.hold, is_missing);
  std::erase_if(mapping.zero, [&](const ZeroRule& rule) { return is_missing(rule.channel); });
  std::erase_if(mapping.latency, [&](const LatencyRule& rule) { return is_missing(rule.channel); });
}

/// A shift into the past looks ahead: harmless for a target that is only compared with, impossible
/// for an input at run time.
void refuse_latency_of_inputs(const Mapping& mapping, const std::string& target) {
  for (const LatencyRule& rule : mapping.latency)
    if (rule.channel != target)
      throw Error(
          {.place = mapping.file + ": latency." + rule.channel,
           .problem = "only the target may be shifted: at run time an input arrives late",
           .expected = target,
           .found = rule.channel,
           .advice = "Leave the input late, or name it with --target if it is the target."});
}

/// A target that was not recorded, if it is canonical and its sources exist: for an inverse model
/// the deflection.
void derive_target(Recording& recording, const std::string& target) {
  if (recording.has(target)) return;
  for (const CanonicalChannel& channel : kCanonicalChannels) {
    const std::vector<std::string> sources = channels_of(channel.expression);
    if (channel.name == target &&
        std::ranges::all_of(sources, [&](const auto& name) { return recording.has(name); }))
      add_derived(recording, {{std::string(channel.name), std::string(channel.expression)}});
  }
}

/// A channel of these keys need not be recorded, but one that is must not be missed because of its spelling.
void check_spelling(const Mapping& mapping, const Recording& recording) {
  const std::vector<std::string> names = channel_names(recording.channels());
  const auto check = [&](const std::string& name, const std::string& key) {
    const std::string advice = recording.has(name) ? "" : did_you_mean(name, names);
    if (advice.empty()) return;
    throw Error({.place = mapping.file + ": " + key,
                 .problem = fmt::format("{} has no channel '{}'", recording.name(), name),
                 .found = "the channels " + joined(names),
                 .advice = advice + " If it was not recorded, remove it here."});
  };
  for (const auto& [target, sources] : mapping.computed_from) {
    check(target, "computed_from");
    for (const std::string& source : sources) check(source, "computed_from." + target);
  }
  for (const UncertaintyRule& rule : mapping.uncertainty) check(rule.channel, "uncertainty");
}

/// The columns that the mapping names.
std::vector<std::string> columns_of(const Mapping& mapping) {
  std::vector<std::string> names;
  for (const ChannelRule& rule : mapping.channels) names.push_back(rule.from);
  if (!mapping.split_by.empty()) names.push_back(mapping.split_by);
  return names;
}

/// Columns of the clock, of `split_by` and of masks: they have no numbers for what was not measured.
std::vector<std::string> complete_columns(const Mapping& mapping) {
  std::vector<std::string> names;
  for (const ChannelRule& rule : mapping.channels) {
    const auto name = split_channel_name(rule.name);
    if ((name && name->unit->si_suffix == "s") || !marked_quantity(rule.name).empty())
      names.push_back(rule.from);
  }
  if (!mapping.split_by.empty()) names.push_back(mapping.split_by);
  return names;
}

CsvRules csv_rules(const Mapping& mapping) {
  return {.only_wanted = !mapping.channels.empty(),
          .missing = mapping.missing,
          .complete = complete_columns(mapping),
          .decimal = mapping.decimal,
          .skip_lines = mapping.skip_lines,
          .time_format = mapping.clock.format};
}

/// @param needed the channels that suffice; empty: all of the mapping, and the target
std::vector<Recording> load(const Log& log, const std::string& target,
                            const std::vector<std::string>& needed, const Progress& progress) {
  LogTable table = read_log(log.path, {.skip = log.mapping.drop,
                                       .wanted = columns_of(log.mapping),
                                       .progress = progress,
                                       .csv = csv_rules(log.mapping)});
  const bool is_unfinished = table.is_unfinished;
  Mapping mapping = log.mapping;
  if (!needed.empty()) keep_needed(mapping, table, needed);
  use_rate_of_format(table, mapping, log.rate_Hz);
  const auto conditions = std::move(table.conditions);
  std::vector<Recording> recordings =
      measured_recordings(std::move(table), mapping, log.rate_Hz, log.entry.name);
  const std::string text = mapping_text(log.mapping);
  for (Recording& recording : recordings) {
    if (log.rate_Hz > 0.0 && recording.sample_rate_Hz() != log.rate_Hz)
      recording = resample(recording, log.rate_Hz);
    add_conditions(recording, log.entry, conditions);
    add_derived(recording, mapping.derive);
    if (needed.empty()) {
      derive_target(recording, target);
      check_spelling(mapping, recording);
    }
    recording.source.file = log.entry.file;
    recording.mapping = text;
    recording.is_unfinished = is_unfinished;
  }
  return recordings;
}

std::vector<Segment> segments_of(const Recording& recording, const ManifestFile& entry,
                                 const std::optional<SplitRule>& split_of_all, Role else_role) {
  const std::size_t samples = recording.size();
  if (entry.role) return whole_record(samples, *entry.role);
  const auto& split = entry.split ? entry.split : split_of_all;
  if (!split) return whole_record(samples, else_role);
  const std::size_t embargo =
      whole_samples(std::ceil(split->embargo_s * recording.sample_rate_Hz() - 1e-9), samples,
                    recording.name() + ": split.embargo");
  try {
    return split->interleaved_blocks > 0
               ? interleaved_blocks(samples, split->interleaved_blocks, split->test_every, embargo)
               : contiguous_blocks(samples, split->contiguous, embargo);
  } catch (const Error& error) {
    ErrorReport report = error.report();
    report.place = recording.name() + ": split";
    throw Error(std::move(report));
  }
}

/// Collects the contents of the files and manifests of one call.
class Collector {
 public:
  explicit Collector(LoadOptions options) : options_(std::move(options)) {
    if (options_.rate_Hz && !(*options_.rate_Hz > 0.0 && std::isfinite(*options_.rate_Hz)))
      throw UsageError({.place = "--rate",
                        .expected = "a positive number of Hz",
                        .found = fmt::format("{}", *options_.rate_Hz)});
    if (options_.mapping) mapping_ = mapping_from(*options_.mapping);
    if (!options_.default_mapping.empty()) default_mapping_ = mapping_of_model();
    dataset_.target = options_.target;
  }

  /// With a role, all of it takes that role.
  void add(const std::string& path, std::optional<Role> role = {}) {
    if (is_manifest(path))
      add_manifest(read_manifest(path, options_.progress), role);
    else
      add_log(path, role);
  }

  void add_manifest(Manifest manifest, std::optional<Role> role) {
    dataset_.files.push_back(manifest.file);
    agree(dataset_.target, manifest.target, "target", manifest.file);
    agree(dataset_.label, manifest.label, "label", manifest.file);
    if (dataset_.input_sets.empty()) dataset_.input_sets = manifest.input_sets;
    const std::filesystem::path folder = data_folder(manifest);
    for (ManifestFile& entry : manifest.files) {
      if (role) entry.role = role;
      Planned planned{.log = {.path = (folder / entry.file).string(),
                              .entry = entry,
                              .mapping = mapping_of(entry, manifest),
                              .rate_Hz = options_.rate_Hz.value_or(manifest.sample_rate_Hz)},
                      .split_of_all = manifest.split};
      if (entry.zero) planned.log.mapping.zero = *entry.zero;
      logs_.push_back(std::move(planned));
    }
  }

  /// @param needed as in `load`
  Dataset finish(const std::vector<std::string>& needed = {}) {
    refuse_twins();
    if (dataset_.target.empty()) dataset_.target = kDefaultTarget;
    name_twins_by_path();
    for (const Planned& planned : logs_) {
      dataset_.files.push_back(planned.log.path);
      const Mapping& mapping = planned.log.mapping;
      refuse_latency_of_inputs(mapping, dataset_.target);
      if (const auto leak = mapping.computed_from.find(dataset_.target);
          leak != mapping.computed_from.end())
        leaks_.insert(leak->second.begin(), leak->second.end());
    }
    std::vector<std::vector<DatasetRecord>> of_logs(logs_.size());
    ProgressOfParts progress(options_.progress, logs_.size());
    for_each_chunk(logs_.size(), reading_threads(), [&](std::size_t i) {
      of_logs[i] = records_of(logs_[i], needed, progress.part(i));
    });
    for (std::vector<DatasetRecord>& records : of_logs)
      std::ranges::move(records, std::back_inserter(dataset_.records));
    name_twins_by_file(dataset_.records);
    dataset_.target_computed_from.assign(leaks_.begin(), leaks_.end());
    return std::move(dataset_);
  }

 private:
  struct Planned {
    Log log;
    std::optional<SplitRule> split_of_all = {};
  };

  /// Files are read at the same time, a few of them, since the text of each becomes a table before
  /// it becomes channels. A pipe can make its reader wait, and a stop must end that wait.
  [[nodiscard]] std::size_t reading_threads() const {
    constexpr std::size_t kMost = 4;
    const auto is_file = [](const Planned& planned) {
      std::error_code absent;
      return std::filesystem::is_regular_file(planned.log.path, absent);
    };
    if (!std::ranges::all_of(logs_, is_file)) return 1;
    return std::clamp<std::size_t>(std::thread::hardware_concurrency(), 1, kMost);
  }

  [[nodiscard]] std::vector<DatasetRecord> records_of(const Planned& planned,
                                                      const std::vector<std::string>& needed,
                                                      const Progress& progress) const {
    std::vector<DatasetRecord> records;
    for (Recording& recording : load(planned.log, dataset_.target, needed, progress)) {
      auto segments =
          segments_of(recording, planned.log.entry, planned.split_of_all, options_.role);
      records.push_back({.recording = std::move(recording), .segments = std::move(segments)});
    }
    return records;
  }

  void add_log(const std::string& path, std::optional<Role> role) {
    Planned planned{.log = {.path = path, .mapping = mapping_.value_or(default_mapping_)}};
    planned.log.entry.file = path;
    planned.log.entry.role = role;
    planned.log.rate_Hz = options_.rate_Hz.value_or(0.0);
    logs_.push_back(std::move(planned));
  }

  /// One file twice in one role would only count double.
  void refuse_twins() const {
    std::set<std::pair<std::string, Role>> seen;
    for (const Planned& planned : logs_) {
      const ManifestFile& entry = planned.log.entry;
      if (planned.log.path == "-" || entry.split || planned.split_of_all ||
          !planned.log.mapping.keep.empty() || !entry.conditions.empty())
        continue;
      std::error_code absent;
      const auto place = std::filesystem::weakly_canonical(planned.log.path, absent);
      if (!seen.emplace(place.string(), entry.role.value_or(options_.role)).second)
        throw UsageError(
            {.place = planned.log.path,
             .problem = "the recording is given twice",
             .advice = "Leave one out: repeated samples contain no further information."});
    }
  }

  /// Two files of one name in different folders must stay apart in every table.
  void name_twins_by_path() {
    std::map<std::string, std::size_t> met;
    for (const Planned& planned : logs_) ++met[file_stem(planned.log.path)];
    for (Planned& planned : logs_)
      if (planned.log.entry.name.empty() && met[file_stem(planned.log.path)] > 1)
        planned.log.entry.name = planned.log.entry.file;
  }

  /// The user's option overrides a manifest; two manifests must agree.
  void agree(std::string& current, const std::string& given, const std::string& what,
             const std::string& file) const {
    if (given.empty() || (what == "target" && !options_.target.empty())) return;
    if (current.empty()) current = given;
    if (current != given)
      throw UsageError({.place = file + ": " + what,
                        .problem = "the manifests disagree",
                        .expected = current,
                        .found = given});
  }

  /// Without dropping the target: a model of a computed torque is trained without the column of the sensor, with which it
  /// may be compared.
  [[nodiscard]] Mapping mapping_of_model() const {
    Mapping mapping = parse_mapping(options_.default_mapping, options_.default_mapping_place);
    if (!options_.computes_target)
      std::erase_if(mapping.drop, [&](const std::string& pattern) {
        return is_matched(options_.target, pattern);
      });
    return mapping;
  }

  [[nodiscard]] Mapping mapping_from(const std::string& path) {
    dataset_.files.push_back(path);
    return read_mapping(path, options_.progress, options_.joint);
  }

  [[nodiscard]] Mapping mapping_of(const ManifestFile& entry, const Manifest& manifest) {
    if (mapping_) return *mapping_;
    const auto& choice = entry.mapping ? entry.mapping : manifest.mapping;
    if (!choice) return default_mapping_;
    if (choice->file.empty()) return choice->here;
    return mapping_from(
        (std::filesystem::path(manifest.file).parent_path() / choice->file).string());
  }

  LoadOptions options_;
  std::optional<Mapping> mapping_;
  Mapping default_mapping_;
  std::vector<Planned> logs_;
  std::set<std::string> leaks_;
  Dataset dataset_;
};

}  // namespace

std::vector<Recording> load_recordings(const std::string& path, const LoadOptions& options) {
  Collector collector(options);
  collector.add(path);
  std::vector<Recording> recordings;
  for (DatasetRecord& record : collector.finish().records)
    recordings.push_back(std::move(record.recording));
  return recordings;
}

Dataset load_dataset(const std::vector<std::string>& train_files,
                     const std::vector<std::string>& test_files, const LoadOptions& options) {
  Collector collector(options);
  for (const std::string& path : train_files) collector.add(path);
  for (const std::string& path : test_files) collector.add(path, Role::test);
  Dataset dataset = collector.finish();
  if (!options.computes_target) dataset.check();
  return dataset;
}

Dataset load_with_validation(const std::vector<std::string>& train_files,
                             const std::vector<std::string>& validation_files,
                             const std::vector<std::string>& test_files,
                             const LoadOptions& options) {
  Dataset dataset = load_dataset(train_files, test_files, options);
  if (validation_files.empty()) return dataset;
  Dataset held_out = load_dataset({}, validation_files, options);
  for (DatasetRecord& record : held_out.records) {
    for (Segment& segment : record.segments) segment.role = Role::validation;
    dataset.records.push_back(std::move(record));
  }
  std::ranges::move(held_out.files, std::back_inserter(dataset.files));
  if (!options.computes_target) dataset.check();
  return dataset;
}

Dataset load_inputs(const std::vector<std::string>& files, const std::vector<std::string>& channels,
                    const LoadOptions& options) {
  Collector collector(options);
  for (const std::string& path : files) collector.add(path);
  return collector.finish(channels);
}

Dataset load_manifest(const Manifest& manifest, const LoadOptions& options) {
  Collector collector(options);
  collector.add_manifest(manifest, {});
  Dataset dataset = collector.finish();
  dataset.check();
  return dataset;
}

}  // namespace torsio

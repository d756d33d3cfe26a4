#include "studies/board_data.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <iterator>
#include <utility>

#include "evaluate/measured_samples.hpp"
#include "numerics/metrics_accumulator.hpp"
#include "torsio/core/error.hpp"
#include "torsio/data/load.hpp"

namespace torsio {
namespace {

Manifest recordings_of_the_board() {
  Manifest places;
  places.file = "board";
  places.roots = {"${TORSIO_DATA}", "../shared/data"};
  return places;
}

/// A benchmark with one official training recording.
ComparisonCase official(const BoardSet& set, const std::string& train,
                        const std::vector<std::string>& tests, const std::string& input,
                        const LoadOptions& more) {
  const std::string at = board_folder() + "/" + std::string(set.folder) + "/";
  std::vector<std::string> files;
  files.reserve(tests.size());
  for (const std::string& test : tests) files.push_back(at + test + ".csv.gz");
  LoadOptions load = more;
  load.target = set.target;
  return {.dataset = load_dataset({at + train + ".csv.gz"}, files, load), .inputs = {input}};
}

ComparisonCase servo(const BoardSet& set, const LoadOptions& load) {
  ComparisonCase made;
  made.dataset.target = set.target;
  for (const BoardFile& file : board_files()) {
    if (file.folder != set.folder) continue;
    const std::string path = fmt::format("{}/{}/{}", board_folder(), file.folder, file.file);
    for (Recording& recording : load_recordings(path, load)) {
      const std::size_t samples = recording.size();
      made.dataset.records.push_back({std::move(recording), whole_record(samples, Role::test)});
    }
  }
  return made;
}

ComparisonCase loaded(const BoardSet& set, const Progress& progress) {
  LoadOptions load;
  load.progress = progress;
  if (set.data == "boucwen") {
    constexpr double kRate_Hz = 750.0;
    load.rate_Hz = kRate_Hz;
    return official(set, "train_multisine", {"test_multisine", "test_sinesweep"}, "u_N", load);
  }
  // The drive's gain of 35.15 N/V is that of the benchmark's authors.
  if (set.data == "emps") return official(set, "emps_est", {"emps_val"}, "vir_V * 35.15", load);
  if (set.data == "xl330") return servo(set, load);
  const std::vector<ComparisonPlan> plans = recorded_plans();
  const auto plan = std::ranges::find(plans, set.data, &ComparisonPlan::name);
  return plan->make(0, progress);
}

bool is_in(const DatasetRecord& record, std::size_t sample, Role role) {
  return std::ranges::any_of(record.segments, [&](const Segment& segment) {
    return segment.role == role && segment.begin <= sample && sample < segment.end;
  });
}

bool is_tested(const BoardSet& set, const DatasetRecord& record) {
  return record.has_role(Role::test) &&
         (set.recording.empty() || record.recording.name() == set.recording);
}

/// The measured samples at the start that a model may use.
std::size_t start_of(const BoardSet& set, const Channel& target) {
  std::size_t samples = 0;
  for (std::size_t left = set.initialise_samples; left > 0 && samples < target.values.size();
       ++samples)
    if (is_measured(target, samples)) --left;
  return samples;
}

std::string cell(double value) {
  return std::isfinite(value) ? fmt::format("{}", value) : std::string();
}

/// Whether the target of a sample may be used: of the start, or of the training.
bool may_use_target(const BoardSet& set, const DatasetRecord& record, std::size_t sample,
                    std::size_t start, BoardPart part) {
  if (is_in(record, sample, Role::train)) return true;
  // Where a set has test recordings only, each of them trains the models of the others.
  if (part == BoardPart::training && set.data == "xl330") return true;
  return part == BoardPart::test && sample < start;
}

/// Channels that a model may use: not the target, nor what it was computed from or what follows from it.
std::vector<const Channel*> usable_channels(const BoardSet& set, const Dataset& dataset,
                                            const Recording& recording, BoardPart part) {
  const auto is_in_list = [](const auto& list, std::string_view name) {
    return std::ranges::find(list, name) != list.end();
  };
  std::vector<const Channel*> channels;
  for (const Channel& channel : recording.channels()) {
    if (channel.name == dataset.target || is_in_list(dataset.target_computed_from, channel.name))
      continue;
    if (part == BoardPart::test && is_in_list(set.hidden, channel.name)) continue;
    channels.push_back(&channel);
  }
  return channels;
}

}  // namespace

std::string board_folder() {
  try {
    return data_folder(recordings_of_the_board());
  } catch (const Error&) {
    return {};
  }
}

std::string why_left_out(const BoardSource& source, const std::string& folder) {
  const std::string missing =
      folder.empty() ? fmt::format("{}/", source.folder) : missing_file(source, folder);
  if (missing.empty()) return {};
  // NOLINTNEXTLINE(concurrency-mt-unsafe): the environment is not written
  const char* const variable = std::getenv("TORSIO_DATA");
  const std::string state = variable == nullptr || *variable == '\0' ? "not set"
                            : std::filesystem::is_directory(variable)
                                ? variable
                                : fmt::format("{}, which is not a folder", variable);
  const std::string place = folder.empty() ? "$TORSIO_DATA" : folder;
  return fmt::format(
      "{} is missing: fetch it from {}, and write it to {}/{} with  tools/board_files ORIGINALS {} "
      " (TORSIO_DATA is {})",
      missing, source.address, place, source.folder, place, state);
}

ComparisonCase board_case(const BoardSet& set, const Progress& progress) {
  const std::string reason = why_left_out(source_of(set), board_folder());
  if (!reason.empty())
    throw Error({.place = std::string(set.name),
                 .problem = reason,
                 .advice = "docs/board.md lists the files with their columns and hashes."});
  ComparisonCase made = loaded(set, progress);
  made.dataset.initialise_samples = set.initialise_samples;
  return made;
}

std::vector<BoardTarget> board_targets(const BoardSet& set, const Dataset& dataset) {
  std::vector<BoardTarget> targets;
  for (const DatasetRecord& record : dataset.records) {
    if (!is_tested(set, record)) continue;
    const Channel& target = record.recording.channel(dataset.target);
    BoardTarget& scored = targets.emplace_back();
    scored.recording = record.recording.name();
    for (std::size_t n = start_of(set, target); n < target.values.size(); ++n) {
      if (!is_measured(target, n) || !is_in(record, n, Role::test)) continue;
      scored.samples.push_back(n);
      scored.values.push_back(target.values[n]);
    }
  }
  return targets;
}

BoardScore board_score(const BoardSet& set, std::span<const BoardTarget> targets,
                       std::span<const std::vector<double>> predictions) {
  BoardScore score;
  MetricsAccumulator together;
  double mean_abs = 0.0;
  for (std::size_t k = 0; k < targets.size(); ++k) {
    MetricsAccumulator own;
    for (std::size_t n = 0; n < targets[k].values.size(); ++n) {
      const double value = predictions[k][n];
      if (std::isnan(value)) {
        ++score.without;
        continue;
      }
      own.add(value, targets[k].values[n]);
      together.add(value, targets[k].values[n]);
    }
    mean_abs += own.metrics().mad / static_cast<double>(targets.size());
  }
  score.samples = together.metrics().samples;
  score.error = set.measure == BoardMeasure::rmse ? together.metrics().rmse : mean_abs;
  return score;
}

std::string board_samples(const BoardSet& set, const Dataset& dataset, BoardPart part) {
  const bool is_test = part == BoardPart::test;
  std::string csv;
  for (const DatasetRecord& record : dataset.records) {
    const bool is_trained = record.has_role(Role::train) || set.data == "xl330";
    if (is_test ? !is_tested(set, record) : !is_trained) continue;
    const Recording& recording = record.recording;
    const std::vector<const Channel*> channels = usable_channels(set, dataset, recording, part);
    const Channel& target = recording.channel(dataset.target);
    const std::size_t start = start_of(set, target);
    if (csv.empty()) {
      csv = fmt::format("set,recording,sample,t_s,{}", is_test ? "scored_1" : "train_1");
      for (const Channel* channel : channels) csv += "," + channel->name;
      csv += "," + dataset.target + "\n";
    }
    for (std::size_t n = 0; n < recording.size(); ++n) {
      const bool is_scored = n >= start && is_measured(target, n) && is_in(record, n, Role::test);
      const bool may_use = may_use_target(set, record, n, start, part);
      fmt::format_to(std::back_inserter(csv), "{},{},{},{},{}", set.name, recording.name(), n,
                     recording.time_s(n), (is_test ? is_scored : may_use) ? 1 : 0);
      for (const Channel* channel : channels) csv += "," + cell(channel->values[n]);
      csv += "," + (may_use ? cell(target.values[n]) : std::string()) + "\n";
    }
  }
  return csv;
}

}  // namespace torsio

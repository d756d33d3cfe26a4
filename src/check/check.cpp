#include "torsio/check/check.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <mutex>
#include <numeric>
#include <set>
#include <string>
#include <thread>

#include "check/checker.hpp"
#include "fit/common/guards.hpp"
#include "fit/common/leak.hpp"
#include "numerics/parallel.hpp"
#include "numerics/reversals.hpp"
#include "torsio/data/load.hpp"
#include "torsio/fit/common/training_data.hpp"

namespace torsio {
namespace {

/// Each thread needs copies of the channels of one recording. One, where two recordings have one name: the
/// order of their findings would not be determined.
std::size_t threads_for(const Dataset& dataset) {
  constexpr std::size_t kMost = 4;
  std::set<std::string> names;
  for (const DatasetRecord& record : dataset.records) names.insert(record.recording.name());
  if (names.size() < dataset.records.size()) return 1;
  return std::clamp<std::size_t>(std::thread::hardware_concurrency(), 1, kMost);
}

}  // namespace

void Checker::for_each_record(const std::function<void(std::size_t)>& body) {
  const auto before = static_cast<std::ptrdiff_t>(findings_.size());
  for_each_chunk(pairs_.size(), threads_for(dataset_), body);
  const auto place_of = [&](const Finding& finding) {
    return std::ranges::find(dataset_.records, finding.recording,
                             [](const DatasetRecord& record) { return record.recording.name(); });
  };
  // The findings of one recording are in their order, since one thread has added them.
  std::stable_sort(findings_.begin() + before, findings_.end(),
                   [&](const Finding& a, const Finding& b) { return place_of(a) < place_of(b); });
}

std::vector<Finding> Checker::run() {
  run_checks(true);
  return std::move(findings_);
}

std::vector<Finding> Checker::run_for_failures() {
  run_checks(false);
  std::erase_if(findings_, [](const Finding& found) { return found.verdict != Verdict::fail; });
  return std::move(findings_);
}

void Checker::run_checks(bool with_warnings) {
  if (with_warnings) check_ends();
  check_length();
  if (has_failed()) return;  // too short for the other checks
  if (with_warnings) check_clock();
  check_missing();
  check_constant();
  check_coding();
  if (with_warnings)
    check_saturation();
  else
    check_hidden_torque();
  check_frozen();
  if (with_warnings) {
    check_resolution();
    check_repeats();
  }
  check_spikes();
  if (with_warnings) check_noise();
  relate();
  check_units();
  check_sign_flips();
  check_gaps(with_warnings);
  if (with_warnings) check_delay();
  check_sign();
  if (with_warnings) {
    check_change();
    check_position();
    check_columns();
    check_excitation();
  }
  check_offsets();
  check_leak();
  check_known_load();
  check_training();
  if (with_warnings) check_range();
}

void Checker::add(Verdict verdict, std::string check, std::string recording, std::string message,
                  std::string advice, std::vector<SampleRange> places) {
  const std::lock_guard lock(adding_);
  findings_.push_back({verdict, std::move(check), std::move(recording), std::move(message),
                       std::move(advice), std::move(places)});
}

/// Adds a PASS unless the check that ran meanwhile found something.
void Checker::pass_unless_found(const std::string& check, std::string message,
                                const std::function<void()>& body) {
  const std::size_t before = findings_.size();
  body();
  if (findings_.size() == before) add(Verdict::pass, check, "", std::move(message));
}

void Checker::check_ends() {
  for (const DatasetRecord& record : dataset_.records)
    if (record.recording.is_unfinished)
      add(Verdict::warn, "end", record.recording.name(), std::string(kUnfinishedText),
          "Was the recorder killed, or the copy stopped? Copy the file again if it was.");
}

void Checker::check_length() {
  pass_unless_found(
      "length",
      fmt::format("{} recordings at {:g} Hz", dataset_.records.size(), dataset_.sample_rate_Hz()),
      [&] {
        for (const DatasetRecord& record : dataset_.records)
          if (record.recording.size() < kFewSamples)
            add(Verdict::fail, "length", record.recording.name(),
                fmt::format("{} samples", record.recording.size()),
                fmt::format("Record at least {} samples.", kFewSamples));
      });
}

// Hysteresis is visible only at reversals; the effect of a constant speed looks like an offset.
void Checker::check_excitation() {
  const auto window = static_cast<std::size_t>(
      std::max(1.0, std::round(kSpeedHalfWindow_s * dataset_.sample_rate_Hz())));
  std::vector<std::size_t> reversals_of(pairs_.size(), 0);
  std::vector<std::vector<double>> speeds_of(pairs_.size());
  for_each_record([&](std::size_t r) {
    if (!dataset_.records[r].has_role(Role::train)) return;
    reversals_of[r] = count_reversals(pairs_[r].input);
    speeds_of[r] = typical_speeds(movement(pairs_[r].input, window));
  });
  const std::size_t reversals =
      std::accumulate(reversals_of.begin(), reversals_of.end(), std::size_t{0});
  Extent speeds;
  for (const std::vector<double>& of_record : speeds_of)
    for (const double speed : of_record) speeds.include(speed);
  if (speeds.width() < 0.0) return;  // nothing to train on: another check reports it
  if (reversals < kFewReversals)
    add(Verdict::warn, "excitation", "",
        fmt::format("{} reversals of {} in training", reversals, spec_.inputs.front()),
        "Hysteresis is visible only where the motion reverses: load and unload several times.");
  if (speeds.highest < kSpeedRatio * speeds.lowest)
    add(Verdict::warn, "excitation", "", "the training data move at one speed only",
        "A model cannot learn the effect of speed; add recordings that are twice as slow and twice "
        "as fast.");
  if (findings_.empty() || findings_.back().check != "excitation")
    add(Verdict::pass, "excitation", "",
        fmt::format("{} reversals, several speeds in training", reversals));
}

void Checker::check_leak() {
  const std::string leak = leak_ ? *leak_ : find_leak(dataset_, spec_);
  const std::vector<std::string> others = computed_from();
  if (leak.empty() && others.empty()) {
    add(Verdict::pass, "leak", "", "the target was not computed from an input");
  } else if (!leak.empty()) {
    add(Verdict::fail, "leak", "",
        leak.starts_with(kTruthPrefix)
            ? fmt::format("{} is a quantity of the simulation that no sensor measures", leak)
            : fmt::format("{} was computed from {}", dataset_.target, leak),
        leak_advice(dataset_, spec_, leak));
  }
  for (const std::string& channel : others)
    add(Verdict::warn, "leak", "",
        fmt::format("{} is {} times a constant, within their digits: it was not measured",
                    dataset_.target, channel),
        "A torque of a motor current contains the friction of motor and gear. Record one with a "
        "torque sensor.");
}

/// Channels besides the inputs that the target was computed from.
std::vector<std::string> Checker::computed_from() const {
  std::vector<std::string> found;
  if (dataset_.records.empty()) return found;
  const Recording& first = dataset_.records.front().recording;
  for (const Channel& channel : first.channels())
    // A force on a lever was measured as well as a torque.
    if (may_be_target(first, channel) && !channel.name.ends_with("_N") &&
        std::ranges::all_of(
            dataset_.records,
            [&](const DatasetRecord& record) { return record.recording.has(channel.name); }) &&
        is_straight_line(dataset_, channel.name))
      found.push_back(channel.name);
  return found;
}

// The guard acts on features, so features are compared; unusable recordings have failed before.
void Checker::check_range() {
  if (!data_ || !data_->test || has_failed()) return;
  const FeatureRanges trained = feature_ranges(data_->training);
  const FeatureRanges tested = feature_ranges(*data_->test);
  pass_unless_found("range", "the test data lie inside the training range", [&] {
    for (std::size_t j = 0; j < spec_.inputs.size(); ++j) {
      const double slack = trained.margin * (trained.highest[j] - trained.lowest[j]);
      if (tested.lowest[j] >= trained.lowest[j] - slack &&
          tested.highest[j] <= trained.highest[j] + slack)
        continue;
      add(Verdict::warn, "range", "",
          fmt::format("{}: tested on {:.4g} to {:.4g}, trained on {:.4g} to {:.4g}",
                      spec_.inputs[j], tested.lowest[j], tested.highest[j], trained.lowest[j],
                      trained.highest[j]),
          "Models are not valid there: estimates have the fault outside_training_range, and most "
          "models are replaced by the linear fallback.");
    }
  });
}

bool Checker::has_failed() const {
  return std::ranges::any_of(findings_, [](const Finding& finding) {
    return finding.verdict == Verdict::fail && finding.check != "sign" && finding.check != "leak";
  });
}

std::string_view name(Verdict verdict) noexcept {
  switch (verdict) {
    case Verdict::pass: return "PASS";
    case Verdict::warn: return "WARN";
    case Verdict::fail: return "FAIL";
  }
  return "unknown";
}

std::string unit_doubt(const Recording& recording, const EstimatorSettings& trained) {
  if (trained.fallback.slope.empty() || !recording.has(trained.target)) return {};
  const Pair pair{first_feature(recording, trained.features),
                  bridged(recording.channel(trained.target))};
  if (std::abs(correlation(pair.input, pair.target)) < kClearCorrelation) return {};
  return std::string(
      unit_mistake(std::abs(line_through(pair).slope / trained.fallback.slope[0]), false));
}

std::vector<Finding> check_dataset(const Dataset& dataset, const FeatureSpec& spec) {
  return Checker(dataset, spec).run();
}

FitCheck check_for_fit(const Dataset& dataset, const FeatureSpec& spec, bool allow_leak) {
  FitCheck check{.failures = {}, .leak = refuse_leak(dataset, spec, allow_leak)};
  Checker checker(dataset, spec, check.leak);
  check.failures = checker.run_for_failures();
  check.data = checker.take_data();
  return check;
}

}  // namespace torsio

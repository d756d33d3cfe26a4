#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <string>
#include <utility>
#include <vector>

#include "core/report_progress.hpp"
#include "studies.hpp"
#include "study_rows.hpp"
#include "torsio/core/units.hpp"
#include "torsio/evaluate/evaluate.hpp"
#include "torsio/files/model_file.hpp"
#include "torsio/fit/common/inputs.hpp"
#include "torsio/fit/common/load_target.hpp"
#include "torsio/fit/train_model.hpp"
#include "torsio/sim/experiments/experiment.hpp"

namespace torsio {
namespace {

constexpr const char* kTrueTorque = "truth_torque_Nm";
constexpr const char* kLoadTorque = "load_torque_Nm";
constexpr const char* kLever = "lever_m";
constexpr const char* kWrongLever = "wrong_lever_m";
constexpr std::size_t kLatencySamples = 2;  // 2 ms of the load cell, at 1 kHz
constexpr double kLengthError = 0.02;

/// Training recordings with three levers, and one for each test.
struct LoadBench {
  Dataset training;
  std::vector<std::pair<std::string, Dataset>> tests;
};

/// A way to a model without, or with, a sensor.
struct LoadCase {
  const char* name;
  std::string sheet = {};  ///< load file; empty: the sensor
  bool has_latency = false;
};

std::string sheet_text(const char* mass, const char* length, const char* more,
                       const char* uncertainty = nullptr) {
  std::string text =
      fmt::format("load: {{pendulum: {{mass: {}, length: {}}}, {}}}\n", mass, length, more);
  if (uncertainty != nullptr) text += fmt::format("load_uncertainty: {{{}}}\n", uncertainty);
  return text;
}

std::vector<LoadCase> load_cases() {
  constexpr const char* kFacts = "joint_inertia: 0.15kg_m2, zero: 0deg";
  constexpr const char* kTurned = "joint_inertia: 0.15kg_m2, zero: 0.5deg";
  return {
      {.name = "sensor"},
      {.name = "sensor, latency of 2 ms taken out", .has_latency = true},
      {.name = "known load", .sheet = sheet_text("9kg", kLever, kFacts)},
      {.name = "known load, inertia and zero fitted",
       .sheet = sheet_text("9kg", kLever, "joint_inertia: fit, zero: fit")},
      {.name = "known load, mass 1 % wrong",
       .sheet = sheet_text("9.09kg", kLever, kFacts, "mass: 1%")},
      {.name = "known load, lever 2 % wrong",
       .sheet = sheet_text("9kg", kWrongLever, kFacts, "length: 2%")},
      {.name = "known load, zero 0.5 deg wrong",
       .sheet = sheet_text("9kg", kLever, kTurned, "zero: 0.5deg")},
      {.name = "known load, these three wrong",
       .sheet = sheet_text("9.09kg", kWrongLever, kTurned, "mass: 1%, length: 2%, zero: 0.5deg")}};
}

void add_record(Dataset& dataset, const ExperimentSpec& spec, Role role) {
  Recording recording = simulate(spec);
  if (spec.lever_m) {
    recording.add_condition(kLever, *spec.lever_m);
    recording.add_condition(kWrongLever, (1.0 + kLengthError) * *spec.lever_m);
  }
  const std::size_t samples = recording.size();
  dataset.records.push_back({std::move(recording), whole_record(samples, role)});
}

LoadBench load_bench(const std::string& actuator, std::uint64_t seed) {
  const SweepProtocol protocol = sweep_protocol(data_sheet(actuator));
  LoadBench bench;
  ExperimentSpec sweep{
      .actuator = actuator, .experiment = "sweep", .seed = seed, .with_truth = true};
  for (const double lever_m : protocol.train_lever_m) {
    sweep.lever_m = lever_m;
    add_record(bench.training, sweep, Role::train);
    ++sweep.seed;
  }
  const auto test = [&](const char* name, const ExperimentSpec& spec) {
    Dataset dataset;
    dataset.target = kTrueTorque;
    add_record(dataset, spec, Role::test);
    bench.tests.emplace_back(fmt::format("{}, {}", actuator, name), std::move(dataset));
  };
  sweep.seed = seed + kFirstTestSeed;
  sweep.lever_m = protocol.test_lever_m;
  sweep.inclination_rad = protocol.test_inclination_rad;
  test("sweep, new lever, tilted", sweep);
  ExperimentSpec locked{.actuator = actuator,
                        .experiment = "chirp",
                        .seed = seed + kFirstTestSeed + 1,
                        .with_truth = true};
  test("chirp, locked", locked);
  locked.experiment = "random-walk";
  ++locked.seed;
  test("random walk, locked", locked);
  return bench;
}

/// The torque as it would be without its latency, as `latency:` of a mapping makes it.
void take_out_latency(Dataset& dataset) {
  for (DatasetRecord& record : dataset.records) {
    Recording earlier(record.recording.name(), record.recording.sample_rate_Hz());
    for (Channel channel : record.recording.channels()) {
      if (channel.name == dataset.target) {
        std::shift_left(channel.values.begin(), channel.values.end(), kLatencySamples);
        std::fill(channel.values.end() - kLatencySamples, channel.values.end(), kNotMeasured);
        std::shift_left(channel.fresh.begin(), channel.fresh.end(), kLatencySamples);
      }
      earlier.add(std::move(channel));
    }
    record.recording = std::move(earlier);
  }
}

struct TrainedCase {
  ModelFile file;
  LoadTarget load;
};

TrainedCase train_case(const LoadCase& of, const LoadBench& bench, std::uint64_t seed) {
  Dataset dataset = bench.training;
  const FeatureSpec features = resolve_inputs(dataset, {});
  if (!of.sheet.empty()) {
    dataset.target = kLoadTorque;
    add_load_target(dataset, parse_load_sheet(of.sheet, "load.yaml"), features);
  }
  if (of.has_latency) take_out_latency(dataset);
  TrainedCase trained{
      .file = train_model(dataset, {.family = "grey_box", .features = features}, seed).file,
      .load = dataset.load_target};
  return trained;
}

/// Sums over the repeats of one case on one test.
struct LoadSums {
  double rmse = 0.0;
  double std_dev = 0.0;
  double within = 0.0;
  double within_2 = 0.0;
};

std::string fitted_note(const std::string& actuator, const LoadTarget& load) {
  std::string text = actuator + ": " + load_target_notes(load).front();
  for (const LoadTarget::Fitted& fact : load.fitted)
    text +=
        fmt::format("; {} {:.3g} +- {:.2g} {}", fact.fact,
                    fact.fact == "zero" ? deg_from_rad(fact.value) : fact.value,
                    fact.fact == "zero" ? deg_from_rad(fact.standard_error) : fact.standard_error,
                    fact.fact == "zero" ? "deg" : "kg m2");
  return text;
}

void add_actuator(Study& study, QuantityTable& table, const std::string& actuator,
                  const Progress& progress) {
  std::vector<LoadCase> cases = load_cases();
  if (study.options.is_quick)  // the sensor, the load, and the load with all errors
    cases = {cases[0], cases[2], cases.back()};
  const std::size_t repeats = study.options.repeats;
  std::vector<std::vector<LoadSums>> sums;  // by test and case
  std::vector<std::string> conditions;
  for (std::size_t r = 0; r < repeats; ++r) {
    const LoadBench bench = load_bench(actuator, 1000 * study.options.seed + 100 * r);
    sums.resize(bench.tests.size(), std::vector<LoadSums>(cases.size()));
    conditions.clear();
    for (const auto& [condition, dataset] : bench.tests) conditions.push_back(condition);
    for (std::size_t c = 0; c < cases.size(); ++c) {
      report_progress(
          progress,
          static_cast<double>(r * cases.size() + c) / static_cast<double>(repeats * cases.size()),
          actuator);
      const TrainedCase trained = train_case(cases[c], bench, study.options.seed + r);
      if (r == 0 && (!trained.load.fitted.empty() || cases[c].name == std::string("known load")))
        study.notes.push_back(fitted_note(actuator, trained.load));
      for (std::size_t t = 0; t < bench.tests.size(); ++t) {
        const Score score =
            evaluate(make_estimator(trained.file), bench.tests[t].second, Role::test).together;
        sums[t][c].rmse += score.metrics.rmse / static_cast<double>(repeats);
        sums[t][c].std_dev += score.mean_std_dev / static_cast<double>(repeats);
        sums[t][c].within += 100.0 * score.within_std_dev / static_cast<double>(repeats);
        sums[t][c].within_2 += 100.0 * score.within_2_std_dev / static_cast<double>(repeats);
      }
    }
  }
  for (std::size_t t = 0; t < sums.size(); ++t)
    for (std::size_t c = 0; c < cases.size(); ++c)
      table.rows.push_back(
          {.condition = conditions[t],
           .quantity = std::string("RMSE, ") + cases[c].name,
           .value = sums[t][c].rmse,
           .unit = "Nm",
           .remark = fmt::format("error bar {:.3g} Nm, {:.0f} % within one, {:.0f} % within two",
                                 sums[t][c].std_dev, sums[t][c].within, sums[t][c].within_2)});
}

}  // namespace

Study known_load_study(const StudyOptions& options, const Progress& progress) {
  Study study{
      .protocol =
          "grey_box of sweeps with three levers of a known mass of 9 kg and 19-bit encoders, "
          "trained "
          "on the load cell, which is late and holds its values, or on the torque of the known "
          "load "
          "(docs/use/known_load.md); errors against the true torque of recordings that it was not "
          "trained on; error bars with the stated errors of the facts",
      .unit = "Nm",
      .options = options};
  QuantityTable table;
  std::vector<std::string> actuators = {"dfki-50", "dfki-120"};
  if (options.is_quick) actuators.resize(1);
  for (const std::string& actuator : actuators) {
    add_actuator(study, table, actuator, progress);
    study.plants.push_back(study_plant(actuator));
  }
  study.table = std::move(table);
  return study;
}

}  // namespace torsio

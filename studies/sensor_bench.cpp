#include "sensor_bench.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "torsio/evaluate/comparison.hpp"
#include "torsio/sim/experiments/experiment.hpp"

namespace torsio {
namespace {

constexpr const char* kSensorTwist = "input_angle_rad - joint_angle_rad";
constexpr const char* kSensorTwistRate = "lowpass(rate(input_angle_rad - joint_angle_rad), 10Hz)";

}  // namespace

void SensorBench::add_test(const Recording& from, const std::string& condition, std::size_t begin,
                           std::size_t end) {
  // Two parts of one recording have separate scores.
  Recording recording(fmt::format("{} {}", from.name(), conditions.size()), from.sample_rate_Hz(),
                      from.time_s(0));
  for (const Channel& channel : from.channels()) recording.add(channel);
  conditions.add(recording.name(), condition);
  dataset.records.push_back({std::move(recording), {{begin, end, Role::test}}});
}

Recording sensor_recording(const std::string& experiment, std::uint64_t seed) {
  return simulate(
      {.actuator = kSensorActuator, .experiment = experiment, .seed = seed, .with_truth = true});
}

SensorBench trained_on_grid(std::uint64_t seed) {
  SensorBench bench;
  Recording grid = sensor_recording("grid", seed);
  const std::size_t samples = grid.size();
  bench.dataset.records.push_back({std::move(grid), whole_record(samples, Role::train)});
  bench.dataset.initialise_samples = 0;
  return bench;
}

ModelChoice choice_of(const SensorCandidate& candidate, const SensorBench& bench) {
  std::vector<std::string> inputs{kSensorTwist};
  if (candidate.has_rate) inputs.emplace_back(kSensorTwistRate);
  return model_choices(bench.dataset, candidate.model, inputs).front();
}

std::vector<ComparedModel> compare_into(StudyRows& rows, const SensorBench& bench,
                                        const std::vector<SensorCandidate>& candidates,
                                        std::uint64_t seed, const Progress& progress) {
  std::vector<ModelChoice> choices;
  std::vector<std::pair<std::string, std::string>> models;  // name of each choice
  for (const SensorCandidate& candidate : candidates) {
    choices.push_back(choice_of(candidate, bench));
    models.emplace_back(choices.back().family, choices.back().variant());
  }
  Comparison compared = compare(bench.dataset, choices, seed, false, progress);
  rows.add(
      compared.results, bench.dataset, Role::test,
      [&](const std::string& recording) { return bench.conditions.of(recording); },
      [&](const ResultRow& row) {
        const auto found = std::ranges::find(models, std::pair(row.family, row.variant));
        return candidates[static_cast<std::size_t>(found - models.begin())].label;
      });
  return std::move(compared.models);
}

}  // namespace torsio

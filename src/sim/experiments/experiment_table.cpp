#include "sim/experiments/experiment_table.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <vector>

#include "core/did_you_mean.hpp"
#include "torsio/core/error.hpp"
#include "torsio/signal/excitation.hpp"

namespace torsio {
namespace {

std::vector<ExperimentEntry> table() {
  std::vector<ExperimentEntry> all;
  for (const auto entries :
       {series_elastic_experiments(), elastomer_experiments(), rubber_clutch_experiments(),
        harmonic_drive_experiments(), air_experiments()})
    all.insert(all.end(), entries.begin(), entries.end());
  return all;
}

const std::vector<ExperimentEntry>& entries() {
  static const std::vector<ExperimentEntry> all = table();
  return all;
}

}  // namespace

BenchProgram static_cycle_program(double amplitude_Nm, LoadCell load_cell) {
  constexpr double kCycle_Hz = 0.05;
  constexpr double kCycles = 3.0;
  return {.start = {},
          .load_cell = load_cell,
          .duration_s = kCycles / kCycle_Hz,
          .command_channels = {kGoalTorque},
          .next = [ramp = Triangle({.amplitude = amplitude_Nm, .frequency_Hz = kCycle_Hz},
                                   kBenchRate_Hz)](const Measurement&) mutable -> BenchAction {
            const double torque_Nm = ramp.step();
            return {.command = {.is_motor_held = true},
                    .load = {.external_torque_Nm = torque_Nm},
                    .commanded = {-torque_Nm}};  // as the load cell counts it
          }};
}

std::vector<ExperimentInfo> experiments() {
  std::vector<ExperimentInfo> infos(entries().size());
  std::ranges::transform(entries(), infos.begin(), &ExperimentEntry::info);
  return infos;
}

std::vector<ExperimentInfo> experiments(const DataSheet& sheet) {
  std::vector<ExperimentInfo> infos;
  for (const ExperimentEntry& entry : entries()) {
    if (entry.family == sheet.family) infos.push_back(entry.info);
  }
  return infos;
}

const ExperimentEntry& experiment_entry(std::string_view name, const DataSheet& sheet) {
  std::vector<std::string_view> known;
  for (const ExperimentEntry& entry : entries()) {
    if (entry.family != sheet.family) continue;
    if (entry.info.name == name) return entry;
    known.push_back(entry.info.name);
  }
  const std::string nearest = did_you_mean(name, known);
  throw UsageError(
      {.place = "experiment",
       .problem = fmt::format("not one of {}", sheet.name),
       .expected = fmt::format("one of {}", fmt::join(known, ", ")),
       .found = fmt::format("\"{}\"", name),
       .advice = (nearest.empty() ? "" : nearest + " ") + "torsio simulate --list shows them"});
}

}  // namespace torsio

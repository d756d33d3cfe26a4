#include "torsio/sim/experiment.hpp"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <cstddef>
#include <utility>
#include <vector>

#include "experiment_table.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/units.hpp"

namespace torsio {
namespace {

constexpr double kLongest_s = 36000.0;

void check(const ExperimentSpec& spec, const ExperimentEntry& entry) {
  const auto refuse = [&](const char* option, const std::string& expected, double found) {
    throw UsageError({.place = fmt::format("{} {}", entry.info.name, option),
                      .expected = expected,
                      .found = fmt::format("{}", found)});
  };
  if (spec.duration_s &&
      !(*spec.duration_s >= 1.0 / kBenchRate_Hz && *spec.duration_s <= kLongest_s)) {
    refuse("duration", fmt::format("{} to {} s", 1.0 / kBenchRate_Hz, kLongest_s),
           *spec.duration_s);
  }
  if (!entry.has_lever && spec.lever_m)
    refuse("lever", "none: this experiment has no lever", *spec.lever_m);
  if (!entry.has_lever && spec.inclination_rad != 0.0) {
    refuse("inclination", "none: this experiment has no lever", deg_from_rad(spec.inclination_rad));
  }
  if (spec.lever_m && !(*spec.lever_m > 0.0 && *spec.lever_m <= 2.0)) {
    refuse("lever", "0 < metres <= 2", *spec.lever_m);
  }
  if (!(std::abs(spec.inclination_rad) <= rad_from_deg(90.0))) {
    refuse("inclination", "-90 to 90 deg", deg_from_rad(spec.inclination_rad));
  }
}

/// Channels that grow by one sample a tick.
class Log {
 public:
  Log(std::size_t samples, bool with_truth) : with_truth_(with_truth) {
    for (Channel& channel : sensed_) channel.values.reserve(samples);
    for (Channel& channel : truth_) channel.values.reserve(with_truth ? samples : 0);
    fresh_.reserve(samples);
  }

  void add(const Measurement& measured, const Plant& plant) {
    append(sensed_, {measured.motor_angle_rad, measured.gear_angle_rad, measured.joint_angle_rad,
                     measured.motor_current_A, measured.torque_Nm});
    fresh_.push_back(measured.is_torque_fresh ? 1 : 0);
    if (!with_truth_) return;
    const PlantState& state = plant.state();
    const PlantTorques& torques = plant.torques();
    append(truth_, {torques.joint_Nm, torques.spring_Nm, plant.spring().friction_torque(),
                    torques.gear_Nm, torques.motor_Nm, torques.motor_friction_Nm,
                    state.gear_angle_rad - state.joint_angle_rad, state.rotor_speed_rad_s,
                    state.joint_speed_rad_s});
  }

  [[nodiscard]] Recording finish(std::string name) {
    Recording recording(std::move(name), kBenchRate_Hz);
    sensed_.back().fresh = std::move(fresh_);
    for (Channel& channel : sensed_) recording.add(std::move(channel));
    if (with_truth_) {
      for (Channel& channel : truth_) recording.add(std::move(channel));
    }
    return recording;
  }

 private:
  template <std::size_t Count>
  static void append(std::array<Channel, Count>& channels,
                     const std::array<double, Count>& values) {
    for (std::size_t i = 0; i < Count; ++i) channels[i].values.push_back(values[i]);
  }

  bool with_truth_;
  std::array<Channel, 5> sensed_ = {Channel{"motor_angle_rad", {}}, Channel{"gear_angle_rad", {}},
                                    Channel{"joint_angle_rad", {}}, Channel{"motor_current_A", {}},
                                    Channel{"torque_Nm", {}}};
  std::array<Channel, 9> truth_ = {Channel{"truth_torque_Nm", {}},
                                   Channel{"truth_spring_torque_Nm", {}},
                                   Channel{"truth_spring_friction_Nm", {}},
                                   Channel{"truth_gear_torque_Nm", {}},
                                   Channel{"truth_motor_torque_Nm", {}},
                                   Channel{"truth_motor_friction_Nm", {}},
                                   Channel{"truth_spring_deflection_rad", {}},
                                   Channel{"truth_motor_speed_rad_s", {}},
                                   Channel{"truth_joint_speed_rad_s", {}}};
  std::vector<std::uint8_t> fresh_;
};

}  // namespace

Recording simulate(const ExperimentSpec& spec, const Progress& progress) {
  const DataSheet& sheet = data_sheet(spec.actuator);
  const ExperimentEntry& entry = experiment_entry(spec.experiment);
  check(spec, entry);
  BenchProgram program = entry.program(sheet, spec);
  Plant plant(plant_parameters(sheet), kSimulationStep_s);
  plant.reset(0.0, program.start);
  SensorSet sensors(sheet, kBenchRate_Hz, spec.seed);
  sensors.reset(plant);

  const double duration_s = spec.duration_s.value_or(program.duration_s);
  const auto samples = static_cast<std::size_t>(std::lround(duration_s * kBenchRate_Hz));
  Log log(samples, spec.with_truth);
  for (std::size_t i = 0; i < samples; ++i) {
    if (i % 1000 == 0) {
      report_progress(progress, static_cast<double>(i) / static_cast<double>(samples),
                      "simulating");
    }
    const Measurement measured = sensors.step(plant);
    log.add(measured, plant);
    const BenchAction action = program.next(measured);
    const Fault fault = plant.step(action.command, action.load, 1.0 / kBenchRate_Hz);
    if (fault != Fault::none)
      throw Error({.place = fmt::format("{} at {} s", entry.info.name,
                                        static_cast<double>(i) / kBenchRate_Hz),
                   .problem = fmt::format("the plant refuses its command or load: {}",
                                          torsio::name(fault))});
  }
  return log.finish(fmt::format("{} {} seed {}", sheet.name, entry.info.name, spec.seed));
}

}  // namespace torsio

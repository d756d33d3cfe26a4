#include "bench_log.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <utility>

#include "experiment_table.hpp"
#include "torsio/core/error.hpp"

namespace torsio {
namespace {

struct StageNames {
  std::string_view first;
  std::string_view second;
};

StageNames stage_names(ActuatorFamily family) {
  switch (family) {
    case ActuatorFamily::series_elastic: break;
    case ActuatorFamily::elastomer: return {"gear", "coupling"};
    case ActuatorFamily::rubber_clutch: return {"clutch", "rubber"};
    case ActuatorFamily::harmonic_drive: return {"tube", "gear"};
  }
  return {"gear", "spring"};
}

/// @throws Error if the bench does not come to a whole number of ticks a sample.
std::size_t whole_ticks_a_sample(double rate_Hz) {
  const double ticks = std::round(kBenchRate_Hz / rate_Hz);
  if (ticks >= 1.0 && std::abs(ticks * rate_Hz - kBenchRate_Hz) < 1e-6 * kBenchRate_Hz)
    return static_cast<std::size_t>(ticks);
  throw Error({.place = "data sheet: log_rate_Hz",
               .expected = fmt::format("{} Hz divided by a whole number", kBenchRate_Hz),
               .found = fmt::format("{} Hz", rate_Hz)});
}

}  // namespace

BenchLog::BenchLog(const DataSheet& sheet, std::size_t ticks, bool with_truth)
    : rate_Hz_(sheet.sensors.log_rate_Hz.value), ticks_a_sample_(whole_ticks_a_sample(rate_Hz_)) {
  const std::size_t samples = ticks / ticks_a_sample_ + 1;
  for (const SensedChannel& source : sensed_channels(sheet)) {
    Sensed& of = sensed_.emplace_back(
        Sensed{.source = source, .channel = {.name = std::string(source.name), .values = {}}});
    of.channel.values.reserve(samples);
    of.channel.fresh.reserve(samples);
  }
  if (with_truth) add_truth_channels(sheet);
  for (Truth& of : truth_) of.channel.values.reserve(samples);
}

void BenchLog::tell(std::string_view name, double (*value)(const Plant& plant)) {
  truth_.push_back({{fmt::format("{}{}", kTruthPrefix, name), {}}, value});
}

void BenchLog::add_truth_channels(const DataSheet& sheet) {
  const StageNames names = stage_names(sheet.family);
  const auto first = [&](const char* what) { return fmt::format("{}_{}", names.first, what); };
  const auto second = [&](const char* what) { return fmt::format("{}_{}", names.second, what); };
  tell(second("torque_Nm"), [](const Plant& plant) { return plant.torques().second_Nm; });
  tell(second("friction_Nm"), [](const Plant& plant) { return plant.second_friction_torque(); });
  tell(second("deflection_rad"), [](const Plant& plant) { return plant.second_twist(); });
  tell(first("torque_Nm"), [](const Plant& plant) { return plant.torques().first_Nm; });
  tell(first("friction_Nm"), [](const Plant& plant) { return plant.first_friction_torque(); });
  tell(first("deflection_rad"), [](const Plant& plant) { return plant.first_twist(); });
  tell("motor_torque_Nm", [](const Plant& plant) { return plant.torques().motor_Nm; });
  tell("motor_friction_Nm", [](const Plant& plant) { return plant.torques().rotor_friction_Nm; });
  if (sheet.family == ActuatorFamily::harmonic_drive) {
    tell("wave_generator_friction_Nm",
         [](const Plant& plant) { return plant.torques().middle_friction_Nm; });
  }
  tell("motor_speed_rad_s", [](const Plant& plant) { return plant.state().rotor_speed_rad_s; });
  tell("joint_speed_rad_s", [](const Plant& plant) { return plant.state().joint_speed_rad_s; });
}

void BenchLog::add(const Measurement& measured, const Plant& plant, double torque_Nm) {
  for (Sensed& of : sensed_) of.is_fresh = of.is_fresh || measured.*of.source.is_fresh;
  if (tick_++ % ticks_a_sample_ != 0) return;
  for (Sensed& of : sensed_) {
    of.channel.values.push_back(of.source.scale * measured.*of.source.value);
    of.channel.fresh.push_back(of.is_fresh ? 1 : 0);
    of.is_fresh = false;
  }
  if (truth_.empty()) return;
  truth_torque_Nm_.push_back(torque_Nm);
  for (Truth& of : truth_) of.channel.values.push_back(of.value(plant));
}

Recording BenchLog::finish(std::string name) {
  Recording recording(std::move(name), rate_Hz_);
  const std::string_view load_cell = sensed_.back().source.name;
  for (Sensed& of : sensed_) {
    std::vector<std::uint8_t>& fresh = of.channel.fresh;
    const bool is_always_fresh = std::ranges::find(fresh, 0) == fresh.end();
    if (is_always_fresh && of.source.name != load_cell) fresh.clear();
    recording.add(std::move(of.channel));
  }
  if (!truth_.empty()) recording.add({"truth_torque_Nm", std::move(truth_torque_Nm_)});
  for (Truth& of : truth_) recording.add(std::move(of.channel));
  return recording;
}

}  // namespace torsio

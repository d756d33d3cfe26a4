#include "duty_bench.hpp"

#include <utility>

#include "sim/experiments/experiment_table.hpp"
#include "torsio/core/error.hpp"

namespace torsio {
namespace {

constexpr double kTick_s = 1.0 / kBenchRate_Hz;

/// Seeds that differ in one bit give unrelated streams; work, sensors and drive have one each.
struct Seeds {
  explicit Seeds(std::uint64_t seed) {
    Random random(seed);
    duty = random.bits();
    sensors = random.bits();
    drive = random.bits();
  }
  std::uint64_t duty = 0;
  std::uint64_t sensors = 0;
  std::uint64_t drive = 0;
};

std::vector<DataSheet> sheets_of(const std::vector<DutyLane>& lanes) {
  std::vector<DataSheet> sheets;
  sheets.reserve(lanes.size());
  for (const DutyLane& lane : lanes) sheets.push_back(lane.sheet);
  return sheets;
}

std::vector<std::uint64_t> drive_seeds(const std::vector<DutyLane>& lanes, bool is_electrical) {
  std::vector<std::uint64_t> seeds;
  if (!is_electrical) return seeds;
  for (const DutyLane& lane : lanes) seeds.push_back(Seeds(lane.seed).drive);
  return seeds;
}

}  // namespace

std::uint64_t duty_seed(std::uint64_t seed) { return Seeds(seed).duty; }

DataSheet with_duty_bench(DataSheet sheet) {
  sheet.sensors.torque_rate_Hz = assumed(kBenchRate_Hz);
  sheet.sensors.torque_latency_s = assumed(0.0);
  sheet.sensors.log_rate_Hz = assumed(kBenchRate_Hz);
  return sheet;
}

DutyBench::Lane::Lane(const DutyLane& from, double run_s)
    : sensors(with_duty_bench(from.sheet), kBenchRate_Hz, Seeds(from.seed).sensors),
      duty(from.sheet, from.settings, Seeds(from.seed).duty),
      loop(plant_parameters(from.sheet), kBenchRate_Hz, duty_limits(from.sheet).bandwidth_rad_s),
      faults(from.faults, from.sheet, run_s),
      has_faults(!from.faults.faults.empty()),
      is_loop_sound(from.is_loop_sound) {}

DutyBench::DutyBench(const std::vector<DutyLane>& lanes, const Options& options)
    : plants_(sheets_of(lanes), drive_seeds(lanes, options.is_electrical), options.is_single,
              options.has_brakes),
      commands_(lanes.size()),
      loads_(lanes.size()) {
  lanes_.reserve(lanes.size());
  for (const DutyLane& from : lanes) {
    Lane& lane = lanes_.emplace_back(from, std::numeric_limits<double>::infinity());
    const Fault fault = plants_.reset(lanes_.size() - 1, lane.duty.wanted_rad(), lane.duty.load());
    if (fault != Fault::none)
      throw Error({.place = from.sheet.name + " at work",
                   .problem = "the plant refuses its start: " + std::string(name(fault))});
    lane.duty.start_at(plants_.sensed(lanes_.size() - 1).state.rotor_angle_rad /
                       total_ratio(plant_parameters(from.sheet)));
    lane.sensors.reset(plants_.torques(lanes_.size() - 1).joint_Nm);
    if (!options.has_brakes) continue;
    plants_.set_brake(lanes_.size() - 1, /*is_closed=*/false);
    lane.brake_V = brake_parameters(from.sheet).activation_V;
  }
}

double DutyBench::time_s() const noexcept { return static_cast<double>(tick_) / kBenchRate_Hz; }

void DutyBench::sense() noexcept {
  for (std::size_t i = 0; i < lanes_.size(); ++i) {
    Lane& lane = lanes_[i];
    lane.torque_Nm = plants_.torques(i).joint_Nm;
    lane.sound = lane.sensors.step(plants_.sensed(i), lane.torque_Nm);
    lane.measured = lane.sound;
    if (lane.has_faults) lane.faults.apply(lane.measured, time_s());
  }
}

void DutyBench::act() {
  for (std::size_t i = 0; i < lanes_.size(); ++i) {
    Lane& lane = lanes_[i];
    lane.duty.step();
    loads_[i] = lane.duty.load();
    const Measurement& seen = lane.is_loop_sound ? lane.sound : lane.measured;
    const double current_A = lane.loop.step(lane.duty.wanted_rad(), seen.motor_angle_rad);
    commands_[i].current_A = lane.is_cut ? 0.0 : current_A;
    commands_[i].is_powered = !(lane.is_cut && lane.brake_V > 0.0);
    commands_[i].brake_V = lane.is_cut ? 0.0 : lane.brake_V;
    if (!lane.has_faults && !lane.duty.is_condition_new()) continue;
    lane.condition =
        lane.faults.condition(time_s(), {.friction_factor = lane.duty.friction_factor()});
    static_cast<void>(plants_.set_condition(i, lane.condition));
  }
  static_cast<void>(plants_.step(commands_, loads_, kTick_s));
  ++tick_;
}

}  // namespace torsio

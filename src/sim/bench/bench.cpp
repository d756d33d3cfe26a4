#include "sim/bench/bench.hpp"

#include <fmt/format.h>

#include "torsio/core/error.hpp"

namespace torsio {

Bench::Bench(const DataSheet& sheet, const BenchRun& run, const BenchProgram& start)
    : name_(run.name),
      conditions_(run.conditions),
      faults_(run.faults, sheet, run.duration_s),
      changes_(run.conditions.warm_up_K != 0.0 || !run.faults.faults.empty()),
      load_cell_(start.load_cell),
      plant_(plant_parameters(sheet)),
      sensors_(sheet, kBenchRate_Hz, run.seed),
      load_(start.start) {
  if (run.is_electrical) plant_.use(electrical_parameters(sheet, run.seed));
  require_taken(plant_.reset(start.start_angle_rad, load_));
  require_taken(plant_.set_condition(condition()));
  sensors_.reset(load_cell_torque());
}

PlantCondition Bench::condition() const noexcept {
  return faults_.condition(
      time_s(), {.friction_factor = friction_factor(temperature(conditions_, time_s()))});
}

double Bench::load_cell_torque() const {
  switch (load_cell_) {
    case LoadCell::external: return -load_.external_torque_Nm;
    case LoadCell::wall: return plant_.torques().wall_Nm;
    case LoadCell::joint: break;
  }
  return plant_.torques().joint_Nm;
}

void Bench::require_taken(Fault fault) const {
  if (fault == Fault::none) return;
  throw Error({.place = fmt::format("{} at {} s", name_, time_s()),
               .problem = fmt::format("the plant refuses its command, load or condition: {}",
                                      torsio::name(fault))});
}

Measurement Bench::sense() {
  torque_Nm_ = load_cell_torque();
  sound_ = sensors_.step(sensed(plant_), torque_Nm_);
  Measurement measured = sound_;
  faults_.apply(measured, time_s());
  return measured;
}

BenchTruth Bench::truth() const { return {plant_, torque_Nm_, temperature(conditions_, time_s())}; }

void Bench::act(const BenchAction& action) {
  load_ = action.load;
  if (changes_) require_taken(plant_.set_condition(condition()));
  require_taken(plant_.step(action.command, load_, 1.0 / kBenchRate_Hz));
  ++tick_;
}

}  // namespace torsio

#include "fleet/production_fault.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>
#include <vector>

#include "actuator/stage_wear.hpp"
#include "core/fnv_hash.hpp"
#include "torsio/core/random.hpp"
#include "torsio/core/units.hpp"
#include "torsio/sim/experiments/experiment.hpp"

namespace torsio {
namespace {

constexpr std::array<ProductionFault, 6> kProductionFaults{
    ProductionFault::soft_spring,   ProductionFault::rough_spring,    ProductionFault::shifted_zero,
    ProductionFault::encoder_error, ProductionFault::loose_load_cell, ProductionFault::hard_spring};

constexpr double kStiffnessOff = 0.08;
constexpr double kFrictionTimes = 1.5;
constexpr double kZero_rad = rad_from_deg(0.3);
constexpr double kEncoderError_rad = rad_from_deg(0.05);
constexpr double kEncoderPeriods = 8.0;
constexpr double kLooseShare = 0.01;
constexpr double kTrainingWalk_s = 15.0;
constexpr double kSweep_s = 20.0;
constexpr double kTestWalk_s = 8.0;
constexpr const char* kEncoder = "gear_angle_rad";
constexpr const char* kTorque = "torque_Nm";

DataSheet faulty(const DataSheet& sheet, std::optional<ProductionFault> fault) {
  StageWear wear;
  if (fault == ProductionFault::soft_spring) wear.stiffness = 1.0 - kStiffnessOff;
  if (fault == ProductionFault::hard_spring) wear.stiffness = 1.0 + kStiffnessOff;
  if (fault == ProductionFault::rough_spring) wear.friction = kFrictionTimes;
  return worn(sheet, wear);
}

/// The zero of a loose load cell over the samples: another one after each change of the load's sign.
void loosen(std::vector<double>& torque_Nm, double range_Nm, Random& random) {
  const double max_zero_Nm = kLooseShare * range_Nm;
  const double dead_band_Nm = 0.5 * max_zero_Nm;
  double sign = 0.0;
  double zero_Nm = 0.0;
  for (double& value_Nm : torque_Nm) {
    if (std::isfinite(value_Nm) && std::abs(value_Nm) > dead_band_Nm &&
        std::copysign(1.0, value_Nm) != sign) {
      sign = std::copysign(1.0, value_Nm);
      zero_Nm = random.uniform(-max_zero_Nm, max_zero_Nm);
    }
    value_Nm += zero_Nm;
  }
}

Recording measured(const Recording& before, const DataSheet& sheet,
                   std::optional<ProductionFault> fault, Random& random) {
  Recording after(before.name(), before.sample_rate_Hz(), before.time_s(0));
  for (Channel channel : before.channels()) {
    if (channel.name == kEncoder)
      for (double& angle_rad : channel.values) {
        if (fault == ProductionFault::shifted_zero) angle_rad += kZero_rad;
        if (fault == ProductionFault::encoder_error)
          angle_rad += kEncoderError_rad * std::sin(kEncoderPeriods * angle_rad);
      }
    if (channel.name == kTorque && fault == ProductionFault::loose_load_cell)
      loosen(channel.values, sheet.sensors.torque_range_Nm.value, random);
    after.add(std::move(channel));
  }
  after.definitions = before.definitions;
  return after;
}

}  // namespace

std::string_view name(ProductionFault fault) noexcept {
  switch (fault) {
    case ProductionFault::soft_spring: return "stiffness -8 %";
    case ProductionFault::hard_spring: return "stiffness +8 %";
    case ProductionFault::rough_spring: return "friction x 1.5";
    case ProductionFault::shifted_zero: return "zero 0.3 deg";
    case ProductionFault::encoder_error: return "encoder error 0.05 deg";
    case ProductionFault::loose_load_cell: break;
  }
  return "loose load cell";
}

JointTrait trait_of(ProductionFault fault) noexcept {
  switch (fault) {
    case ProductionFault::soft_spring:
    case ProductionFault::hard_spring: return JointTrait::stiffness;
    case ProductionFault::rough_spring: return JointTrait::friction;
    case ProductionFault::shifted_zero: return JointTrait::zero;
    case ProductionFault::encoder_error: return JointTrait::encoder_error;
    case ProductionFault::loose_load_cell: break;
  }
  return JointTrait::loose_sensor;
}

std::map<std::uint64_t, ProductionFault> planted_faults(const SimulatedFleet& fleet,
                                                        std::uint64_t seed) {
  // The joints with the lowest hashes have the faults.
  std::vector<std::pair<std::uint64_t, std::uint64_t>> order;
  order.reserve(fleet.last + 1 - fleet.first);
  for (std::uint64_t each = fleet.first; each <= fleet.last; ++each)
    order.emplace_back(Random(text_hash(fmt::format("production fault {} {}", seed, each))).bits(),
                       each);
  const std::size_t count = std::min(fleet.faults, order.size());
  std::ranges::partial_sort(order, order.begin() + static_cast<std::ptrdiff_t>(count));
  std::map<std::uint64_t, ProductionFault> faults;
  for (std::size_t k = 0; k < count; ++k)
    faults[order[k].second] = kProductionFaults.at(k % kProductionFaults.size());
  return faults;
}

Dataset production_recordings(const std::string& specimen, std::optional<ProductionFault> fault,
                              std::uint64_t seed, const Progress& progress) {
  const DataSheet sheet = data_sheet(specimen);
  const DataSheet built = faulty(sheet, fault);
  Random random(text_hash(fmt::format("production {} {}", seed, specimen)));
  Dataset dataset;
  const auto record = [&](ExperimentSpec spec, double duration_s, Role role) {
    spec.seed = random.bits();
    spec.duration_s = duration_s;
    Recording recording = measured(simulate(built, spec, progress), sheet, fault, random);
    const std::size_t samples = recording.size();
    dataset.records.push_back({std::move(recording), whole_record(samples, role)});
  };
  // The noise loads the spring over its range, in both directions; the sweep moves the joint by half a turn.
  record({.experiment = "random-walk"}, kTrainingWalk_s, Role::train);
  record({.experiment = "sweep", .lever_m = sweep_protocol(sheet).train_lever_m[2]}, kSweep_s,
         Role::train);
  record({.experiment = "random-walk"}, kTestWalk_s, Role::test);
  return dataset;
}

}  // namespace torsio

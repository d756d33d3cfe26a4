#include "duty_plants.hpp"

#include <algorithm>

namespace torsio {
namespace {

std::vector<PlantParameters> parameters_of(std::span<const DataSheet> sheets) {
  std::vector<PlantParameters> parameters;
  for (const DataSheet& sheet : sheets) parameters.push_back(plant_parameters(sheet));
  return parameters;
}

bool has_table(const DataSheet& sheet) {
  const auto* const spring = std::get_if<SpringSheet>(&sheet.second);
  return spring != nullptr && !spring->curve.empty();
}

std::vector<Plant> single_plants(std::span<const DataSheet> sheets,
                                 std::span<const std::uint64_t> drive_seeds, bool has_brakes) {
  std::vector<Plant> plants;
  for (std::size_t lane = 0; lane < sheets.size(); ++lane) {
    const PlantParameters parameters = plant_parameters(sheets[lane]);
    if (has_brakes) {
      plants.emplace_back(parameters, braked_step_s(parameters));
      plants.back().use(brake_parameters(sheets[lane]));
    } else {
      plants.emplace_back(parameters);
    }
    if (!drive_seeds.empty())
      plants.back().use(electrical_parameters(sheets[lane], drive_seeds[lane]));
  }
  return plants;
}

}  // namespace

double braked_step_s(const PlantParameters& parameters) {
  return 0.25 * std::min(Plant::step_limit(parameters), Plant::kDefaultStep_s);
}

DutyPlants::DutyPlants(std::span<const DataSheet> sheets,
                       std::span<const std::uint64_t> drive_seeds, bool is_single,
                       bool has_brakes) {
  is_single = is_single || has_brakes || !drive_seeds.empty();
  for (const DataSheet& sheet : sheets) is_single = is_single || has_table(sheet);
  if (is_single) {
    plants_ = single_plants(sheets, drive_seeds, has_brakes);
  } else {
    plants_ = PlantBatch(parameters_of(sheets));
  }
}

Fault DutyPlants::reset(std::size_t lane, double joint_angle_rad, const Load& load) noexcept {
  if (auto* const batch = std::get_if<PlantBatch>(&plants_))
    return batch->reset(lane, joint_angle_rad, load);
  return (*std::get_if<0>(&plants_))[lane].reset(joint_angle_rad, load);
}

Fault DutyPlants::set_condition(std::size_t lane, const PlantCondition& condition) noexcept {
  if (auto* const batch = std::get_if<PlantBatch>(&plants_))
    return batch->set_condition(lane, condition);
  return (*std::get_if<0>(&plants_))[lane].set_condition(condition);
}

void DutyPlants::set_brake(std::size_t lane, bool is_closed) noexcept {
  if (auto* const plants = std::get_if<0>(&plants_)) (*plants)[lane].set_brake(is_closed);
}

Fault DutyPlants::step(std::span<const PlantCommand> commands, std::span<const Load> loads,
                       double dt_s) noexcept {
  if (auto* const batch = std::get_if<PlantBatch>(&plants_))
    return batch->step(commands, loads, dt_s);
  Fault worst = Fault::none;
  std::vector<Plant>& plants = *std::get_if<0>(&plants_);
  for (std::size_t lane = 0; lane < plants.size(); ++lane) {
    const Fault fault = plants[lane].step(commands[lane], loads[lane], dt_s);
    if (fault != Fault::none) worst = fault;
  }
  return worst;
}

SensedPlant DutyPlants::sensed(std::size_t lane) const noexcept {
  if (const auto* const batch = std::get_if<PlantBatch>(&plants_))
    return {.state = batch->state(lane),
            .second_twist_rad = batch->second_twist(lane),
            .current_A = batch->current(lane)};
  return torsio::sensed((*std::get_if<0>(&plants_))[lane]);
}

PlantTorques DutyPlants::torques(std::size_t lane) const noexcept {
  if (const auto* const batch = std::get_if<PlantBatch>(&plants_)) return batch->torques(lane);
  return (*std::get_if<0>(&plants_))[lane].torques();
}

const Plant* DutyPlants::single(std::size_t lane) const noexcept {
  if (const auto* const plants = std::get_if<0>(&plants_)) return &(*plants)[lane];
  return nullptr;
}

}  // namespace torsio

#include "sim/plant/plant_batch.hpp"

#include <algorithm>

#include "plant_input.hpp"
#include "plant_lanes.hpp"
#include "torsio/core/error.hpp"

namespace torsio {
namespace {

double shared_step(std::span<const PlantParameters> parameters) {
  double step_s = Plant::kDefaultStep_s;
  for (const PlantParameters& of : parameters) step_s = std::min(step_s, Plant::step_limit(of));
  return step_s;
}

}  // namespace

PlantBatch::PlantBatch(std::span<const PlantParameters> parameters, double longest_step_s)
    : longest_step_s_(longest_step_s == 0.0 ? shared_step(parameters) : longest_step_s),
      lanes_(std::make_unique<PlantLanes>(parameters)),
      faults_(parameters.size(), Fault::none) {
  plants_.reserve(parameters.size());
  for (const PlantParameters& of : parameters) plants_.emplace_back(of, longest_step_s_);
  for (std::size_t lane = 0; lane < lanes_->padded_size(); ++lane) {
    lanes_->set_parts(lane, plants_[std::min(lane, size() - 1)]);
    lanes_->start(lane, plants_[std::min(lane, size() - 1)]);
    lanes_->set_condition(lane, {});
  }
}

PlantBatch::PlantBatch(PlantBatch&& other) noexcept = default;
PlantBatch& PlantBatch::operator=(PlantBatch&& other) noexcept = default;
PlantBatch::~PlantBatch() = default;

Fault PlantBatch::reset(double joint_angle_rad, const Load& load) noexcept {
  Fault worst = Fault::none;
  for (std::size_t i = 0; i < size(); ++i) {
    const Fault fault = reset(i, joint_angle_rad, load);
    if (fault != Fault::none) worst = fault;
  }
  return worst;
}

Fault PlantBatch::reset(std::size_t plant, double joint_angle_rad, const Load& load) noexcept {
  const Fault fault = plants_[plant].reset(joint_angle_rad, load);
  if (fault == Fault::none) lanes_->start(plant, plants_[plant]);
  return fault;
}

Fault PlantBatch::reset(std::size_t plant, const PlantState& state) noexcept {
  const Fault fault = plants_[plant].reset(state);
  if (fault == Fault::none) lanes_->start(plant, plants_[plant]);
  return fault;
}

Fault PlantBatch::set_condition(std::size_t plant, const PlantCondition& condition) noexcept {
  const Fault fault = plants_[plant].set_condition(condition);
  if (fault == Fault::none) lanes_->set_condition(plant, condition);
  return fault;
}

Fault PlantBatch::step(std::span<const PlantCommand> commands, std::span<const Load> loads,
                       double dt_s) noexcept {
  if (commands.size() != size() || loads.size() != size()) return Fault::input_count_wrong;
  if (!is_usable(dt_s, longest_step_s_)) {
    std::ranges::fill(faults_, Fault::input_not_finite);
    return Fault::input_not_finite;
  }
  const std::size_t steps = small_steps(dt_s, longest_step_s_);
  const double small_dt_s = dt_s / static_cast<double>(steps);
  if (dt_s != asked_dt_s_) {
    asked_dt_s_ = dt_s;
    for (std::size_t lane = 0; lane < lanes_->padded_size(); ++lane)
      lanes_->set_period(lane, plants_[std::min(lane, size() - 1)], small_dt_s);
  }
  if (lanes_->step(commands, loads, steps, small_dt_s, faults_)) return Fault::none;
  Fault worst = Fault::model_not_finite;
  for (std::size_t i = 0; i < size(); ++i) {
    if (faults_[i] == Fault::model_not_finite) reset(i, 0.0, {});
    if (faults_[i] == Fault::input_not_finite) worst = Fault::input_not_finite;
  }
  return worst;
}

PlantState PlantBatch::state(std::size_t plant) const noexcept { return lanes_->state(plant); }
PlantTorques PlantBatch::torques(std::size_t plant) const noexcept {
  return lanes_->torques(plant);
}
double PlantBatch::current(std::size_t plant) const noexcept { return lanes_->current(plant); }
double PlantBatch::second_twist(std::size_t plant) const noexcept {
  return lanes_->second_twist(plant);
}

}  // namespace torsio

#include "torsio/sim/plant_batch.hpp"

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

void PlantBatch::reset(double joint_angle_rad, const Load& load) noexcept {
  for (std::size_t i = 0; i < size(); ++i) reset(i, joint_angle_rad, load);
}

void PlantBatch::reset(std::size_t plant, double joint_angle_rad, const Load& load) noexcept {
  plants_[plant].reset(joint_angle_rad, load);
  lanes_->start(plant, plants_[plant]);
}

void PlantBatch::reset(std::size_t plant, const PlantState& state) noexcept {
  plants_[plant].reset(state);
  lanes_->start(plant, plants_[plant]);
}

void PlantBatch::set_condition(std::size_t plant, const PlantCondition& condition) noexcept {
  lanes_->set_condition(plant, condition);
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
  return lanes_->step(commands, loads, steps, small_dt_s, faults_) ? Fault::none
                                                                   : Fault::input_not_finite;
}

PlantState PlantBatch::state(std::size_t plant) const noexcept { return lanes_->state(plant); }
PlantTorques PlantBatch::torques(std::size_t plant) const noexcept {
  return lanes_->torques(plant);
}
double PlantBatch::current(std::size_t plant) const noexcept { return lanes_->current(plant); }

}  // namespace torsio

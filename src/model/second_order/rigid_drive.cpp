#include "model/second_order/rigid_drive.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/all_finite.hpp"
#include "model/second_order/bounded_motion.hpp"
#include "model/second_order/check_dynamics.hpp"
#include "parts/bristle.hpp"

namespace torsio {
namespace {

std::vector<double> middles(std::size_t substeps) {
  std::vector<double> places;
  for (std::size_t i = 0; i < substeps; ++i)
    places.push_back((static_cast<double>(i) + 0.5) / static_cast<double>(substeps));
  return places;
}

double bristle_stiffness(const RigidDrive::Parameters& p) {
  return p.bristle > 0.0 ? p.static_ratio * p.coulomb / p.bristle : 0.0;
}

void check_signs(const RigidDrive::Parameters& p) {
  const auto require_finite = [&](bool holds, const char* field, const char* expected,
                                  double found) {
    require(holds && std::isfinite(found), {RigidDrive::kFamily, field}, expected, found);
  };
  require_finite(p.inertia > 0.0, "inertia", "a positive number", p.inertia);
  require_finite(p.viscous >= 0.0, "viscous", "a number not below 0", p.viscous);
  require_finite(p.coulomb >= 0.0, "coulomb", "a number not below 0", p.coulomb);
  require_finite(true, "offset", "a number", p.offset);
  require_finite(p.static_ratio >= 1.0, "static_ratio", "a number not below 1", p.static_ratio);
  require_finite(p.stribeck_speed > 0.0, "stribeck_speed", "a positive number", p.stribeck_speed);
  require_finite(p.bristle >= 0.0, "bristle", "a number not below 0", p.bristle);
  require_finite(std::abs(p.viscous_asymmetry) <= p.viscous, "viscous_asymmetry",
                 "a number no larger than viscous", p.viscous_asymmetry);
  require_finite(p.viscous_quadratic >= 0.0, "viscous_quadratic", "a number not below 0",
                 p.viscous_quadratic);
  require_finite(true, "spring", "a number", p.spring);
  require_finite(true, "coulomb_slope", "a number", p.coulomb_slope);
  const VariableFriction variable = p.variable_friction.value_or(VariableFriction{});
  require_finite(variable.load_share >= 0.0 && variable.load_share < 1.0, "load_share",
                 "a number from 0 to less than 1", variable.load_share);
  require_finite(variable.dwell_gain >= 0.0, "dwell_gain", "a number not below 0",
                 variable.dwell_gain);
  require_finite(variable.dwell_time_s > 0.0, "dwell_time_s", "a positive number",
                 variable.dwell_time_s);
  require_finite(variable.heating >= 0.0, "heating", "a number not below 0", variable.heating);
  require_finite(variable.heating_time_s > 0.0, "heating_time_s", "a positive number",
                 variable.heating_time_s);
}

const RigidDrive::Parameters& checked(const RigidDrive::Parameters& p) {
  check_signs(p);
  check_gains(p.gains, RigidDrive::kFamily);
  check_sampled_time(p.time, RigidDrive::kFamily);
  check_end_stops(p.lowest, p.highest, RigidDrive::kFamily);
  constexpr double kStable = 2.0;  // limit of the leapfrog
  const double turn = std::sqrt((std::max(p.spring, 0.0) + bristle_stiffness(p)) / p.inertia) *
                      p.time.sample_period_s / static_cast<double>(p.time.substeps);
  require(turn < kStable, {RigidDrive::kFamily, "substeps"},
          "sub-steps of less than 2 over the fastest rate", turn);
  return p;
}

}  // namespace

RigidDrive::RigidDrive(const Parameters& parameters)
    : parameters_(checked(parameters)),
      substep_s_(parameters.time.sample_period_s / static_cast<double>(parameters.time.substeps)),
      input_(parameters.time.input_order, middles(parameters.time.substeps)),
      stribeck_(parameters.static_ratio, parameters.stribeck_speed),
      bristle_stiffness_(bristle_stiffness(parameters)),
      variable_(parameters.variable_friction.value_or(VariableFriction{})),
      kept_heat_(std::exp(-substep_s_ / variable_.heating_time_s)) {}

std::size_t RigidDrive::parameter_count() const noexcept {
  const Parameters& p = parameters_;
  std::size_t count = 3 + input_count();
  if (p.static_ratio > 1.0) count += 2;
  for (const double term :
       {p.bristle, p.viscous_asymmetry, p.viscous_quadratic, p.spring, p.coulomb_slope})
    if (term != 0.0) ++count;
  if (variable_.load_share > 0.0) ++count;
  if (variable_.dwell_gain > 0.0) count += 2;
  if (variable_.heating > 0.0) count += 2;
  return count;
}

void RigidDrive::reset() noexcept {
  input_.reset();
  state_ = {};
  friction_factor_ = 1.0;
}

void RigidDrive::set_state(std::span<const double> state) noexcept {
  for (std::size_t i = 0; i < state_.size() && i < state.size(); ++i)
    if (std::isfinite(state[i])) state_[i] = state[i];
  state_[0] = std::clamp(state_[0], parameters_.lowest, parameters_.highest);
  const double most =
      bristle_stiffness_ > 0.0 ? parameters_.static_ratio * parameters_.coulomb : 0.0;
  state_[2] = std::clamp(state_[2], -most, most);
  state_[3] = std::max(state_[3], 0.0);
  state_[4] = std::max(state_[4], 0.0);
  friction_factor_ = std::exp(-variable_.heating * state_[4]);
}

double RigidDrive::dry_level(double force) const noexcept {
  double level = parameters_.coulomb * std::max(0.0, 1.0 + parameters_.coulomb_slope * state_[0]) *
                 stribeck_(state_[1]);
  level += variable_.load_share * std::abs(force);
  if (variable_.dwell_gain > 0.0 && state_[3] > 0.0)
    level *= 1.0 - variable_.dwell_gain * std::expm1(-state_[3] / variable_.dwell_time_s);
  return friction_factor_ * level;
}

void RigidDrive::age(double friction) noexcept {
  const double speed = state_[1];
  if (variable_.dwell_gain > 0.0) state_[3] = speed == 0.0 ? state_[3] + substep_s_ : 0.0;
  if (variable_.heating == 0.0) return;
  state_[4] = kept_heat_ * state_[4] + substep_s_ * std::abs(speed) * friction;
  friction_factor_ = std::exp(-variable_.heating * state_[4]);
}

void RigidDrive::coast(double dt_s, double force) noexcept {
  state_[0] += dt_s * state_[1];
  if (bristle_stiffness_ == 0.0) return;
  const double level = dry_level(force);
  state_[2] =
      level > 0.0 ? relaxed_bristle(state_[2], state_[1], level, bristle_stiffness_, dt_s) : 0.0;
}

void RigidDrive::advance(double force) noexcept {
  const Parameters& p = parameters_;
  coast(0.5 * substep_s_, force);
  const double speed = state_[1];
  const double drag = friction_factor_ *
                      (p.viscous + std::copysign(p.viscous_asymmetry, speed * p.viscous_asymmetry) +
                       p.viscous_quadratic * std::abs(speed));
  const double driving = force - p.offset - p.spring * state_[0] - state_[2];
  const double half = 0.5 * substep_s_ / p.inertia;
  const double damped = 1.0 + half * drag;
  const double wanted = ((1.0 - half * drag) * speed + 2.0 * half * driving) / damped;
  const double level = bristle_stiffness_ > 0.0 ? 0.0 : dry_level(force);
  const double dry = 2.0 * half * level / damped;  // what it can take away
  state_[1] = std::copysign(std::max(std::abs(wanted) - dry, 0.0), wanted);
  coast(0.5 * substep_s_, force);
  age(drag * std::abs(state_[1]) + level + std::abs(state_[2]));
}

Estimate RigidDrive::step(Features features) noexcept {
  const bool is_first = !input_.is_started();
  const auto forces = input_.step(driving_force(parameters_.gains, features));
  if (is_first) return {.value = state_[0]};
  const double before = state_[0];
  for (const double force : forces) advance(force);
  if (!all_finite(state_)) {
    reset();
    state_[0] = before;
    return {.value = before, .fault = Fault::diverged};
  }
  return bounded_position(state_, parameters_.lowest, parameters_.highest);
}

}  // namespace torsio

#include "model/second_order/dynamic_bouc_wen.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/all_finite.hpp"
#include "model/second_order/bounded_motion.hpp"
#include "model/second_order/check_dynamics.hpp"

namespace torsio {
namespace {

/// Start, middle and end of each sub-step; ends are next starts.
std::vector<double> half_steps(std::size_t substeps) {
  std::vector<double> places;
  for (std::size_t i = 0; i <= 2 * substeps; ++i)
    places.push_back(static_cast<double>(i) / static_cast<double>(2 * substeps));
  return places;
}

const DynamicBoucWen::Parameters& checked(const DynamicBoucWen::Parameters& p) {
  constexpr std::string_view kFamily = DynamicBoucWen::kFamily;
  const auto require_finite = [&](bool holds, const char* field, const char* expected,
                                  double found) {
    require(holds && std::isfinite(found), {kFamily, field}, expected, found);
  };
  require_finite(p.mass > 0.0, "mass", "a positive number", p.mass);
  require_finite(p.damping >= 0.0, "damping", "a number not below 0", p.damping);
  require_finite(p.stiffness >= 0.0, "stiffness", "a number not below 0", p.stiffness);
  require_finite(p.hysteretic_stiffness >= 0.0, "hysteretic_stiffness", "a number not below 0",
                 p.hysteretic_stiffness);
  require_finite(p.loss >= 0.0, "loss", "a number not below 0", p.loss);
  require_finite(true, "skew", "a number", p.skew);
  require_finite(p.exponent >= 1.0, "exponent", "a number not below 1", p.exponent);
  check_gains(p.gains, kFamily);
  check_sampled_time(p.time, kFamily);
  check_end_stops(p.lowest, p.highest, kFamily);
  // Runge-Kutta of order 4 is stable up to 2.78 on either axis; the sum is an upper bound of the
  // eigenvalue.
  constexpr double kStable = 2.7;
  const double fastest_per_s =
      std::max(p.damping / p.mass, std::sqrt((p.stiffness + p.hysteretic_stiffness) / p.mass));
  const double turn = fastest_per_s * p.time.sample_period_s / static_cast<double>(p.time.substeps);
  require_finite(turn < kStable, "substeps", "sub-steps of less than 2.7 over the fastest rate",
                 turn);
  return p;
}

}  // namespace

DynamicBoucWen::DynamicBoucWen(const Parameters& parameters)
    : parameters_(checked(parameters)),
      substep_s_(parameters.time.sample_period_s / static_cast<double>(parameters.time.substeps)),
      input_(parameters.time.input_order, half_steps(parameters.time.substeps)) {}

void DynamicBoucWen::reset() noexcept {
  input_.reset();
  state_ = {};
}

void DynamicBoucWen::set_state(std::span<const double> state) noexcept {
  for (std::size_t i = 0; i < state_.size() && i < state.size(); ++i)
    if (std::isfinite(state[i])) state_[i] = state[i];
  state_[0] = std::clamp(state_[0], parameters_.lowest, parameters_.highest);
}

template <bool kIsPower>
DynamicBoucWen::State DynamicBoucWen::slope(const State& at, double force) const noexcept {
  const Parameters& p = parameters_;
  const auto [y, speed, z] = at;
  double bent = p.loss * std::abs(speed) * z + p.skew * speed * std::abs(z);
  if constexpr (kIsPower) bent *= std::pow(std::abs(z), p.exponent - 1.0);
  return {speed, (force - p.damping * speed - p.stiffness * y - z) / p.mass,
          p.hysteretic_stiffness * speed - bent};
}

template <bool kIsPower>
void DynamicBoucWen::advance(std::span<const double> force) noexcept {
  const auto moved = [this](const State& by, double dt_s) {
    State to = state_;
    for (std::size_t i = 0; i < to.size(); ++i) to[i] += dt_s * by[i];
    return to;
  };
  const double h = substep_s_;
  for (std::size_t i = 0; i + 2 < force.size(); i += 2) {
    const State k1 = slope<kIsPower>(state_, force[i]);
    const State k2 = slope<kIsPower>(moved(k1, 0.5 * h), force[i + 1]);
    const State k3 = slope<kIsPower>(moved(k2, 0.5 * h), force[i + 1]);
    const State k4 = slope<kIsPower>(moved(k3, h), force[i + 2]);
    for (std::size_t j = 0; j < state_.size(); ++j)
      state_[j] += h / 6.0 * (k1[j] + 2.0 * (k2[j] + k3[j]) + k4[j]);
  }
}

Estimate DynamicBoucWen::step(Features features) noexcept {
  const bool is_first = !input_.is_started();
  const auto force = input_.step(driving_force(parameters_.gains, features));
  if (is_first) return {.value = state_[0]};
  const double before = state_[0];
  if (parameters_.exponent == 1.0)
    advance<false>(force);
  else
    advance<true>(force);
  if (!all_finite(state_)) {
    reset();
    state_[0] = before;
    return {.value = before, .fault = Fault::diverged};
  }
  return bounded_position(state_, parameters_.lowest, parameters_.highest);
}

double hysteretic_energy(const DynamicBoucWen::Parameters& parameters, double force) {
  constexpr int kPieces = 200;
  const auto density = [&](double z) {
    return z / (parameters.hysteretic_stiffness +
                (parameters.loss - parameters.skew) * std::pow(z, parameters.exponent));
  };
  const double width = std::abs(force) / kPieces;
  double sum = 0.0;
  for (int i = 0; i < kPieces; ++i) {
    const double z = width * i;
    sum += density(z) + 4.0 * density(z + 0.5 * width) + density(z + width);
  }
  return sum * width / 6.0;
}

}  // namespace torsio

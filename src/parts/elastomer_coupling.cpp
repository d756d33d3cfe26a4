#include "parts/elastomer_coupling.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/checks.hpp"

namespace torsio {
namespace {

constexpr auto kPlace = "elastomer coupling";
constexpr double kInfinity = std::numeric_limits<double>::infinity();

CreepChain chain_of(const ElastomerCoupling::Parameters& parameters) {
  require_positive(kPlace, "unbonded_softening", parameters.unbonded_softening);
  const double softening = parameters.bonded ? 1.0 : parameters.unbonded_softening;
  auto branches = parameters.branches;
  for (double& stiffness : branches.stiffness_Nm_rad) stiffness /= softening;
  return {parameters.stiffness_Nm_rad / softening, branches};
}

}  // namespace

ElastomerCoupling::ElastomerCoupling(const Parameters& parameters)
    : parameters_(parameters), chain_(chain_of(parameters)), slip_(parameters.slip) {
  const auto [first, second, third] = parameters.output_Nm;
  require_positive(kPlace, "output_Nm[0]", first);
  require_parameter(std::isfinite(second), kPlace, "output_Nm[1] finite", second);
  require_parameter((third < 0.0 && std::isfinite(third)) || (second == 0.0 && third == 0.0),
                    kPlace, "output_Nm[2] < 0 and finite (or a linear output)", third);
  quadratic_ = second / (first * first);
  cubic_ = third / (first * first * first);
  require_positive(kPlace, "slip_load_Nm", parameters.slip_load_Nm);
  require_parameter(parameters.slip.load_factor == 0.0, kPlace, "slip load_factor = 0",
                    parameters.slip.load_factor);
  require_parameter(parameters.creep_per_cycle >= 0.0 && parameters.creep_per_cycle < 1.0, kPlace,
                    "creep_per_cycle in 0..1", parameters.creep_per_cycle);
  require_not_negative(kPlace, "cycle_dead_band_rad", parameters.cycle_dead_band_rad);
  // g = T + a T² + b T³, and g′ = 1 + 2 a T + 3 b T² = 0, solved for 1 / T.
  const double root = std::sqrt(quadratic_ * quadratic_ - 3.0 * cubic_);
  lowest_Nm_ = cubic_ < 0.0 ? 1.0 / (-quadratic_ - root) : -kInfinity;
  highest_Nm_ = cubic_ < 0.0 ? 1.0 / (-quadratic_ + root) : kInfinity;
}

void ElastomerCoupling::reset(double deflection_rad) noexcept {
  const auto relaxed_at = [this](double u) {
    return Lobes{chain_.relaxed(u), chain_.relaxed_stiffness() * u};
  };
  lobes_[0] = relaxed_at(parameters_.bonded ? deflection_rad : std::max(deflection_rad, 0.0));
  lobes_[1] = relaxed_at(parameters_.bonded ? 0.0 : std::min(deflection_rad, 0.0));
  slip_.reset();
  last_deflection_rad_ = deflection_rad;
  carried_Nm_ = output_torque(lobes_[0].torque_Nm + lobes_[1].torque_Nm);
  torque_Nm_ = carried_Nm_;
  glue_ = 1.0;
  glue_after_cycle_ = 1.0;
  last_side_ = 0.0;
  turns_ = 0;
}

double ElastomerCoupling::step(double deflection_rad, double deflection_rate_rad_s) noexcept {
  if (parameters_.bonded) {
    Lobes& both = lobes_[0];
    both.creep_rad = chain_.loaded(both.creep_rad, last_deflection_rad_, deflection_rad);
    both.torque_Nm = chain_.torque(both.creep_rad, deflection_rad);
  } else {
    step_lobes(lobes_[0], 1.0, deflection_rad);
    step_lobes(lobes_[1], -1.0, deflection_rad);
  }
  const double before_Nm = carried_Nm_;
  carried_Nm_ = output_torque(lobes_[0].torque_Nm + lobes_[1].torque_Nm);
  double slip_Nm = slip_.step(deflection_rad - last_deflection_rad_, deflection_rate_rad_s, 0.0);
  if (!parameters_.bonded) {
    const double pressed = std::min(std::abs(carried_Nm_) / parameters_.slip_load_Nm, 1.0);
    slip_Nm = slip_.shed(pressed * parameters_.slip.constant_Nm);
  }
  last_deflection_rad_ = deflection_rad;
  if (parameters_.creep_per_cycle > 0.0) {
    count_cycle(deflection_rad);
    // Here what is stored falls, and the torque jumps by no more than the slip elements' share.
    if (carried_Nm_ * before_Nm <= 0.0) glue_ = glue_after_cycle_;
  }
  torque_Nm_ = glue_ * (carried_Nm_ + slip_Nm);
  return torque_Nm_;
}

void ElastomerCoupling::step_lobes(Lobes& lobes, double side,
                                   double deflection_rad) const noexcept {
  if (lobes.torque_Nm != 0.0) {
    const auto creep_rad = chain_.loaded(lobes.creep_rad, last_deflection_rad_, deflection_rad);
    const double torque_Nm = chain_.torque(creep_rad, deflection_rad);
    if (side * torque_Nm >= 0.0) {
      lobes = {creep_rad, torque_Nm};
      return;
    }
  }
  // Contact that is lost or made within a step: so light that the step counts as without load.
  lobes.creep_rad = chain_.unloaded(lobes.creep_rad);
  const double torque_Nm = chain_.torque(lobes.creep_rad, deflection_rad);
  lobes.torque_Nm = side * torque_Nm > 0.0 ? torque_Nm : 0.0;
}

void ElastomerCoupling::count_cycle(double deflection_rad) noexcept {
  if (std::abs(deflection_rad) <= parameters_.cycle_dead_band_rad) return;
  const double side = std::copysign(1.0, deflection_rad);
  if (side * last_side_ < 0.0 && ++turns_ == 2) {
    glue_after_cycle_ *= 1.0 - parameters_.creep_per_cycle;
    turns_ = 0;
  }
  last_side_ = side;
}

double ElastomerCoupling::output_torque(double linear_Nm) const noexcept {
  const double t = std::min(std::max(linear_Nm, lowest_Nm_), highest_Nm_);
  return t * (1.0 + t * (quadratic_ + t * cubic_));
}

double ElastomerCoupling::output_energy(double linear_Nm) const noexcept {
  const double t = std::min(std::max(linear_Nm, lowest_Nm_), highest_Nm_);
  const double rising = t * t * (0.5 + t * (quadratic_ / 3.0 + t * cubic_ / 4.0));
  return rising + output_torque(t) * (linear_Nm - t);
}

double ElastomerCoupling::friction_energy() const noexcept {
  double chain_J = 0.0;
  for (const Lobes& lobes : lobes_) {
    chain_J += output_energy(lobes.torque_Nm) / chain_.stiffness();
    for (std::size_t j = 0; j < CreepChain::kElements; ++j) {
      const double stiffness = chain_.element_stiffness()[j];
      chain_J += output_energy(stiffness * lobes.creep_rad[j]) / stiffness;
    }
  }
  return glue_ * (chain_J + slip_.energy());
}

double ElastomerCoupling::deflection(double torque_Nm) const noexcept {
  const double wanted_Nm = std::abs(torque_Nm) / glue_;
  const double side = torque_Nm < 0.0 ? -1.0 : 1.0;
  const double limit_Nm = side < 0.0 ? -lowest_Nm_ : highest_Nm_;
  double below = 0.0;
  double above = std::min(limit_Nm, wanted_Nm);
  while (above < limit_Nm && side * output_torque(side * above) < wanted_Nm)
    above = std::min(limit_Nm, 2.0 * above);
  for (int i = 0; i < 80; ++i) {
    const double middle = 0.5 * (below + above);
    (side * output_torque(side * middle) < wanted_Nm ? below : above) = middle;
  }
  return side * above / chain_.relaxed_stiffness();
}

double ElastomerCoupling::steepest(double /*load_Nm*/) const noexcept {
  // g′ is largest where g″ = 2 a + 6 b T = 0.
  const double slope = cubic_ < 0.0 ? 1.0 - quadratic_ * quadratic_ / (3.0 * cubic_) : 1.0;
  return slope * chain_.stiffness() + slip_.stiffness(0.0);
}

}  // namespace torsio

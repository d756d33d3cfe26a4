#include "parts/creep_chain.hpp"

#include <cmath>

#include "core/checks.hpp"

namespace torsio {
namespace {

constexpr auto kPlace = "creep chain";

}  // namespace

CreepChain::CreepChain(double stiffness_Nm_rad,
                       const MaxwellBranches<kElements>::Parameters& branches)
    : relaxed_stiffness_(stiffness_Nm_rad),
      stiffness_(stiffness_Nm_rad),
      branch_(branches.stiffness_Nm_rad) {
  require_positive(kPlace, "stiffness_Nm_rad", stiffness_Nm_rad);
  double slower_1_s = 0.0;
  for (std::size_t i = 0; i < kElements; ++i) {
    require_positive(kPlace, "branch stiffness_Nm_rad", branch_[i]);
    require_positive(kPlace, "relaxation_s", branches.relaxation_s[i]);
    pole_[i] = 1.0 / branches.relaxation_s[i];
    require_parameter(pole_[i] > slower_1_s, kPlace, "relaxation_s falling from branch to branch",
                      branches.relaxation_s[i]);
    slower_1_s = pole_[i];
    stiffness_ += branch_[i];
  }
  const auto impedance = [this](double sigma) {  // Z(−σ)
    double sum = relaxed_stiffness_;
    for (std::size_t i = 0; i < kElements; ++i) sum += branch_[i] * sigma / (sigma - pole_[i]);
    return sum;
  };
  for (std::size_t j = 0; j < kElements; ++j) {
    // Z falls from above 0 to −∞ between a pole and the next.
    double below = j == 0 ? 0.0 : pole_[j - 1];
    double above = pole_[j];
    for (int i = 0; i < 100; ++i) {
      const double middle = 0.5 * (below + above);
      (impedance(middle) > 0.0 ? below : above) = middle;
    }
    zero_[j] = below;
    for (std::size_t i = 0; i < kElements; ++i) {
      const double gap = pole_[i] - zero_[j];
      damper_[j] += branch_[i] * pole_[i] / (gap * gap);
    }
    spring_[j] = zero_[j] * damper_[j];
    relaxed_[j] = relaxed_stiffness_ / spring_[j];
  }
  set_period(0.0);
}

void CreepChain::set_period(double dt_s) noexcept {
  // The Maxwell torques zᵢ are the modes: y = M z with Mⱼᵢ = 1 / dⱼ (σⱼ − pᵢ), and the inverse of M
  // is kᵢ pᵢ / (σⱼ − pᵢ). A mode decays by exp(−pᵢ dt) and gains kᵢ times its mean decay.
  push_ = {};
  transition_ = {};
  for (std::size_t j = 0; j < kElements; ++j) {
    for (std::size_t i = 0; i < kElements; ++i) {
      const double mode = 1.0 / (damper_[j] * (zero_[j] - pole_[i]));
      push_[j] -= mode * branch_[i] * mean_decay(pole_[i] * dt_s);
      for (std::size_t l = 0; l < kElements; ++l) {
        transition_[j][l] +=
            mode * std::exp(-pole_[i] * dt_s) * branch_[i] * pole_[i] / (zero_[l] - pole_[i]);
      }
    }
    recovery_[j] = std::exp(-zero_[j] * dt_s);
  }
}

}  // namespace torsio

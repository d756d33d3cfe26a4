#pragma once

#include <array>
#include <cstddef>

#include "sim/plant/plant.hpp"

namespace torsio {

/// The energy balance of one run: supplied, stored and lost energy.
///
///     E = ½ Σ J ω² + ∫ τ_el dδ + ½ K φ² + Σ F²/2k + m g l (1 − cos q)
///     residual = E − E(0) − W_in + W_lost
///
/// The residual is energy that was created (positive) or has vanished (negative): integration error
/// alone. The loss of a hysteretic element is its work minus its stored energy, which is a separate
/// check for each element: it must not decrease, except for integration error and for energy in
/// load-dependent slip elements: with k(load), F²/2k is not all that a later, stiffer or softer
/// path can recover. Source: specification 4.6.
class EnergyAudit {
 public:
  /// Opens the books at the plant's present state.
  EnergyAudit(const Plant& plant, const Load& load);

  /// Books one step: call after every `Plant::step` that was not divided.
  void observe(const Plant& plant, const Load& load, double dt_s) noexcept;

  [[nodiscard]] double stored() const noexcept { return stored_.all_J; }      ///< E [J]
  [[nodiscard]] double input() const noexcept { return input_J_; }            ///< W_in [J]
  [[nodiscard]] double throughput() const noexcept { return throughput_J_; }  ///< ∫ |P_in| dt [J]
  [[nodiscard]] double lost() const noexcept { return lost_J_ + hysteretic_loss(); }  ///< W_lost
  [[nodiscard]] double hysteretic_loss() const noexcept {
    return hysteretic_work_J_ - (stored_.hysteretic_J - first_stored_.hysteretic_J);
  }
  /// @param port below Plant::kWorkPorts, of Plant::work_ports
  /// @returns its work [J] less what it stores
  [[nodiscard]] double port_loss(std::size_t port) const noexcept {
    return work_J_[port] - (last_ports_[port].stored_J - first_ports_[port].stored_J);
  }
  [[nodiscard]] double residual() const noexcept {
    return stored_.all_J - first_stored_.all_J - input_J_ + lost();
  }

 private:
  std::array<WorkPort, Plant::kWorkPorts> first_ports_;
  std::array<WorkPort, Plant::kWorkPorts> last_ports_;
  std::array<double, Plant::kWorkPorts> work_J_{};
  StoredEnergy first_stored_;
  StoredEnergy stored_;
  double input_J_ = 0.0;
  double throughput_J_ = 0.0;
  double lost_J_ = 0.0;
  double hysteretic_work_J_ = 0.0;
};

}  // namespace torsio

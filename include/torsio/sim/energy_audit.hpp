#pragma once

#include <array>

#include "torsio/sim/plant.hpp"

namespace torsio {

/// The books of one run: what was put in, what is stored, what was lost.
///
///     E = ½ Σ J ω² + ∫ τ_el dδ + ½ K φ² + Σ F²/2k + m g l (1 − cos q)
///     residual = E − E(0) − W_in + W_lost
///
/// The residual is what came from nothing (positive) or vanished (negative): integration error
/// alone. What hysteretic elements lose is their work minus what they store, so that it is a check
/// of its own: it must never fall. Source: SPEC section 4.6.
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
  [[nodiscard]] double residual() const noexcept {
    return stored_.all_J - first_stored_.all_J - input_J_ + lost();
  }

 private:
  std::array<WorkPort, Plant::kWorkPorts> last_ports_;
  StoredEnergy first_stored_;
  StoredEnergy stored_;
  double input_J_ = 0.0;
  double throughput_J_ = 0.0;
  double lost_J_ = 0.0;
  double hysteretic_work_J_ = 0.0;
};

}  // namespace torsio

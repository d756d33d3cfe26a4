#pragma once

#include "torsio/sim/plant.hpp"

namespace torsio {

/// The books of one run: what was put in, what is stored, what was lost.
///
///     E = ½ Σ J ω² + ∫ τ_el dδ + ½ K_h φ² + Σ F²/2k + m g l (1 − cos q)
///     residual = E − E(0) − W_in + W_lost
///
/// The residual is what came from nothing (positive) or vanished (negative): integration error
/// alone. What the slip elements lose is their work minus what they store, so that it is a check of
/// its own: it must never fall. Source: SPEC section 4.6.
class EnergyAudit {
 public:
  /// Opens the books at the plant's present state.
  EnergyAudit(const Plant& plant, const Load& load);

  /// Books one step: call after every `Plant::step` that was not divided.
  void observe(const Plant& plant, const Load& load, double dt_s) noexcept;

  [[nodiscard]] double stored() const noexcept { return stored_J_; }          ///< E [J]
  [[nodiscard]] double input() const noexcept { return input_J_; }            ///< W_in [J]
  [[nodiscard]] double throughput() const noexcept { return throughput_J_; }  ///< ∫ |P_in| dt [J]
  [[nodiscard]] double lost() const noexcept { return lost_J_ + slip_loss(); }  ///< W_lost [J]
  [[nodiscard]] double slip_loss() const noexcept {
    return slip_work_J_ - (slip_stored_J_ - first_slip_stored_J_);
  }
  [[nodiscard]] double residual() const noexcept {
    return stored_J_ - first_stored_J_ - input_J_ + lost();
  }

 private:
  struct Stored {
    double all_J = 0.0;
    double slip_J = 0.0;
  };
  [[nodiscard]] static Stored stored_in(const Plant& plant, const Load& load) noexcept;

  PlantState last_;
  double last_twist_rad_;
  double first_stored_J_;
  double first_slip_stored_J_;
  double stored_J_;
  double slip_stored_J_;
  double input_J_ = 0.0;
  double throughput_J_ = 0.0;
  double lost_J_ = 0.0;
  double slip_work_J_ = 0.0;
};

}  // namespace torsio

#pragma once

#include "sim/arm/arm_plant.hpp"
#include "sim/plant/energy_books.hpp"

namespace torsio {

/// The energy balance of an arm, with the ports of `ArmPlant::work_ports`.
///
///     E = ½ q̇ᵀ M(q) q̇ + V(q) + Σ (½ J_r ω_r² + ½ J_m ω_m² + ∫ τ_el dδ + ½ K φ² + Σ F²/2k)
class ArmEnergyAudit : public EnergyBooks<ArmPlant::kWorkPorts> {
 public:
  /// Opens the books at the arm's present state.
  explicit ArmEnergyAudit(const ArmPlant& arm)
      : EnergyBooks(arm.work_ports(), arm.stored_energy()) {}

  /// Books one step: call after every `ArmPlant::step` that was not divided.
  void observe(const ArmPlant& arm, double dt_s) noexcept {
    book(arm.work_ports(), arm.stored_energy(), dt_s);
  }
};

}  // namespace torsio

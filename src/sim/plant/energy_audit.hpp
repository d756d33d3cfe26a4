#pragma once

#include "sim/plant/energy_books.hpp"
#include "sim/plant/plant.hpp"

namespace torsio {

/// The energy balance of a plant with its load, with the ports of `Plant::work_ports`.
///
///     E = ½ Σ J ω² + ∫ τ_el dδ + ½ K φ² + Σ F²/2k + m g l (1 − cos q)
class EnergyAudit : public EnergyBooks<Plant::kWorkPorts> {
 public:
  /// Opens the books at the plant's present state.
  EnergyAudit(const Plant& plant, const Load& load)
      : EnergyBooks(plant.work_ports(load), plant.stored_energy(load)) {}

  /// Books one step: call after every `Plant::step` that was not divided.
  void observe(const Plant& plant, const Load& load, double dt_s) noexcept {
    book(plant.work_ports(load), plant.stored_energy(load), dt_s);
  }
};

}  // namespace torsio

#include "sim/plant/energy_audit.hpp"

#include <cmath>
#include <cstddef>

namespace torsio {

EnergyAudit::EnergyAudit(const Plant& plant, const Load& load)
    : first_ports_(plant.work_ports(load)),
      last_ports_(first_ports_),
      first_stored_(plant.stored_energy(load)),
      stored_(first_stored_) {}

void EnergyAudit::observe(const Plant& plant, const Load& load, double dt_s) noexcept {
  const auto ports = plant.work_ports(load);
  for (std::size_t i = 0; i < ports.size(); ++i) {
    const WorkPort& port = ports[i];
    const double last_rad_s = last_ports_[i].speed_rad_s;
    // A constant torque over the step works through the mean of the speeds before and after.
    const double work_J = (port.torque_Nm + port.viscous_Nms_rad * last_rad_s) * 0.5 * dt_s *
                          (last_rad_s + port.speed_rad_s);
    work_J_[i] += work_J;
    switch (port.kind) {
      case WorkPort::Kind::input:
        input_J_ += work_J;
        throughput_J_ += std::abs(work_J);
        break;
      case WorkPort::Kind::loss: lost_J_ += work_J; break;
      case WorkPort::Kind::hysteretic: hysteretic_work_J_ += work_J; break;
    }
  }
  last_ports_ = ports;
  stored_ = plant.stored_energy(load);
}

}  // namespace torsio

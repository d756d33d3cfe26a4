#pragma once

#include <array>
#include <cmath>
#include <cstddef>

#include "sim/plant/work_port.hpp"

namespace torsio {

/// The energy balance of one run: supplied, stored and lost energy.
///
///     residual = E − E(0) − W_in + W_lost
///
/// The residual is energy that was created (positive) or has vanished (negative): integration error
/// alone. The loss of a hysteretic element is its work minus its stored energy, which is a separate
/// check for each element: it must not decrease, except for integration error and for energy in
/// load-dependent slip elements: with k(load), F²/2k is not all that a later, stiffer or softer
/// path can recover. Source: specification 4.6.
template <std::size_t kPorts>
class EnergyBooks {
 public:
  using Ports = std::array<WorkPort, kPorts>;

  /// Opens the books.
  EnergyBooks(const Ports& ports, const StoredEnergy& stored)
      : first_ports_(ports), last_ports_(ports), first_stored_(stored), stored_(stored) {}

  [[nodiscard]] double stored() const noexcept { return stored_.all_J; }      ///< E [J]
  [[nodiscard]] double input() const noexcept { return input_J_; }            ///< W_in [J]
  [[nodiscard]] double throughput() const noexcept { return throughput_J_; }  ///< ∫ |P_in| dt [J]
  [[nodiscard]] double lost() const noexcept { return lost_J_ + hysteretic_loss(); }  ///< W_lost
  [[nodiscard]] double hysteretic_loss() const noexcept {
    return hysteretic_work_J_ - (stored_.hysteretic_J - first_stored_.hysteretic_J);
  }
  /// @param port below kPorts
  /// @returns its work [J] less what it stores
  [[nodiscard]] double port_loss(std::size_t port) const noexcept {
    return work_J_[port] - (last_ports_[port].stored_J - first_ports_[port].stored_J);
  }
  [[nodiscard]] double residual() const noexcept {
    return stored_.all_J - first_stored_.all_J - input_J_ + lost();
  }

 protected:
  /// Books one step that was not divided.
  void book(const Ports& ports, const StoredEnergy& stored, double dt_s) noexcept {
    for (std::size_t i = 0; i < kPorts; ++i) {
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
    stored_ = stored;
  }

 private:
  Ports first_ports_;
  Ports last_ports_;
  std::array<double, kPorts> work_J_{};
  StoredEnergy first_stored_;
  StoredEnergy stored_;
  double input_J_ = 0.0;
  double throughput_J_ = 0.0;
  double lost_J_ = 0.0;
  double hysteretic_work_J_ = 0.0;
};

}  // namespace torsio

#pragma once

#include <optional>
#include <variant>
#include <vector>

#include "parts/bouc_wen.hpp"
#include "parts/elastic_curve.hpp"
#include "parts/lugre_slip.hpp"
#include "parts/maxwell_slip.hpp"
#include "parts/torque_table.hpp"
#include "torsio/core/dispatch.hpp"
#include "torsio/core/realtime.hpp"

namespace torsio {

/// The inner friction of a spring, one alternative a variant of the plant (specification 4.6). Each
/// has `Parameters`, `reset()`, `step(increment_rad, rate_rad_s, load_Nm)`, `energy()` and
/// `stiffness(load_Nm)`.
using SpringFriction = std::variant<MaxwellSlip<4>, BoucWen, LuGreSlip>;

/// A torsion spring: elastic curve, inner friction that grows with the load, and a little
/// viscosity.
///
///     τ = τ_el(δ) + F[δ, |τ_el|] + d δ̇
///
/// τ_el is the elastic curve of a data sheet, or a table of points instead. Source: specification
/// 4.1.
class Spring {
 public:
  struct Parameters {
    ElasticCurve::Parameters elastic;
    /// Replaces the elastic curve, of which only the nominal stiffness is then used; empty: none.
    std::vector<TorqueTable::Point> table = {};
    std::variant<MaxwellSlip<4>::Parameters, BoucWen::Parameters, LuGreSlip::Parameters> friction;
    double viscosity_Nms_rad = 0.0;
  };

  /// @throws Error as its parts do, or if the viscosity is negative.
  explicit Spring(const Parameters& parameters);
  [[nodiscard]] const ElasticCurve& elastic() const noexcept { return elastic_; }
  [[nodiscard]] bool has_table() const noexcept { return table_.has_value(); }
  [[nodiscard]] const SpringFriction& friction() const noexcept { return friction_; }
  [[nodiscard]] double viscosity() const noexcept { return viscosity_Nms_rad_; }

  /// Relaxed friction at this deflection.
  void reset(double deflection_rad = 0.0) noexcept;

  /// @returns the torque on the joint [Nm]
  double step(double deflection_rad, double deflection_rate_rad_s) noexcept TORSIO_REALTIME {
    const double elastic_Nm =
        table_ ? table_->torque(deflection_rad) : elastic_.torque(deflection_rad);
    const double increment_rad = deflection_rad - last_deflection_rad_;
    last_deflection_rad_ = deflection_rad;
    friction_Nm_ = detail::dispatch(friction_, [&](auto& friction) {
      return friction.step(increment_rad, deflection_rate_rad_s, elastic_Nm);
    });
    return elastic_Nm + friction_Nm_ + viscosity_Nms_rad_ * deflection_rate_rad_s;
  }

  /// @returns the friction's share of the last step's torque [Nm]
  [[nodiscard]] double friction_torque() const noexcept { return friction_Nm_; }
  /// @returns the energy [J] in the elastic curve at this deflection, and in the friction elements
  [[nodiscard]] double elastic_energy(double deflection_rad) const noexcept {
    return table_ ? table_->energy(deflection_rad) : elastic_.energy(deflection_rad);
  }
  [[nodiscard]] double friction_energy() const noexcept;
  /// @returns the largest stiffness [Nm/rad] under loads up to this one
  [[nodiscard]] double steepest(double load_Nm) const noexcept;
  /// @returns the deflection [rad] at which it gives this torque, its friction relaxed
  [[nodiscard]] double deflection(double torque_Nm) const noexcept {
    return table_ ? table_->deflection(torque_Nm) : elastic_.deflection(torque_Nm);
  }

 private:
  ElasticCurve elastic_;
  std::optional<TorqueTable> table_;
  SpringFriction friction_;
  double viscosity_Nms_rad_;
  double last_deflection_rad_ = 0.0;
  double friction_Nm_ = 0.0;
};

}  // namespace torsio

#pragma once

#include <cstddef>
#include <limits>
#include <vector>

#include "torsio/core/realtime.hpp"

namespace torsio {

/// A measured or designed torque curve of a spring: straight lines between points, continued beyond
/// the outermost ones with the slope of the outermost segment.
///
///     τ = τ_i + k_i (δ − δ_i),   k_i = (τ_{i+1} − τ_i) / (δ_{i+1} − δ_i)
///
/// δ deflection [rad] (gear minus joint), τ torque on the joint [Nm]. The curve is elastic: the
/// same way up and down, and its energy is the integral in closed form.
class TorqueTable {
 public:
  struct Point {
    double deflection_rad = 0.0;
    double torque_Nm = 0.0;
  };
  static constexpr std::size_t kMaxPoints = 10000;

  /// @throws Error unless there are 2 to `kMaxPoints` points whose deflections and torques are
  /// finite and both increase from point to point, the first one at a deflection and a torque of at
  /// most 0, the last one of at least 0.
  explicit TorqueTable(const std::vector<Point>& points);

  /// @returns τ [Nm]
  [[nodiscard]] double torque(double deflection_rad) const noexcept TORSIO_REALTIME;
  /// @returns the stored energy ∫₀^δ τ dδ [J]
  [[nodiscard]] double energy(double deflection_rad) const noexcept;
  /// @returns the deflection [rad] at which the curve has this torque
  [[nodiscard]] double deflection(double torque_Nm) const noexcept;
  /// @returns the largest and the smallest slope dτ/dδ [Nm/rad]
  [[nodiscard]] double steepest() const noexcept { return steepest_Nm_rad_; }
  [[nodiscard]] double flattest() const noexcept { return flattest_Nm_rad_; }

 private:
  struct Segment {
    double deflection_rad = 0.0;
    double torque_Nm = 0.0;
    double slope_Nm_rad = 0.0;
    double energy_J = 0.0;  ///< from the first point to the beginning of this segment
  };
  [[nodiscard]] double energy_from_first(double deflection_rad) const noexcept;

  std::vector<Segment> segments_;
  double energy_at_zero_J_ = 0.0;
  double steepest_Nm_rad_ = 0.0;
  double flattest_Nm_rad_ = std::numeric_limits<double>::infinity();
};

}  // namespace torsio

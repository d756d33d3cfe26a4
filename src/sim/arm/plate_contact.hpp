#pragma once

#include <algorithm>

#include "arm/vector3.hpp"
#include "torsio/sim/arm/arm_run.hpp"

namespace torsio {

/// The force between a plate and a point, which never pulls:
///
///     F = max(0, k δ + c δ̇) where δ > 0, else 0,   δ = −n·(x − x₀) − s,   m s̈ = F
///
/// x is the point, x₀ one of the face, n out of it, s the way of the plate along −n. The force on the point is F n. Steps are
/// semi-implicit Euler, as those of the arm.
class PlateContact {
 public:
  /// The largest stiffness and smallest mass that steps of 0.1 ms suit: √(k / m) dt = 0.14.
  static constexpr double kLargestStiffness_N_m = 1e6;
  static constexpr double kSmallestMass_kg = 0.5;

  explicit PlateContact(const ArmPlate& plate) : plate_(plate) {}

  /// @returns F of this state
  double find_force(const Vector3& position_m, const Vector3& velocity_m_s) noexcept {
    depth_m_ = -dot(plate_.normal, position_m - plate_.at_m) - way_m_;
    const double rate_m_s = -dot(plate_.normal, velocity_m_s) - speed_m_s_;
    force_N_ = depth_m_ > 0.0
                   ? std::max(0.0, plate_.stiffness_N_m * depth_m_ + plate_.damping_Ns_m * rate_m_s)
                   : 0.0;
    largest_N_ = std::max(largest_N_, force_N_);
    return force_N_;
  }
  /// Advances the plate under the last force.
  void move(double dt_s) noexcept {
    if (!(plate_.mass_kg > 0.0)) return;
    speed_m_s_ += dt_s * force_N_ / plate_.mass_kg;
    way_m_ += dt_s * speed_m_s_;
  }

  [[nodiscard]] const Vector3& normal() const noexcept { return plate_.normal; }
  [[nodiscard]] double force_N() const noexcept { return force_N_; }
  [[nodiscard]] double speed_m_s() const noexcept { return speed_m_s_; }
  /// @returns the largest force since the last call
  double take_largest_N() noexcept {
    const double largest_N = largest_N_;
    largest_N_ = force_N_;
    return largest_N;
  }
  /// @param position_m now @returns ½ k δ² + ½ m ṡ² [J]
  [[nodiscard]] double energy(const Vector3& position_m) const noexcept {
    const double depth_m = std::max(0.0, -dot(plate_.normal, position_m - plate_.at_m) - way_m_);
    return 0.5 * plate_.stiffness_N_m * depth_m * depth_m +
           0.5 * plate_.mass_kg * speed_m_s_ * speed_m_s_;
  }

 private:
  ArmPlate plate_;  ///< `at_m` in the frame of the base
  double way_m_ = 0.0;
  double speed_m_s_ = 0.0;
  double depth_m_ = 0.0;
  double force_N_ = 0.0;
  double largest_N_ = 0.0;
};

}  // namespace torsio

#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <span>

#include "torsio/arm/arm_dynamics.hpp"
#include "torsio/core/realtime.hpp"

namespace torsio {

/// Force and moment on the flange that would make the external torques of the joints:
///
///     τ_ext = J(q)ᵀ F + e,   F = (J W Jᵀ)⁻¹ J W τ_ext,   W = diag(1 / σ_i²),   cov F = (J W Jᵀ)⁻¹
///
/// by weighted least squares: the joint with the smallest error counts most. A contact elsewhere on the arm gives a wrench
/// that is not there.
struct FlangeWrench {
  enum class Determined : std::uint8_t {
    nothing,  ///< near a singular configuration, or too few joints
    force,    ///< a force through the origin of the flange, its moment taken as 0
    both,
  };
  static constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

  Determined determined = Determined::nothing;
  /// Three forces [N], three moments [Nm], in the frame of the base; NaN where not determined.
  std::array<double, 6> value = {kNone, kNone, kNone, kNone, kNone, kNone};
  /// One standard deviation of each.
  std::array<double, 6> std_dev = {kNone, kNone, kNone, kNone, kNone, kNone};
  /// As `CartesianImpedance::Output::manipulability`, of what is determined; of force and moment where nothing is.
  double manipulability = 0.0;
};

/// Not determined below a manipulability of `CartesianImpedance::kSingular`. Of force and moment the joints must be six at
/// least, of a force three.
/// @param std_dev_Nm σ of each joint, positive (`ContactDetector::Output`)
/// What is not finite is not determined.
[[nodiscard]] FlangeWrench flange_wrench(
    const ArmDynamics& dynamics, std::span<const double> angle_rad,
    std::span<const double> external_Nm,
    std::span<const double> std_dev_Nm) noexcept TORSIO_REALTIME;

}  // namespace torsio

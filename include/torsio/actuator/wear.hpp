#pragma once

#include "torsio/actuator/data_sheet.hpp"

namespace torsio {

/// Temperature and age of an actuator. All laws here are assumed (A): specification 4.1 requires a
/// temperature factor and names its source for the trend (Wolf & Iskandar), but gives no numbers.
struct OperatingConditions {
  static constexpr double kReference_K = 273.15 + 25.0;  ///< the data sheets' temperature
  static constexpr double kColdest_K = 273.15 - 40.0;
  static constexpr double kHottest_K = 273.15 + 85.0;
  static constexpr double kShortestWarmUp_s = 1.0;

  double temperature_K = kReference_K;  ///< temperature of the gear's lubricant at the start
  double warm_up_K = 0.0;               ///< final temperature rise
  double warm_up_time_s = 1200.0;       ///< τ, 63 % of the rise
  double age = 0.0;                     ///< 0 new, 1 at the end of its service life
};

/// @throws UsageError for a temperature, at the start or in the end, that is not -40 to 85 degC, a
/// τ under a second, or an age that is not 0 to 1.
void check(const OperatingConditions& conditions);

/// T(t) = T₀ + ΔT (1 − exp(−t / τ)).
[[nodiscard]] double temperature(const OperatingConditions& conditions, double time_s) noexcept;

/// φ = exp(−(T − 25 degC) / 60 K), on Coulomb and viscous friction of rotor and gear alike: 1 at
/// 25 degC, 1.52 at 0 degC, 0.66 at 50 degC. The lubricant thins.
[[nodiscard]] double friction_factor(double temperature_K) noexcept;

/// An actuator after the share `age` of its service life: in its stages, stiffness × (1 − 0.1 age),
/// inner friction × (1 + age), also the break-away angles, so that friction alone
/// makes nothing stiffer; play × (1 + 2 age). Changed values are tagged assumed.
[[nodiscard]] DataSheet aged(const DataSheet& sheet, double age);

}  // namespace torsio

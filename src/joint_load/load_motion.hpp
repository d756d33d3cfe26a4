#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "torsio/data/recording.hpp"

namespace torsio {

/// The channel whose motion is that of the load.
inline constexpr const char* kLoadAngle = "joint_angle_rad";

/// The angle of the load, straight between the samples at which its encoder delivered; NaN where it did not measure.
/// @throws Error if the recording has no such channel, or jumps by more than half a turn.
[[nodiscard]] std::vector<double> load_angle(const Recording& recording);

/// The error of q'' at one width of the polynomial.
struct AccelerationError {
  double noise_rad_s2 = 0.0;  ///< standard deviation, from the encoder
  double loss_rad_s2 = 0.0;   ///< RMS of what the polynomial is too wide for
  [[nodiscard]] double square() const noexcept {
    return noise_rad_s2 * noise_rad_s2 + loss_rad_s2 * loss_rad_s2;
  }
};

/// One angle and how much its acceleration counts.
struct WeightedAngle {
  std::span<const double> angle_rad;
  double inertia_kg_m2 = 0.0;
};

/// The width of the polynomial at which the error of the torque of inertia is least over all angles,
///
///     sum over the samples of inertia^2 (noise^2 + loss^2)
///
/// noise: what the encoder's noise, taken as white, leaves in q''. Its size follows from the difference between the
/// polynomials of 4 and 6 samples, to which a motion hardly contributes.
/// loss: from the difference between q'' at a width and at two thirds of it, less what noise leaves in it. Both lose
/// in proportion to the fourth power of their widths, until a motion is lost in both: what a narrower one has lost stays
/// lost.
/// @returns samples on either side
[[nodiscard]] std::size_t choose_half_width(std::span<const WeightedAngle> angles,
                                            double sample_rate_Hz);

/// The same at one width.
[[nodiscard]] AccelerationError acceleration_error(std::span<const double> angle_rad,
                                                   std::size_t half_width, double sample_rate_Hz);

struct LoadMotion {
  std::vector<double> angle_rad;  ///< smoothed; NaN where the polynomial does not reach
  std::vector<double> acceleration_rad_s2;
};

[[nodiscard]] LoadMotion load_motion(std::span<const double> angle_rad, std::size_t half_width,
                                     double sample_rate_Hz);

}  // namespace torsio

#pragma once

#include <cstdint>

#include "torsio/core/fault.hpp"
#include "torsio/core/realtime.hpp"

namespace torsio {

/// Makes the angle of an absolute encoder that measures a single turn continuous across its wrap:
///
///     angle = raw + turns * turn_rad
///
/// Between two samples n periods apart the encoder can move by m = n * largest_change_rad. Of the
/// angles that the new raw value can mean, the nearest one to the last angle, at a distance d, is
/// taken if d <= m, unless another turn is possible as well, d >= turn_rad - m: then the turn is
/// unknown until the next `start`. Nothing is guessed. Form: ours.
class AngleUnwrapper {
 public:
  struct Settings {
    double turn_rad =
        6.283185307179586;            ///< range of the encoder, on the side that the angle is of
    double largest_change_rad = 0.0;  ///< by which it can move in one period; below half a turn
  };
  struct Output {
    double angle_rad = 0.0;  ///< finite in every case; the last one where there is a fault
    /// `zero_not_set`: the turn is unknown, `start` is required. `input_not_finite`: no sample, or
    /// one that the last angle cannot have reached.
    Fault fault = Fault::zero_not_set;
  };

  /// @throws Error if the turn is not positive, or the largest change not below half of it.
  explicit AngleUnwrapper(const Settings& settings);

  /// Finds the turn after power-on from a coarse angle, such as that of the motor divided by the
  /// gear ratio.
  /// @param expected_rad,tolerance_rad the coarse angle and its largest error
  /// @returns false, and the turn is unknown, if the tolerance is half a turn or more, if no turn
  /// lies within it, or for a number that is not finite: the joint must not be armed then
  bool start(double raw_rad, double expected_rad, double tolerance_rad) noexcept TORSIO_REALTIME;
  /// The turn is unknown from now on.
  void reset() noexcept { is_started_ = false; }

  /// @param raw_rad one sample in each period, within plus or minus one turn; NaN where there is
  /// none
  Output step(double raw_rad) noexcept TORSIO_REALTIME;

 private:
  void set_turn(double raw_rad, double near_rad) noexcept;

  Settings settings_;
  bool is_started_ = false;
  double angle_rad_ = 0.0;
  std::uint32_t periods_ = 0;  ///< since the last sample that was taken
};

}  // namespace torsio

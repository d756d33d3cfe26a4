#pragma once

#include <cmath>

#include "torsio/core/random.hpp"

namespace torsio {

/// A rotary encoder that quantises, with a dither of its own noise.
///
///     y = LSB ⌊(q + o) / LSB + ½ + σ n⌋ − o,   n ~ N(0, 1),  LSB = 2π / 2^bits
///
/// plus the zero error. o is where the code edges lie, random within one LSB. Source: specification
/// 4.1.
class Encoder {
 public:
  struct Parameters {
    double bits = 19.0;
    double jitter_lsb = 0.5;  ///< σ
    double zero_rad = 0.0;    ///< zero error
  };

  /// Draws o. @throws Error unless 1 ≤ bits ≤ 40 and the jitter is not negative.
  Encoder(const Parameters& parameters, Random& random);

  /// @returns the measured angle [rad]
  [[nodiscard]] double read(double angle_rad, Random& random) const noexcept {
    const double code = (angle_rad + offset_rad_) * inverse_lsb_ + 0.5;
    return std::floor(code + jitter_lsb_ * random.normal()) * lsb_rad_ - offset_rad_ + zero_rad_;
  }
  /// @returns the angle of one code [rad]
  [[nodiscard]] double resolution() const noexcept { return lsb_rad_; }

 private:
  double lsb_rad_;
  double inverse_lsb_;
  double jitter_lsb_;
  double offset_rad_;
  double zero_rad_;
};

}  // namespace torsio

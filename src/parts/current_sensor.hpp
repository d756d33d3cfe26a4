#pragma once

#include "torsio/core/random.hpp"

namespace torsio {

/// The motor current as the drive reports it: white noise on top. Source: specification 4.1.
class CurrentSensor {
 public:
  struct Parameters {
    double noise_A = 0.0;  ///< one standard deviation
  };

  /// @throws Error if the noise is negative.
  explicit CurrentSensor(const Parameters& parameters);
  [[nodiscard]] double read(double current_A, Random& random) const noexcept {
    return current_A + noise_A_ * random.normal();
  }

 private:
  double noise_A_;
};

}  // namespace torsio

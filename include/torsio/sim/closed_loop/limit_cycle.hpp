#pragma once

namespace torsio {

/// A motion that a loop keeps up by itself.
struct LimitCycle {
  double frequency_Hz = 0.0;
  double amplitude = 0.0;  ///< in the unit of the error
};

}  // namespace torsio

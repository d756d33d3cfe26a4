#pragma once

#include <string>
#include <vector>

#include "torsio/core/estimate.hpp"

namespace torsio {

/// How a target was computed from a known load, instead of being measured (docs/use/known_load.md). Plain data, part of
/// the card of a model that is trained on it. A load that was not used has no `file`.
///
///     T(q, q'') = gravity_Nm sin(q + zero_rad) + inertia_kg_m2 q''
struct LoadTarget {
  /// The load of one recording.
  struct OfRecording {
    std::string recording;
    double gravity_Nm = 0.0;
    double inertia_kg_m2 = 0.0;
    double zero_rad = 0.0;
    double motion_error_Nm = 0.0;  ///< `LoadTarget::motion_error_Nm` of this recording
    bool operator==(const OfRecording&) const = default;
  };
  /// RMS of what one standard error of a fact changes in the target.
  struct OfFact {
    std::string fact;  ///< as in the load file: "mass"
    double error_Nm = 0.0;
    bool operator==(const OfFact&) const = default;
  };
  /// A fact that was estimated from the recordings.
  struct Fitted {
    std::string fact;  ///< "joint_inertia", "zero"
    double value = 0.0;
    double standard_error = kNotMeasured;
    bool operator==(const Fitted&) const = default;
  };

  std::string file = {};                        ///< the load file
  std::vector<std::string> computed_from = {};  ///< channels: the angle, and conditions
  double half_width_s = 0.0;                    ///< polynomial of order 4 that gives q''
  double motion_error_Nm =
      0.0;  ///< RMS: noise of the encoder, and bandwidth that the polynomial loses
  double load_error_Nm = 0.0;  ///< RMS of the errors of all facts together
  std::vector<OfRecording> loads = {};
  std::vector<OfFact> facts = {};
  std::vector<Fitted> fitted = {};
  bool operator==(const LoadTarget&) const = default;

  [[nodiscard]] bool is_used() const noexcept { return !file.empty(); }
};

}  // namespace torsio

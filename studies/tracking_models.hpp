#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "torsio/control/model_inverse.hpp"
#include "torsio/data/dataset.hpp"
#include "torsio/sim/closed_loop/tracking.hpp"

namespace torsio {

/// A family in the inverse of a loop.
struct LoopFamily {
  std::string_view name;
  bool is_swapped = false;  ///< trained with the deflection as its target, not inverted
  const char* papers_name = "";
};
inline constexpr LoopFamily kLoopMixture{"dgmm", false, "DGMM"};
inline constexpr LoopFamily kLoopNetwork{"mlp", true, "NN"};
inline constexpr LoopFamily kLoopLine{"linear", false, "linear"};

/// Which recordings of a torque loop are added to a training.
struct TorqueModeSpec {
  std::string actuator;
  double amplitude_Nm = 0.0;  ///< amplitude of the test; the recordings have other ones
  JointOutput output = JointOutput::locked;
  TorqueReference::Kind kind = TorqueReference::Kind::chirp;
  std::uint64_t seed = 1;
  std::optional<double> duration_s = {};
};

/// The torque-mode recordings beside the sweeps: chirps (or walks) under the linear controller of
/// the data sheet, other amplitudes, the same output (specification 6, observation 1).
// NOLINTNEXTLINE(readability-inconsistent-declaration-parameter-name)
void add_torque_mode(Dataset& dataset, const TorqueModeSpec& spec);

/// The inverse of a family for a loop, trained on these data.
[[nodiscard]] AnyInverse learned_inverse(const LoopFamily& family, const Dataset& dataset,
                                         std::uint64_t seed);

}  // namespace torsio

#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>

#include "fleet/calibration.hpp"
#include "torsio/data/dataset.hpp"

namespace torsio {

/// Faults of production that a simulated joint may have.
enum class ProductionFault : std::uint8_t {
  soft_spring,    ///< stiffness 8 % lower
  hard_spring,    ///< stiffness 8 % higher
  rough_spring,   ///< friction of the spring 1.5 times
  shifted_zero,   ///< an encoder's zero off by 0.3 deg
  encoder_error,  ///< an encoder with an error of 0.05 deg, 8 periods a turn
  loose_load_cell,  ///< the zero of the load cell moves by up to 1 % of its range when the load changes its sign
};
[[nodiscard]] std::string_view name(ProductionFault fault) noexcept;
/// The trait by which it is to be found.
[[nodiscard]] JointTrait trait_of(ProductionFault fault) noexcept;

/// The serial numbers of the fleet that have a fault: `faults` of them, all kinds in turn.
[[nodiscard]] std::map<std::uint64_t, ProductionFault> planted_faults(const SimulatedFleet& fleet,
                                                                      std::uint64_t seed);

/// Recordings of a specimen as a production line would make them: noise with the output locked and a sweep with a lever to
/// train on, other noise to test.
[[nodiscard]] Dataset production_recordings(const std::string& specimen,
                                            std::optional<ProductionFault> fault,
                                            std::uint64_t seed, const Progress& progress);

}  // namespace torsio

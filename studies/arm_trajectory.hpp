#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>
#include <vector>

#include "torsio/core/progress.hpp"
#include "torsio/data/recording.hpp"
#include "torsio/sim/arm/arm_setup.hpp"

namespace torsio {

/// A joint of the arm whose torques are compared.
struct ArmPart {
  std::string_view joint;     ///< as the paper's Table 3 names it
  std::string_view actuator;  ///< data sheet
  std::size_t index;          ///< among the joints of `arm6_setup`
};

/// Joints 2 to 4 of the arm of paper 000, section 6.4.
inline constexpr std::array kArm{ArmPart{"joint 2 (300 Nm)", "dfki-300", 1},
                                 ArmPart{"joint 3 (120 Nm)", "dfki-120", 2},
                                 ArmPart{"joint 4 (28 Nm)", "dfki-28", 3}};
inline constexpr std::size_t kArmJoints = kArm.size();

/// Random configurations of the arm [rad], one angle per joint. Every joint of `kArm` travels between two of them at
/// least half as far as the one that travels the most, and that at least 45 deg: a joint that creeps sticks and slips,
/// for which (16) has no term.
[[nodiscard]] std::vector<std::vector<double>> arm_configurations(std::size_t segments,
                                                                  std::uint64_t seed);

/// The joints of `kArm` while `arm6_setup` with its payload moves through these configurations under the controller of the
/// whole arm: moves of least jerk from rest to rest, every joint at up to 25 deg/s and 30 deg/s², with the elasticity of
/// the gears and all torques that the joints exert on each other. Channels as on the bench: three angles, current and load
/// cell.
/// @throws Error if the arm stops; Cancelled.
[[nodiscard]] std::array<Recording, kArmJoints> record_arm(
    const std::vector<std::vector<double>>& configurations, std::uint64_t seed,
    const Progress& progress);

}  // namespace torsio

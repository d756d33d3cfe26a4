#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

#include "torsio/core/progress.hpp"
#include "torsio/data/recording.hpp"

namespace torsio {

/// A joint of the arm and its link, up to the next joint or the hand.
struct ArmPart {
  std::string_view joint;     ///< as the paper's Table 3 names it
  std::string_view actuator;  ///< data sheet
  double length_m;
  double link_kg;  ///< at half the length
  double tip_kg;   ///< at the end: the next actuators or the payload
};

/// Joints 2 to 4 of the arm of paper 000, section 6.4, whose axes are taken as horizontal and
/// parallel. The paper prints the actuators (in Table 1 the 120 Nm actuator weighs 3.9 kg and a
/// 28 Nm actuator 0.9 kg); every length, the masses of the links and the payload are assumed.
/// Stretched out level, they load the joints with 122, 49 and 12 Nm, within the ratings.
inline constexpr std::array kArm{
    ArmPart{"joint 2 (300 Nm)", "dfki-300", 0.45, 4.0, 3.9},  // upper arm; actuator of joint 3
    ArmPart{"joint 3 (120 Nm)", "dfki-120", 0.40, 2.5, 0.9},  // forearm; actuator of joint 4
    ArmPart{"joint 4 (28 Nm)", "dfki-28", 0.20, 2.3, 5.0}};   // wrist with joints 5 and 6; payload
inline constexpr std::size_t kArmJoints = kArm.size();

using ArmAngles = std::array<double, kArmJoints>;  ///< [rad]; all 0: the arm hangs down

/// Torque of gravity on each joint [Nm], along its angle.
[[nodiscard]] ArmAngles arm_gravity_torques(const ArmAngles& angles_rad);
/// Inertia about each joint of everything that it moves, stretched out [kg m²].
[[nodiscard]] ArmAngles arm_inertias();

/// The joints of the arm while it moves through random configurations: quintic segments in joint
/// space from rest to rest, synchronous, the fastest joint at up to 25 deg/s and 30 deg/s², each
/// other at half its speed at least. Each joint is a simulated bench under the position loop of its
/// motor, with the inertia of the stretched arm and the torque of gravity at the angles of all three
/// as its load, updated every ms. Torques of acceleration that joints exert on each other are left
/// out. Channels as on the bench: three angles, current and load cell.
/// @throws Error if a plant refuses its load; Cancelled.
[[nodiscard]] std::array<Recording, kArmJoints> record_arm(std::size_t segments, std::uint64_t seed,
                                                           const Progress& progress);

}  // namespace torsio

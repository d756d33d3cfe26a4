#pragma once

#include <cstdint>

#include "torsio/signal/excitation.hpp"

// The torques that the benches of more than one family ask for (SPEC section 4.7).

namespace torsio {

constexpr double kTorqueTest_s = 100.0;
/// Highest amplitude of a walk as a share of the rating: four of its standard deviations reach it.
constexpr double kWalkAmplitude = 0.35;

/// 0.01 to 0.3 Hz over 100 s.
[[nodiscard]] Chirp torque_chirp(double amplitude_Nm);

/// White steps behind a 1 Hz filter. Its first 100 s have, for every seed, the RMS that those of
/// `torque_chirp(amplitude_Nm)` have.
[[nodiscard]] RandomWalk torque_walk(double amplitude_Nm, std::uint64_t seed);

}  // namespace torsio

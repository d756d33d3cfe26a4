#pragma once

#include <cstdint>
#include <functional>
#include <string>

#include "sim/plant/plant.hpp"
#include "torsio/actuator/data_sheet.hpp"
#include "torsio/signal/excitation.hpp"
#include "torsio/sim/experiments/experiment.hpp"

// The torques that the benches of more than one family ask for (specification 4.7).

namespace torsio {

constexpr double kTorqueTest_s = 100.0;
/// Highest amplitude of a walk as a share of the rating: four of its standard deviations reach it.
constexpr double kWalkAmplitude = 0.35;

/// Specification 6 asks 13 Nm of dfki-50 and 20 Nm of dfki-120, 0.26 and 0.17 of their ratings; of
/// others we ask the fifth part.
[[nodiscard]] double usual_torque_amplitude(const DataSheet& sheet);

/// 0.01 to 0.3 Hz over 100 s.
[[nodiscard]] Chirp torque_chirp(double amplitude_Nm);

/// White steps, filtered at 1 Hz. Its first 100 s have, for every seed, the RMS that those of
/// `torque_chirp(amplitude_Nm)` have.
[[nodiscard]] BandLimitedNoise torque_walk(double amplitude_Nm, std::uint64_t seed);

/// The mass on the levers of the benches.
constexpr double kLeverMass_kg = 9.0;
/// Distance from the axis at which its weight, held level, is a share of the actuator's rated torque.
[[nodiscard]] double lever_m(const DataSheet& sheet, double share_of_rated);

/// The lever with its mass. @throws UsageError if it is too heavy for the actuator.
[[nodiscard]] Load bearable_lever(const DataSheet& sheet, const ExperimentSpec& spec,
                                  double mass_kg, double length_m);

/// A lever that a torque is to move.
struct Swing {
  std::string place;  ///< for messages
  Load load;
  double duration_s = 0.0;
  std::function<double()> reference;  ///< from its start
};
/// Looks at what the joint does under a torque that is exactly the reference.
/// @throws UsageError if the lever comes so far that it may tip over.
void check_swing(const Swing& swing, const DataSheet& sheet);

}  // namespace torsio

#include "sim/experiments/torque_references.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "sim/experiments/experiment_table.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/units.hpp"

namespace torsio {
namespace {

constexpr double kUpright_rad = rad_from_deg(60.0);  // a lever driven further may tip over

/// Over the length of the test, without the mean taken off.
double rms(auto reference) {
  const auto samples = static_cast<int>(kTorqueTest_s * kBenchRate_Hz);
  double squares = 0.0;
  for (int i = 0; i < samples; ++i) {
    const double value = reference.step();
    squares += value * value;
  }
  return std::sqrt(squares / samples);
}

}  // namespace

double usual_torque_amplitude(const DataSheet& sheet) {
  if (sheet.name == "dfki-50") return 13.0;
  if (sheet.name == "dfki-120") return 20.0;
  return 0.2 * sheet.rating.torque_Nm.value;
}

Chirp torque_chirp(double amplitude_Nm) {
  return {{.amplitude = amplitude_Nm, .start_Hz = 0.01, .end_Hz = 0.3, .duration_s = kTorqueTest_s},
          kBenchRate_Hz};
}

BandLimitedNoise torque_walk(double amplitude_Nm, std::uint64_t seed) {
  // The sensors draw from `seed` itself.
  const BandLimitedNoise of_one({.rms = 1.0, .cutoff_Hz = 1.0, .seed = ~seed}, kBenchRate_Hz);
  const double scale = rms(torque_chirp(amplitude_Nm)) / rms(of_one);
  return {{.rms = scale, .cutoff_Hz = 1.0, .seed = ~seed}, kBenchRate_Hz};
}

double lever_m(const DataSheet& sheet, double share_of_rated) {
  return share_of_rated * sheet.rating.torque_Nm.value / lever(kLeverMass_kg, 1.0).gravity_Nm;
}

Load bearable_lever(const DataSheet& sheet, const ExperimentSpec& spec, double mass_kg,
                    double length_m) {
  const Load load = lever(mass_kg, length_m, spec.inclination_rad);
  if (std::abs(load.gravity_Nm) <= sheet.rating.torque_Nm.value) return load;
  throw UsageError(
      {.place = spec.experiment,
       .problem = "the lever is too heavy for the actuator",
       .expected = fmt::format("at most the {} Nm that {} is rated for",
                               sheet.rating.torque_Nm.value, sheet.name),
       .found = fmt::format("{:.1f} Nm ({} kg at {} m)", load.gravity_Nm, mass_kg, length_m),
       .advice = "take a shorter lever, or incline it"});
}

void check_swing(const Swing& swing, const DataSheet& sheet) {
  const double inertia_kg_m2 = swing.load.inertia_kg_m2 + sheet.joint.inertia_kg_m2.value;
  const double period_s = 1.0 / kBenchRate_Hz;
  double angle_rad = 0.0;
  double speed_rad_s = 0.0;
  double largest_Nm = 0.0;
  const auto ticks = static_cast<std::size_t>(std::lround(swing.duration_s * kBenchRate_Hz));
  for (std::size_t tick = 0; tick < ticks; ++tick) {
    const double wanted_Nm = swing.reference();
    largest_Nm = std::max(largest_Nm, std::abs(wanted_Nm));
    const double torque_Nm = wanted_Nm - swing.load.gravity_Nm * std::sin(angle_rad) -
                             sheet.joint.viscous_Nms_rad.value * speed_rad_s;
    speed_rad_s += period_s * torque_Nm / inertia_kg_m2;
    angle_rad += period_s * speed_rad_s;
    if (std::abs(angle_rad) < kUpright_rad) continue;
    throw UsageError(
        {.place = swing.place,
         .problem = "the torque would tip the lever over",
         .expected = fmt::format("no more than {:.0f} deg of swing", deg_from_rad(kUpright_rad)),
         .found = fmt::format("a torque of {:.4g} Nm on a lever that takes {:.1f} Nm to hold level",
                              largest_Nm, swing.load.gravity_Nm),
         .advice = "lower the amplitude, lengthen the lever, or leave it out to lock the output"});
  }
}

}  // namespace torsio

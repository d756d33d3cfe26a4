#include "sim/loops/bench_impedance_loop.hpp"

#include <fmt/format.h>

#include <cmath>
#include <variant>

#include "torsio/core/error.hpp"

namespace torsio {

BenchImpedanceLoop::BenchImpedanceLoop(const PlantParameters& plant, const Gains& gains,
                                       Twist twist)
    : gains_(gains),
      twist_(twist),
      inverse_torque_constant_(1.0 / plant.motor.torque_constant_Nm_A) {
  const auto* const tube = std::get_if<Gear::Parameters>(&plant.first);
  const auto* const gear = std::get_if<Gear::Parameters>(&plant.second);
  if (tube == nullptr || gear == nullptr)
    throw Error({.place = "impedance loop",
                 .problem = "the plant has no torsion tube before a gear",
                 .expected = "two gears",
                 .found = tube == nullptr ? "a clutch" : "a spring after the gear"});
  inverse_tube_ratio_ = 1.0 / tube->ratio;
  gear_ratio_ = gear->ratio;
  if (!(gains.position >= 0.0 && gains.torque_Nm_rad >= 0.0 &&
        std::isfinite(gains.position + gains.torque_Nm_rad)))
    throw Error({.place = "impedance loop",
                 .problem = "impossible gain",
                 .expected = "gains >= 0 and finite",
                 .found = fmt::format("{}, {} Nm/rad", gains.position, gains.torque_Nm_rad)});
}

}  // namespace torsio

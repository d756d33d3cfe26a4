#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <numbers>
#include <string>
#include <vector>

#include "sim/bench/bench.hpp"
#include "sim/sensors/bench_log.hpp"
#include "torsio/core/random.hpp"
#include "torsio/data/recording.hpp"
#include "torsio/signal/excitation.hpp"

namespace torsio::test {

/// A simulated bench whose rotor is held while a torque of any shape pulls on the output.
/// @param torque_Nm the next value, called at every tick of `kBenchRate_Hz`
inline Recording pulled(const std::string& actuator, const std::string& name, double duration_s,
                        std::uint64_t seed, const std::function<double()>& torque_Nm,
                        const OperatingConditions& conditions = {}) {
  const DataSheet sheet = aged(data_sheet(actuator), conditions.age);
  const BenchProgram program{
      .start = {}, .duration_s = duration_s, .next = [&](const Measurement&) -> BenchAction {
        return {.command = {.is_motor_held = true}, .load = {.external_torque_Nm = torque_Nm()}};
      }};
  const FaultSchedule none;
  Bench bench(sheet,
              {.name = name,
               .duration_s = duration_s,
               .seed = seed,
               .conditions = conditions,
               .faults = none},
              program);
  const auto ticks = static_cast<std::size_t>(std::lround(duration_s * kBenchRate_Hz));
  BenchLog log(sheet, ticks, false);
  for (std::size_t tick = 0; tick < ticks; ++tick) {
    const Measurement measured = bench.sense();
    log.add(measured, bench.truth());
    bench.act(program.next(measured));
  }
  return log.finish(name);
}

struct TorqueTriangle {
  double amplitude_Nm = 1.0;
  double frequency_Hz = 1.0;
  double centre_Nm = 0.0;
};

/// Triangles; the torque first rises to the centre within a second.
inline Recording pulled_triangles(const std::string& actuator, const TorqueTriangle& wave,
                                  double duration_s, std::uint64_t seed,
                                  const OperatingConditions& conditions = {}) {
  Triangle triangle({.amplitude = wave.amplitude_Nm, .frequency_Hz = wave.frequency_Hz},
                    kBenchRate_Hz);
  double share = 0.0;
  return pulled(
      actuator, "triangles " + std::to_string(seed), duration_s, seed,
      [&] {
        share = std::min(1.0, share + 1.0 / kBenchRate_Hz);
        return share * wave.centre_Nm + triangle.step();
      },
      conditions);
}

/// Strokes between random torques within +-`largest_Nm`, each at a random frequency; half of the
/// strokes are small.
inline Recording pulled_at_random(const std::string& actuator, double largest_Nm, double lowest_Hz,
                                  double highest_Hz, double duration_s, std::uint64_t seed,
                                  const OperatingConditions& conditions = {}) {
  Random random(seed);
  double from_Nm = 0.0;
  double to_Nm = 0.0;
  double phase = 1.0;
  double step = 0.0;
  double sign = -1.0;
  return pulled(
      actuator, "random " + std::to_string(seed), duration_s, seed,
      [&] {
        if (phase >= 1.0) {
          from_Nm = to_Nm;
          const double amplitude_Nm = largest_Nm * std::exp2(-3.0 * random.uniform());
          // Each stroke reverses; from near a limit it leads away from it.
          sign = std::abs(from_Nm) > 0.8 * largest_Nm ? -std::copysign(1.0, from_Nm) : -sign;
          to_Nm = std::clamp(from_Nm + sign * 2.0 * amplitude_Nm, -largest_Nm, largest_Nm);
          const double frequency_Hz =
              lowest_Hz * std::pow(highest_Hz / lowest_Hz, random.uniform());
          step = 2.0 * frequency_Hz / kBenchRate_Hz;
          phase = 0.0;
        }
        phase += step;
        // Half a cosine: the speed has no jumps.
        return from_Nm +
               (to_Nm - from_Nm) * 0.5 * (1.0 - std::cos(std::numbers::pi * std::min(phase, 1.0)));
      },
      conditions);
}

}  // namespace torsio::test

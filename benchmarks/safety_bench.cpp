#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "rows.hpp"
#include "torsio/safety/monitor.hpp"
#include "torsio/safety/redundancy.hpp"

namespace torsio::bench {
namespace {

constexpr std::size_t kTicks = 10'000;

/// Three estimates of a torque that swings, as current, gear and spring give them.
std::array<Estimate, 3> estimates(double t_s) {
  const double torque_Nm = 10.0 * std::sin(t_s);
  return {Estimate{.value = torque_Nm + 0.1, .std_dev = 1.0},
          Estimate{.value = torque_Nm, .std_dev = 0.5},
          Estimate{.value = torque_Nm - 0.1, .std_dev = 0.3}};
}

/// Errors of gear and spring have opposite signs: they share an encoder.
std::vector<double> error_correlation() { return {1.0, 0.2, 0.1, 0.2, 1.0, -0.3, 0.1, -0.3, 1.0}; }

/// Nanoseconds of `step(n, estimates)`; the inputs are computed before.
template <class Step>
Row row_of(const Step& step) {
  std::vector<std::array<Estimate, 3>> inputs;
  for (std::size_t n = 0; n < kTicks; ++n)
    inputs.push_back(estimates(1e-3 * static_cast<double>(n)));
  double sum = 0.0;
  const double seconds = best_seconds([&] {
    for (std::size_t n = 0; n < kTicks; ++n) sum += step(inputs[n]);
  });
  volatile double kept = sum;
  static_cast<void>(kept);
  return {.value = seconds / static_cast<double>(kTicks) * 1e9, .unit = "ns"};
}

}  // namespace

/// Three sources with correlated errors.
Row redundancy_step() {
  Redundancy redundancy(
      {.sources = {{.name = "current", .depends_on = {"current_sensor"}},
                   {.name = "gear", .depends_on = {"motor_encoder", "gear_encoder"}},
                   {.name = "spring", .depends_on = {"gear_encoder", "joint_encoder"}}},
       .correlation = error_correlation()});
  return row_of(
      [&](const std::array<Estimate, 3>& sources) { return redundancy.step(sources).value_Nm; });
}

/// Three sources, three pairs, eight signals with every check.
Row monitor_step() {
  MonitorSettings settings{.sources = {"current", "gear", "spring"},
                           .signals = {},
                           .pairs = {},
                           .correlation = error_correlation()};
  for (const char* name : {"a", "b", "c", "d", "e", "f", "g", "h"})
    settings.signals.push_back({.name = name,
                                .lowest = -10.0,
                                .highest = 10.0,
                                .largest_rate = 100.0,
                                .longest_age_s = 0.01,
                                .turn = 6.3,
                                .moves_with = name[0] == 'a' ? "" : "a",
                                .largest_hidden_travel = 20.0});
  for (const auto& [first, second] : {std::array<std::uint8_t, 2>{0, 1}, {0, 2}, {1, 2}})
    settings.pairs.push_back({.first = first,
                              .second = second,
                              .floor_Nm = 1.0,
                              .ceiling_Nm = 5.0,
                              .drift_limit_s = 0.05});
  Monitor monitor(settings);
  double t_s = 0.0;
  std::array<SignalSample, 8> signals;
  for (SignalSample& sample : signals) sample.value = 0.0;
  return row_of([&](const std::array<Estimate, 3>& sources) {
    t_s += 1e-3;
    for (SignalSample& sample : signals) sample.value = 0.01 * sources[0].value;
    static_cast<void>(monitor.step(t_s, sources, signals));
    static_cast<void>(monitor.arm(t_s));
    return monitor.is_watching() ? 1.0 : 0.0;
  });
}

}  // namespace torsio::bench

// What the tests of the monitor share: a joint with three sources, and a loop that steps its monitor.

#pragma once

#include <gtest/gtest.h>

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "support/numbers.hpp"
#include "torsio/safety/monitor.hpp"

namespace torsio::test {

using State = Monitor::State;

inline constexpr double kPeriod_s = 1e-3;

/// Three sources, a motor angle and a gear angle that moves with it, a temperature.
inline MonitorSettings joint() {
  return {
      .sources = {"current", "gear", "spring"},
      .signals = {{.name = "motor_angle_rad", .largest_rate = 1000.0},
                  {.name = "gear_angle_rad",
                   .lowest = -3.0,
                   .highest = 3.0,
                   .largest_rate = 10.0,
                   .longest_age_s = 0.01,
                   .moves_with = "motor_angle_rad",
                   .largest_hidden_travel = 1.5},
                  {.name = "motor_temperature_K", .lowest = 233.0, .highest = 393.0}},
      .pairs = {{.first = 0, .second = 1, .floor_Nm = 1.0, .ceiling_Nm = 4.0},
                {.first = 0, .second = 2, .floor_Nm = 1.0, .ceiling_Nm = 4.0},
                {.first = 1, .second = 2, .floor_Nm = 1.0, .ceiling_Nm = 4.0}},
      .correlation = {},
  };
}

/// One pair of sources, with a limit of its drift.
inline MonitorSettings with_drift() {
  MonitorSettings settings = joint();
  settings.pairs = {
      {.first = 0, .second = 1, .floor_Nm = 1.0, .drift_allowance = 0.25, .drift_limit_s = 0.0501}};
  return settings;
}

inline MonitorAction& action(MonitorSettings& settings, MonitorCheck check) {
  return settings.actions[static_cast<std::size_t>(check)];
}

inline std::uint32_t bit(MonitorCheck check) {
  return std::uint32_t{1} << static_cast<unsigned>(check);
}

/// A loop at 1 kHz with sound inputs, which a test changes.
struct Loop {
  explicit Loop(const MonitorSettings& settings = joint())
      : monitor(settings),
        sources(settings.sources.size(), Estimate{.value = 0.0, .std_dev = 0.1}),
        signals(settings.signals.size()) {
    for (SignalSample& sample : signals) sample.value = 0.0;
    if (signals.size() > 2) signals[2].value = 300.0;
  }

  State step(double period_s = kPeriod_s) {
    t_s += period_s;
    return monitor.step(t_s, sources, signals);
  }
  void step_for(int ticks) {
    for (int n = 0; n < ticks; ++n) (void)step();
  }
  /// Proven, armed and watching.
  void start() {
    step_for(60);
    ASSERT_EQ(monitor.state(), State::ready);
    ASSERT_TRUE(monitor.arm(t_s));
  }
  /// @returns ticks until it is stopped, the one that stops included; -1 if it does not within
  /// `most`
  int ticks_to_stop(int most = 5000) {
    for (int n = 1; n <= most; ++n)
      if (step() == State::stopped) return n;
    return -1;
  }
  [[nodiscard]] MonitorCheck reason() const { return monitor.reason().check; }
  [[nodiscard]] std::string text() const { return describe(monitor.reason(), monitor.settings()); }

  Monitor monitor;
  std::vector<Estimate> sources;
  std::vector<SignalSample> signals;
  double t_s = 100.0;
};

}  // namespace torsio::test

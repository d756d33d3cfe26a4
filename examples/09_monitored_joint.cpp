// Two torques of one joint, combined and compared; a monitor, a watchdog of commands and a brake:
//   09_monitored_joint
// With a monitor file, `torsio::load_monitor` gives estimators, redundancy and monitor in one object.
#include <array>
#include <cmath>
#include <cstdio>

#include "torsio/core/error.hpp"
#include "torsio/safety/command_watchdog.hpp"
#include "torsio/safety/monitor.hpp"
#include "torsio/safety/redundancy.hpp"

namespace {

constexpr double kStiffness_Nm_rad = 573.0;
constexpr double kTorquePerCurrent_Nm_A = 12.5;

/// Replace this by the registers of your drive. From 2 s on the current sensor reads 40 % too little.
struct Sample {
  double spring_deflection_rad;
  double motor_current_A;
};
Sample read_joint(int tick) {
  const double torque_Nm = 20.0 * std::sin(0.003 * tick);
  const double gain = tick < 2000 ? 1.0 : 0.6;
  return {torque_Nm / kStiffness_Nm_rad, gain * torque_Nm / kTorquePerCurrent_Nm_A};
}

int run() {
  torsio::Redundancy redundancy(
      {.sources = {{"spring", {"encoder"}}, {"current", {"current_sensor"}}}, .correlation = {}});
  torsio::MonitorSettings settings;
  settings.sources = {"spring", "current"};
  settings.signals = {{.name = "spring_deflection_rad", .lowest = -0.1, .highest = 0.1},
                      {.name = "motor_current_A", .lowest = -5.0, .highest = 5.0}};
  settings.pairs = {{.first = 0, .second = 1, .factor = 4.0, .floor_Nm = 3.0}};
  torsio::Monitor monitor(settings);  // throws if a limit is not valid
  torsio::CommandWatchdog watchdog({.timeout_s = 0.018});
  for (int tick = 0; tick < 2500; ++tick) {
    const double t_s = 1e-3 * tick;
    const std::int64_t now_ns = std::int64_t{1'000'000} * tick;
    const Sample joint = read_joint(tick);
    const std::array<torsio::Estimate, 2> torques{
        {{.value = kStiffness_Nm_rad * joint.spring_deflection_rad, .std_dev = 0.3},
         {.value = kTorquePerCurrent_Nm_A * joint.motor_current_A, .std_dev = 0.6}}};
    const std::array<torsio::SignalSample, 2> signals{
        {{joint.spring_deflection_rad}, {joint.motor_current_A}}};
    const torsio::FusedTorque torque = redundancy.step(torques);
    monitor.step(t_s, torques, signals);
    if (tick == 100) {  // the operator permits motion, and a command arrives in every tick
      watchdog.arm(now_ns);
      std::printf("armed: %s\n", monitor.arm(t_s) ? "yes" : "no");
    }
    const auto state =
        watchdog.step(now_ns, {.written_ns = now_ns, .is_valid = true}, torque.fault);
    const bool may_move = monitor.is_watching() && state == torsio::CommandWatchdog::State::running;
    // No torque and a closed brake unless both permit motion; `JointStop` stops in a controlled way.
    const double current_A = may_move ? torque.value_Nm / kTorquePerCurrent_Nm_A : 0.0;
    if (tick % 250 == 0)
      std::printf("t = %.2f s: %6.2f Nm +- %.2f, current %5.2f A, monitor %s, brake %s\n", t_s,
                  torque.value_Nm, torque.std_dev_Nm, current_A, name(monitor.state()).data(),
                  may_move ? "open" : "closed");
  }
  std::printf("at %.3f s: %s\n", monitor.reason().t_s,
              describe(monitor.reason(), settings).c_str());
  return 0;
}

}  // namespace

int main() {
  try {
    return run();
  } catch (const torsio::Error& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
}

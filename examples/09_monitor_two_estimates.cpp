// Two estimators (a monitor file: `load_monitor`), their combination, monitor, watchdog and brake.
#include <array>
#include <cmath>
#include <cstdio>

#include "example_joint.hpp"
#include "torsio/runtime.hpp"

constexpr double kStiffness_Nm_rad = 573.0;
constexpr double kTorquePerCurrent_Nm_A = 12.5;
struct Line {  // torque = slope x
  using Parameters = Line;
  double slope;
  [[nodiscard]] const Line& parameters() const noexcept { return *this; }
  [[nodiscard]] static std::size_t input_count() noexcept { return 1; }
  [[nodiscard]] static std::size_t parameter_count() noexcept { return 1; }
  void reset() noexcept {}
  [[nodiscard]] torsio::Estimate step(torsio::Features x) const noexcept {
    return {.value = slope * x[0]};
  }
};
static torsio::BasicEstimator<Line> line(const char* input, double slope, double std_dev_Nm) {
  torsio::EstimatorSettings settings;
  settings.features.inputs = {input};
  settings.sample_rate_Hz = 1000.0;
  settings.target = "torque_Nm";
  settings.ranges = {.lowest = {-50.0 / slope}, .highest = {50.0 / slope}};
  settings.fallback = {.intercept = 0.0, .slope = {slope}, .residual_std = std_dev_Nm};
  settings.residuals = {.edges = {-50.0, 50.0}, .std_dev = {std_dev_Nm}};
  return {settings, Line{slope}};
}
int main() try {
  auto spring = line("spring_deflection_rad", kStiffness_Nm_rad, 0.3);
  auto current = line("motor_current_A", kTorquePerCurrent_Nm_A, 0.6);
  torsio::Redundancy redundancy(
      {.sources = {{"spring", {"encoder"}}, {"current", {"current_sensor"}}}, .correlation = {}});
  torsio::MonitorSettings settings;
  settings.sources = {"spring", "current"};
  settings.signals = {{.name = "spring_deflection_rad", .lowest = -0.1, .highest = 0.1}};
  settings.pairs = {{.first = 0, .second = 1, .factor = 4.0, .floor_Nm = 3.0}};
  torsio::Monitor monitor(settings);  // throws if a limit is not valid
  torsio::CommandWatchdog watchdog({.timeout_s = 0.018});
  torsio::JointStop::Settings brake{.speed_rad_s = 1.0, .deceleration_rad_s2 = 5.0};
  brake.drive = example_joint().drive, brake.load_Nm = 20.0, brake.brake_static_Nm = 100.0,
  brake.brake_sliding_Nm = 80.0, brake.brake_engage_s = 0.02, brake.brake_release_s = 0.04;
  torsio::JointStop stop(brake, 1000.0);
  for (int tick = 0; tick < 2500; ++tick) {
    const double t_s = 1e-3 * tick;
    const std::int64_t now_ns = std::int64_t{1'000'000} * tick;
    // In place of the command and your drive's registers; from 2 s on the current sensor is wrong.
    const double wanted_Nm = 20.0 * std::sin(3.0 * t_s);
    const double deflection_rad = wanted_Nm / kStiffness_Nm_rad;
    const double measured_A = (tick < 2000 ? 1.0 : 0.6) * wanted_Nm / kTorquePerCurrent_Nm_A;
    const std::array torques{spring.step({&deflection_rad, 1}), current.step({&measured_A, 1})};
    const torsio::FusedTorque torque = redundancy.step(torques);
    monitor.step(t_s, torques, std::array<torsio::SignalSample, 1>{{{deflection_rad}}});
    if (tick == 100) watchdog.arm(now_ns);  // the operator permits motion
    const auto state = watchdog.step(now_ns, {now_ns, true}, torque.fault);
    const torsio::JointState measured{0.0, 0.0, torque.value_Nm};  // the drive is at rest here
    const auto reference =
        stop.reference({.mode = torsio::JointMode::torque, .torque_Nm = wanted_Nm}, measured);
    if (tick == 101 && monitor.arm(t_s)) (void)stop.release();
    if (!monitor.is_watching() || state != torsio::CommandWatchdog::State::running)
      stop.trigger(torsio::StopCategory::power_off);  // latched, until `release`
    const auto command = stop.step(reference.torque_Nm / kTorquePerCurrent_Nm_A, measured);
    if (tick % 250 == 0)
      std::printf("%.2f s: %.2f Nm +- %.2f, monitor %s, brake %s\n", t_s, torque.value_Nm,
                  torque.std_dev_Nm, name(monitor.state()).data(),
                  command.is_brake_open ? "open" : "closed");
  }
  std::puts(describe(monitor.reason(), settings).c_str());
} catch (const torsio::Error& error) {
  return std::fprintf(stderr, "%s\n", error.what()), 1;
}

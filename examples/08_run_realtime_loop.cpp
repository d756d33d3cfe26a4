// A torque loop at 1 kHz on its own thread: set-points arrive through a mailbox, a watchdog stops the
// joint when there are no more, and a recorder writes the measurements. The joint is simulated.
#include <array>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <exception>
#include <thread>

#include "example_joint.hpp"
#include "torsio/realtime.hpp"
#include "torsio/runtime.hpp"

namespace {

void print(const char* what, const torsio::DurationHistogram& times) {
  const auto us = [&](double part) { return 1e-3 * static_cast<double>(times.quantile_ns(part)); };
  std::printf("%-9s p50 %7.1f  p99 %7.1f  p99.9 %7.1f  max %7.1f us\n", what, us(0.5), us(0.99),
              us(0.999), 1e-3 * static_cast<double>(times.max_ns()));
}

void run(const char* recording) {
  const auto parts = example_joint();
  torsio::TorqueController controller(  // in a robot: AnyInverse::of a model file, example 06
      torsio::LinearInverse(parts.stiffness_Nm_rad),
      torsio::TorqueLoopCore::Settings{.deflection = {.joint = parts}}, 1000.0);
  torsio::CommandWatchdog watchdog({.timeout_s = 0.1});  // 18 ms is too short for a busy desktop
  torsio::Mailbox<double> wanted_Nm;
  torsio::Recorder recorder(recording, {.channels = {"wanted_torque_Nm", "torque_Nm"}});
  torsio::RealtimeLoop loop({.period_s = 1e-3, .stop_after_overruns = 1000});
  torsio::JointSample joint = {.gear_angle_rad = 0.0, .joint_angle_rad = 0.0};
  loop.start([&, rate_rad_s = 0.0](const torsio::Tick& tick) mutable noexcept {
    if (tick.index == 0) watchdog.arm(tick.due_ns);  // in a robot: on the operator's request
    const auto& letter = wanted_Nm.read();
    const bool is_valid = letter.sequence > 0 && std::isfinite(letter.value);
    double current_A = 0.0;
    if (watchdog.step(tick.due_ns, {letter.written_ns, is_valid}) ==
        torsio::CommandWatchdog::State::running)
      current_A = controller.step(letter.value, joint).current_A;
    else
      controller.reset();
    // The joint with locked output: J N² δ'' + b δ' + K δ = N k_t i.
    const double torque_Nm = parts.stiffness_Nm_rad * joint.gear_angle_rad;
    rate_rad_s += 1e-3 / parts.drive.inertia() *
                  (parts.drive.torque_per_current() * current_A - torque_Nm -
                   parts.drive.viscous_Nms_rad * rate_rad_s);
    joint.gear_angle_rad += 1e-3 * rate_rad_s;
    recorder.push(tick.index, std::array{letter.value, torque_Nm});
    return true;
  });
  torsio::MonotonicClock clock;
  for (int n = 0; n < 150; ++n) {
    wanted_Nm.write(std::array{5.0, -5.0, 10.0}.at(n / 50), clock.now_ns());
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  std::this_thread::sleep_for(std::chrono::milliseconds(200));  // no more set-points
  loop.request_stop();
  const torsio::LoopReport report = loop.wait();
  const torsio::RecorderReport recorded = recorder.close();
  std::printf("%s refused; %zu steps, %zu overruns, ended by %s; watchdog: %s, %s\n",
              report.grants.refused.empty() ? "nothing" : report.grants.refused.c_str(),
              report.steps, report.overruns, torsio::name(report.end),
              name(watchdog.state()).data(), name(watchdog.reason()).data());
  print("lateness", report.lateness);
  print("CPU time", report.cpu_time);
  std::printf("%zu frames recorded, %zu dropped\n", recorded.frames, recorded.dropped);
}

}  // namespace

int main(int argc, char** argv) try {
  run(argc > 1 && argv[1][0] != '-' ? argv[1] : "run.tsr");
} catch (const std::exception& error) {
  std::fprintf(stderr, "%s\n", error.what());
  return 1;
}

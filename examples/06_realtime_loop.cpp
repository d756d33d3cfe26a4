// A torque loop at 1 kHz on its own thread: set-points come in through a mailbox, what the loop saw
// goes out to a recorder. A simulated spring stands for the drive. Links torsio::runtime and
// torsio::realtime.
#include <array>
#include <chrono>
#include <cstdio>
#include <exception>
#include <thread>

#include "torsio/estimate/estimator.hpp"
#include "torsio/model/linear.hpp"
#include "torsio/realtime/mailbox.hpp"
#include "torsio/realtime/realtime_loop.hpp"
#include "torsio/realtime/recorder.hpp"

namespace {

constexpr double kPeriod_s = 1e-3;

torsio::BasicEstimator<torsio::Linear> spring_torque() {
  torsio::EstimatorSettings settings;
  settings.features.inputs = {"spring_deflection_rad"};
  settings.sample_rate_Hz = 1.0 / kPeriod_s;
  settings.target = "torque_Nm";
  settings.ranges = {.lowest = {-0.1}, .highest = {0.1}};
  settings.fallback = {.intercept = 0.0, .slope = {500.0}};
  torsio::Linear::Parameters parameters;
  parameters.coefficients.values = torsio::Matrix(1, 2);
  parameters.coefficients.values.values = {0.0, 500.0};
  return {settings, torsio::Linear(parameters)};
}

void print(const char* what, const torsio::DurationHistogram& times) {
  const auto us = [&](double part) { return 1e-3 * static_cast<double>(times.quantile_ns(part)); };
  std::printf("%-9s p50 %7.1f  p99 %7.1f  p99.9 %7.1f  max %7.1f us\n", what, us(0.5), us(0.99),
              us(0.999), 1e-3 * static_cast<double>(times.max_ns()));
}

void run(const char* recording) {
  torsio::Mailbox<double> wanted_Nm;
  torsio::Recorder recorder(recording,
                            {.channels = {"wanted_torque_Nm", "torque_Nm"}, .period_s = kPeriod_s});
  torsio::RealtimeLoop loop({.period_s = kPeriod_s, .stop_after_overruns = 1000});
  double deflection_rad = 0.0;
  loop.start([&, estimator = spring_torque()](const torsio::Tick& tick) mutable noexcept {
    constexpr std::int64_t kStaleInNs = 500'000'000;
    const auto& letter = wanted_Nm.read();
    // No command, or none any more: let go of the spring.
    const double wanted = letter.age_ns(tick.due_ns) < kStaleInNs ? letter.value : 0.0;
    const torsio::Estimate torque = estimator.step(std::array{deflection_rad});
    deflection_rad += kPeriod_s * 0.02 * (wanted - torque.value);  // the drive turns
    recorder.push(tick.index, std::array{wanted, torque.value});
    return true;
  });
  torsio::MonotonicClock clock;
  for (const double torque_Nm : {5.0, -5.0, 10.0, 0.0}) {
    wanted_Nm.write(torque_Nm, clock.now_ns());
    std::this_thread::sleep_for(std::chrono::milliseconds(250));
  }
  loop.request_stop();
  const torsio::LoopReport report = loop.wait();
  const torsio::RecorderReport recorded = recorder.close();
  std::printf("%s refused; %zu steps, %zu overruns, ended by %s\n",
              report.grants.refused.empty() ? "nothing" : report.grants.refused.c_str(),
              report.steps, report.overruns, torsio::name(report.end));
  print("lateness", report.lateness);
  print("CPU time", report.cpu_time);
  std::printf("%zu frames recorded, %zu dropped\n", recorded.frames, recorded.dropped);
}

}  // namespace

int main(int argc, char** argv) try {
  run(argc > 1 ? argv[1] : "run.tsr");
} catch (const std::exception& error) {
  std::fprintf(stderr, "%s\n", error.what());
  return 1;
}

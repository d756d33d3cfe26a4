// A step of the torque of a joint that is reached over its link, with a reference per millisecond, and its response:
//   torsio joint dfki-50 &
//   13_step_torque_of_remote_joint 5
// The argument is the step in Nm; a second one is the joint's address or the path of its socket.
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

#include "torsio/link.hpp"
#include "torsio/realtime.hpp"

namespace {

constexpr std::int64_t kPeriod_ns = 1'000'000;
constexpr int kCycles = 1000;
constexpr int kStepAt = 200;

struct Sample {
  double t_s = 0.0;
  double torque_Nm = 0.0;
};

void print_response(const std::vector<Sample>& response, double step_Nm) {
  if (response.empty()) return static_cast<void>(std::puts("no telemetry"));
  const auto largest = std::ranges::max_element(
      response, {}, [&](const Sample& each) { return each.torque_Nm / step_Nm; });
  std::printf("%zu samples: at most %.3f Nm, %.0f ms after the step; %.3f Nm at the end\n",
              response.size(), largest->torque_Nm, 1e3 * largest->t_s - kStepAt,
              response.back().torque_Nm);
}

void run(double step_Nm, const std::string& address) {
  torsio::JointLine line;
  (address[0] == '/' ? line.unix_path : line.host) = address;
  torsio::JointConnection joint(line, {.joint = 1});
  joint.subscribe({"torque_Nm"}, 1000.0);
  std::vector<Sample> response;
  std::uint64_t start_ns = 0;
  const auto keep = [&](const torsio::LinkTelemetry& telemetry) {
    if (start_ns == 0) start_ns = telemetry.time_ns;
    const double t_s = 1e-9 * static_cast<double>(telemetry.time_ns - start_ns);
    response.push_back({.t_s = t_s, .torque_Nm = double{telemetry.values.values[0]}});
  };
  torsio::MonotonicClock clock;
  joint.enable();  // from now on it stops without a reference within the time of its watchdog
  const std::int64_t begin_ns = clock.now_ns();
  for (int cycle = 0; cycle < kCycles; ++cycle) {
    const double torque_Nm = cycle < kStepAt ? 0.0 : step_Nm;
    joint.send({.mode = torsio::JointMode::torque, .torque_Nm = static_cast<float>(torque_Nm)});
    joint.poll(keep);
    clock.sleep_until(begin_ns + (cycle + 1) * kPeriod_ns);
  }
  joint.disable();
  for (const std::uint64_t refused : joint.counts().refused)
    if (refused > 0)
      std::printf("%zu references were refused\n", static_cast<std::size_t>(refused));
  print_response(response, step_Nm);
}

}  // namespace

int main(int argc, char** argv) try {
  run(argc > 1 ? std::atof(argv[1]) : 5.0, argc > 2 ? argv[2] : "127.0.0.1");
} catch (const std::exception& error) {
  std::fprintf(stderr, "%s\n", error.what());
  return 1;
}

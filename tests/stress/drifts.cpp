#include "stress/drifts.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <map>
#include <string>
#include <vector>

#include "sim/campaign/duty_recording.hpp"
#include "sim/campaign/monitor_recipe.hpp"
#include "sim/campaign/simulated_monitor.hpp"
#include "sim/plant/plant.hpp"
#include "support/bench_dataset.hpp"
#include "torsio/core/random.hpp"
#include "torsio/evaluate/monitor_replay.hpp"

namespace torsio::stress {
namespace {

constexpr double kDuration_s = 40.0;
constexpr std::size_t kRecordings = 8;
constexpr double kBars = 5.0;
constexpr std::size_t kLongest = 50;  ///< ticks
constexpr double kAllowed = 0.05;     ///< share of the drifts
constexpr double kWatching = 2.0;

/// What a monitor reports of one recording, tick by tick.
struct Watched {
  std::vector<double> torque_Nm;
  std::vector<double> std_dev_Nm;
  std::vector<double> state;
};

Watched watched(const MonitoredTorque& monitored, const Recording& recording) {
  const MonitorReplay replay = replay_monitor(monitored, recording);
  const auto values = [&](const char* name) {
    return replay.estimated.channels.channel(name).values;
  };
  return {values("estimated_torque_Nm"), values("torque_std_dev_Nm"), values("monitor_state_1")};
}

struct Joint {
  DataSheet sheet;
  MonitoredTorque monitored;
  std::vector<Recording> recordings;
  std::vector<Watched> sound;
};

Joint joint_of(const char* actuator, std::uint64_t seed) {
  const DataSheet sheet = data_sheet(actuator);
  Joint joint{
      .sheet = sheet,
      .monitored =
          calibrate_simulated(sheet, {.training_s = 800.0, .fault_free_hours = 1.0}).monitored(),
      .recordings = {},
      .sound = {}};
  for (std::size_t i = 0; i < kRecordings; ++i) {
    joint.recordings.push_back(with_source_delay(
        duty_recording(sheet, {.seed = 1000 * seed + i, .duration_s = kDuration_s})));
    joint.sound.push_back(watched(joint.monitored, joint.recordings.back()));
  }
  return joint;
}

struct Tally {
  std::size_t drifts = 0;
  std::size_t stopped = 0;
  std::size_t failures = 0;
  double worst_bars = 0.0;
  double largest_Nm = 0.0;
};

/// @returns what is wrong; empty if nothing
std::string problem_of(const Watched& sound, const Watched& now, std::size_t first, Tally& tally) {
  LongestRun longest;
  double worst = 0.0;
  for (std::size_t n = first; n < now.state.size(); ++n) {
    if (now.state[n] > kWatching) break;
    const double difference_Nm = std::abs(now.torque_Nm[n] - sound.torque_Nm[n]);
    const double error_bars = difference_Nm / now.std_dev_Nm[n];
    const bool is_watching = now.state[n] == kWatching && sound.state[n] == kWatching;
    const bool is_wrong = is_watching && error_bars > kBars;
    longest.add(is_wrong, n);
    if (is_watching) tally.largest_Nm = std::max(tally.largest_Nm, difference_Nm);
    if (is_wrong) worst = std::max(worst, error_bars);
  }
  if (std::ranges::find_if(now.state, [](double of) { return of > kWatching; }) != now.state.end())
    ++tally.stopped;
  tally.worst_bars = std::max(tally.worst_bars, worst);
  if (longest.ticks() <= kLongest) return {};
  return fmt::format("for {} ticks to tick {} beyond {} error bars, up to {:.1f}", longest.ticks(),
                     longest.last(), kBars, worst);
}

}  // namespace

Outcome drifting_sensors(const Settings& settings) {
  Outcome outcome;
  std::map<std::string, Tally> tallies;
  std::vector<std::string> wrong;
  std::vector<Joint> joints;
  for (const char* actuator : {"dfki-50#07", "dfki-28#07"})
    joints.push_back(joint_of(actuator, settings.seed));
  const Deadline deadline(settings.seconds);
  for (std::size_t n = 0; n < settings.count && !deadline.passed(); ++n) {
    Random random(settings.seed * 1'000'003 + n);
    const Joint& joint = joints[n % joints.size()];
    const double ratio = total_ratio(plant_parameters(joint.sheet));
    struct Sensor {
      const char* channel;
      double per_joint;  ///< 1 rad, or 1 Nm, at the joint in its unit
      double slowest;    ///< at the joint, per second
      double fastest;
    };
    const std::array<Sensor, 4> sensors{
        {{"motor_angle_rad", ratio, 2e-5, 2e-2},
         {"gear_angle_rad", 1.0, 2e-5, 2e-2},
         {"joint_angle_rad", 1.0, 2e-5, 2e-2},
         {"motor_current_A", 1.0 / (ratio * joint.sheet.motor.torque_constant_Nm_A.value), 0.02,
          20.0}}};
    const Sensor& sensor = sensors.at(n / joints.size() % sensors.size());
    const double share = random.uniform();
    const double speed = sensor.slowest * std::pow(sensor.fastest / sensor.slowest, share) *
                         (random.uniform() < 0.5 ? -1.0 : 1.0);
    const auto which = static_cast<std::size_t>(random.uniform() * 0.999 * kRecordings);
    const Recording& sound = joint.recordings[which];
    const double begin_s = 18.0 + 4.0 * random.uniform();
    const auto first = static_cast<std::size_t>(begin_s * sound.sample_rate_Hz());
    const Recording drifting = test::changed(sound, [&](Channel& channel) {
      if (channel.name != sensor.channel) return;
      for (std::size_t tick = first; tick < channel.values.size(); ++tick)
        channel.values[tick] +=
            speed * sensor.per_joint * static_cast<double>(tick - first) / sound.sample_rate_Hz();
    });
    Tally& tally = tallies[fmt::format("{:12} {}", joint.sheet.name, sensor.channel)];
    const std::string problem =
        problem_of(joint.sound[which], watched(joint.monitored, drifting), first, tally);
    ++tally.drifts;
    ++outcome.cases;
    if (problem.empty()) continue;
    ++tally.failures;
    wrong.push_back(fmt::format("drift {} ({}, {}, {:.2g} per s at the joint): {}", n,
                                joint.sheet.name, sensor.channel, speed, problem));
  }
  for (const auto& [name, tally] : tallies)
    outcome.rows.push_back(fmt::format(
        "{:30} {:4} drifts, {:4} stopped, {:3} wrong; combined torque at most {:.2f} Nm "
        "off before the stop, {:.1f} error bars",
        name, tally.drifts, tally.stopped, tally.failures, tally.largest_Nm, tally.worst_bars));
  outcome.add_wrong(wrong, kAllowed);
  return outcome;
}

}  // namespace torsio::stress

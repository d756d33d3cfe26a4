#pragma once

#include <cmath>
#include <cstdint>
#include <functional>
#include <string>
#include <utility>

#include "torsio/core/random.hpp"
#include "torsio/data/dataset.hpp"

namespace torsio::test {

/// What a made-up spring bench measures: torque = stiffness deflection + offset + friction, noise.
struct BenchOptions {
  double stiffness_Nm_rad = 500.0;
  double offset_Nm = 0.0;
  double friction_Nm = 1.0;
  double noise_Nm = 0.05;
  double amplitude_rad = 0.03;
  std::ptrdiff_t torque_delay = 0;  ///< samples by which the torque comes late
  std::size_t samples = 4000;
  std::uint64_t seed = 3;
};

/// Gear and joint angle and torque at 1 kHz: the joint swings slowly while the spring is wound to
/// and fro at two speeds.
inline Recording bench_recording(const std::string& name, const BenchOptions& options = {}) {
  Random random(options.seed);
  Channel gear{"gear_angle_rad", {}};
  Channel joint{"joint_angle_rad", {}};
  Channel torque{"torque_Nm", {}};
  const auto deflection = [&](double t_s) {
    return options.amplitude_rad * (0.7 * std::sin(4.0 * t_s) + 0.3 * std::sin(11.0 * t_s + 1.0));
  };
  for (std::size_t n = 0; n < options.samples; ++n) {
    const double t_s = 1e-3 * static_cast<double>(n);
    const double then_s = t_s - 1e-3 * static_cast<double>(options.torque_delay);
    const double rate = (deflection(then_s + 5e-4) - deflection(then_s - 5e-4)) / 1e-3;
    joint.values.push_back(0.4 * std::sin(0.9 * t_s));
    gear.values.push_back(joint.values.back() + deflection(t_s));
    torque.values.push_back(options.stiffness_Nm_rad * deflection(then_s) + options.offset_Nm +
                            options.friction_Nm * std::tanh(rate / 0.01) +
                            options.noise_Nm * random.normal());
  }
  Recording recording(name, 1000.0);
  recording.add(std::move(gear));
  recording.add(std::move(joint));
  recording.add(std::move(torque));
  return recording;
}

/// The recording with changed channels.
inline Recording changed(const Recording& recording, const std::function<void(Channel&)>& change) {
  Recording result(recording.name(), recording.sample_rate_Hz());
  for (Channel channel : recording.channels()) {
    change(channel);
    result.add(std::move(channel));
  }
  return result;
}

/// The recording with another torque.
inline Recording with_torque(const Recording& recording,
                             const std::function<void(Channel&)>& change) {
  return changed(recording, [&](Channel& channel) {
    if (channel.name == "torque_Nm") change(channel);
  });
}

inline void add_record(Dataset& dataset, Recording recording, Role role) {
  const std::size_t samples = recording.size();
  dataset.records.push_back({std::move(recording), whole_record(samples, role)});
}

/// Two recordings for training, one for the test.
inline Dataset bench_dataset() {
  Dataset dataset;
  add_record(dataset, bench_recording("first", {.seed = 1}), Role::train);
  add_record(dataset, bench_recording("second", {.amplitude_rad = 0.025, .seed = 2}), Role::train);
  add_record(dataset, bench_recording("held out", {.amplitude_rad = 0.027, .seed = 3}), Role::test);
  return dataset;
}

/// One recording, for training.
inline Dataset one_recording(const BenchOptions& options = {}) {
  Dataset dataset;
  add_record(dataset, bench_recording("joint", options), Role::train);
  return dataset;
}

}  // namespace torsio::test

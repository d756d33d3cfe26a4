#include "fault_classes.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>
#include <variant>

#include "actuator/second_stage.hpp"
#include "joint_monitor.hpp"
#include "sim/campaign/duty_recording.hpp"
#include "sim/faults/fault_rules.hpp"
#include "sim/plant/plant.hpp"
#include "sim/sensors/sensed_channels.hpp"

namespace torsio {
namespace {

constexpr double kCycles_s = 0.002;  // NaN, missing, invalid: two cycles
constexpr double kDisagreement_s = 0.02;
constexpr double kDrift_s = 0.1;
constexpr double kOverrun_s = 0.005;  // five steps of the loop, at 1 kHz
constexpr double kTypicalLoad =
    0.4;  // share of the largest torque, for a fault in proportion to it
constexpr double kTwistMargin = 1.5;

struct Sensor {
  std::string channel;
  double Measurement::*value;
  double torque_Nm;  ///< by which an estimate changes for 1 in the channel's unit, nominally
};

double first_stiffness(const DataSheet& sheet) {
  return std::visit([](const auto& stage) { return stage.stiffness_Nm_rad.value; }, sheet.first);
}
double first_ratio(const DataSheet& sheet) {
  return std::visit([](const auto& stage) { return stage.ratio.value; }, sheet.first);
}

/// The estimates are k (input - output) of the two stages, at the joint, and N k_t i.
double torque_per_unit(const DataSheet& sheet, const SensedChannel& channel, bool has_gear_source) {
  const double second = second_stage_stiffness(sheet);
  const double ratio = total_ratio(plant_parameters(sheet));
  const double second_ratio = ratio / first_ratio(sheet);
  // A stage of which no estimate is made counts for nothing.
  const double first = has_gear_source ? first_stiffness(sheet) * second_ratio : 0.0;
  if (channel.value == &Measurement::motor_angle_rad)
    return std::max(first / first_ratio(sheet),
                    sheet.family == ActuatorFamily::rubber_clutch ? second / ratio : 0.0) /
           channel.scale;
  if (channel.value == &Measurement::middle_angle_rad)
    return std::max(first, second / second_ratio);
  if (channel.value == &Measurement::motor_current_A)
    return ratio * sheet.motor.torque_constant_Nm_A.value / channel.scale;
  return second;
}

/// The sensors whose faults the monitor can see at all.
std::vector<Sensor> sensors_of(const DataSheet& sheet, const MonitoredTorque& monitored) {
  const bool has_middle = std::ranges::any_of(sensed_channels(sheet), [](const SensedChannel& of) {
    return of.value == &Measurement::middle_angle_rad;
  });
  std::vector<Sensor> sensors;
  for (const SensedChannel& channel : sensed_channels(sheet)) {
    if (channel.value == &Measurement::torque_Nm || !uses(monitored, channel.name)) continue;
    double torque_Nm = torque_per_unit(sheet, channel, has_middle);
    // Only speed and acceleration of this one are used: a turn counts as the largest torque.
    if (torque_Nm == 0.0) torque_Nm = duty_limits(sheet).torque_Nm / (2.0 * std::numbers::pi);
    sensors.push_back({std::string(channel.name), channel.value, torque_Nm});
  }
  return sensors;
}

double between_powers(Random& random, double lowest, double highest) {
  return lowest * std::pow(highest / lowest, random.uniform());
}
double sign(Random& random) { return random.uniform() < 0.5 ? -1.0 : 1.0; }

const Sensor& one_of(const std::vector<Sensor>& sensors, Random& random) {
  return sensors[random.below(sensors.size())];
}

/// Below 1: the factor of a part or a sensor whose loss makes this disagreement at a typical load.
double factor_for(Random& random, double size) {
  const double change = std::min(size / kTypicalLoad, 0.9);
  return random.uniform() < 0.7 ? 1.0 - change : 1.0 + 2.0 * change;
}

class Classes {
 public:
  Classes(const DataSheet& sheet, const MonitoredTorque& monitored)
      : torque_Nm_(duty_limits(sheet).torque_Nm), sensors_(sensors_of(sheet, monitored)) {
    for (const Sensor& sensor : sensors_)
      if (sensor.value != &Measurement::motor_current_A) encoders_.push_back(sensor);
    add_encoder_classes();
    add_current_classes();
    add_part_classes(sheet);
    add_signal_classes();
    add_loop_classes(monitored);
  }
  std::vector<FaultClass> take() && { return std::move(classes_); }

 private:
  using Draw = std::function<DrawnFault(Random&, double)>;

  void add(FaultClass of, Draw draw) {
    of.draw = std::move(draw);
    classes_.push_back(std::move(of));
  }
  static DrawnFault fault(ScheduledFault of) { return {.faults = {std::move(of)}}; }

  void add_encoder_classes() {
    for (const Sensor& sensor : encoders_)
      add({.name = "freeze " + sensor.channel, .row = 1}, [sensor](Random&, double) {
        return fault({.what = sensor.channel, .kind = FaultKind::freeze});
      });
    for (const Sensor& sensor : encoders_) {
      if (sensor.value != &Measurement::middle_angle_rad) continue;
      const double unit = torque_Nm_ / sensor.torque_Nm;
      add({.name = "offset " + sensor.channel, .row = 2, .has_size = true},
          [sensor, unit](Random& random, double size) {
            return fault({.what = sensor.channel,
                          .kind = FaultKind::jump,
                          .amount = sign(random) * size * unit});
          });
      add({.name = "drift " + sensor.channel, .row = 2, .limit_s = kDrift_s},
          [sensor, unit](Random& random, double size) {
            return fault({.what = sensor.channel,
                          .kind = FaultKind::drift,
                          .amount = sign(random) * size * unit / between_powers(random, 0.2, 5.0)});
          });
    }
    for (const Sensor& sensor : sensors_)
      add({.name = "sign " + sensor.channel, .row = 9}, [sensor](Random&, double) {
        return fault({.what = sensor.channel, .kind = FaultKind::sign_flip});
      });
  }

  void add_current_classes() {
    for (const Sensor& sensor : sensors_) {
      if (sensor.value != &Measurement::motor_current_A) continue;
      const auto torque_constant = [](bool drifts) {
        return [drifts](Random& random, double size) {
          const double amount = factor_for(random, size);
          return fault({.what = "torque-constant",
                        .kind = FaultKind::drift,
                        .amount = amount,
                        .over_s = drifts ? between_powers(random, 0.1, 10.0) : 0.0});
        };
      };
      add({.name = "torque constant", .row = 3, .has_size = true}, torque_constant(false));
      add({.name = "drift torque constant", .row = 3, .limit_s = kDrift_s}, torque_constant(true));
      add({.name = "gain " + sensor.channel, .row = 4, .has_size = true}, [sensor](Random& random,
                                                                                   double size) {
        return fault(
            {.what = sensor.channel, .kind = FaultKind::gain, .amount = factor_for(random, size)});
      });
      const double unit = torque_Nm_ / sensor.torque_Nm;
      add({.name = "offset " + sensor.channel, .row = 4, .has_size = true},
          [sensor, unit](Random& random, double size) {
            return fault({.what = sensor.channel,
                          .kind = FaultKind::jump,
                          .amount = sign(random) * size * unit});
          });
    }
  }

  void add_part_classes(const DataSheet& sheet) {
    const std::string part = fault_parts(sheet).front();
    add({.name = "broken " + part, .row = 6, .onset = FaultOnset::parts},
        [part](Random& random, double size) {
          return fault({.what = part,
                        .kind = FaultKind::broken,
                        .amount = random.uniform(0.0, std::max(0.6 - 0.4 * size, 0.0))});
        });
    const double stiffness_Nm_rad =
        std::min(10.0 * second_stage_stiffness(sheet), 0.9 * stiffest_stop(sheet));
    const double twist_rad = torque_Nm_ / second_stage_stiffness(sheet);
    add({.name = "bottomed " + part, .row = 6, .onset = FaultOnset::parts},
        [part, stiffness_Nm_rad, twist_rad](Random& random, double size) {
          return fault(
              {.what = part,
               .kind = FaultKind::bottom,
               .amount = std::max(random.uniform(0.05, 0.4) * twist_rad / (1.0 + size), 1.1e-4),
               .stop_stiffness_Nm_rad = stiffness_Nm_rad});
        });
  }

  void add_signal_classes() {
    const auto spike = [this](bool repeats) {
      return [sensors = sensors_, torque_Nm = torque_Nm_, repeats](Random& random, double size) {
        const Sensor& sensor = one_of(sensors, random);
        const bool is_angle = sensor.value != &Measurement::motor_current_A;
        const double largest = is_angle ? std::numbers::pi : 1e5;
        const double amount =
            size * between_powers(random, 1.0, 30.0) * torque_Nm / sensor.torque_Nm;
        return fault({.what = sensor.channel,
                      .kind = FaultKind::spike,
                      .amount = sign(random) * std::clamp(amount, 1e-6, largest),
                      .every_s = repeats ? 0.001 * static_cast<double>(2 + random.below(4)) : 0.0});
      };
    };
    add({.name = "spike",
         .row = 10,
         .onset = FaultOnset::injection,
         .must_stop = false,
         .is_loop_sound = true},
        spike(false));
    add({.name = "spikes", .row = 10, .limit_s = kDrift_s}, spike(true));
    const auto simple = [this](FaultKind kind) {
      return [sensors = sensors_, kind](Random& random, double) {
        return fault({.what = one_of(sensors, random).channel, .kind = kind});
      };
    };
    add({.name = "silent", .row = 11, .onset = FaultOnset::injection, .limit_s = kCycles_s},
        simple(FaultKind::dropout));
    add({.name = "nan", .row = 14, .onset = FaultOnset::injection, .limit_s = kCycles_s},
        simple(FaultKind::nan));
    add({.name = "wrap", .row = 7, .onset = FaultOnset::injection, .limit_s = kDisagreement_s},
        [encoders = encoders_](Random& random, double) {
          return fault({.what = one_of(encoders, random).channel,
                        .kind = FaultKind::wrap,
                        .amount = sign(random) * static_cast<double>(1 + random.below(3))});
        });
    add({.name = "zero at start", .row = 8, .onset = FaultOnset::start, .is_loop_sound = true},
        [encoders = encoders_](Random& random, double) {
          return fault({.what = one_of(encoders, random).channel,
                        .kind = FaultKind::zero,
                        .duration_s = random.uniform(0.5, 5.0)});
        });
  }

  void add_loop_classes(const MonitoredTorque& monitored) {
    const std::size_t sources = monitored.estimates().size();
    add({.name = "model not finite",
         .row = 14,
         .onset = FaultOnset::injection,
         .limit_s = kDisagreement_s},
        [sources](Random& random, double) {
          return DrawnFault{.failed_model = random.below(sources)};
        });
    add({.name = "overrun", .row = 28, .onset = FaultOnset::injection, .limit_s = kOverrun_s},
        [](Random& random, double) { return DrawnFault{.late_ticks = 2 + random.below(4)}; });
  }

  double torque_Nm_;
  std::vector<Sensor> sensors_;
  std::vector<Sensor> encoders_;
  std::vector<FaultClass> classes_;
};

}  // namespace

std::vector<FaultClass> fault_classes(const DataSheet& sheet, const MonitoredTorque& monitored) {
  return Classes(sheet, monitored).take();
}

double largest_twist(const DataSheet& sheet) {
  return kTwistMargin * duty_limits(sheet).torque_Nm / second_stage_stiffness(sheet);
}

}  // namespace torsio

// What the controllers ask of the machine in ten million cycles each, faults among them: no heap, no
// lock, no system call.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <mutex>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "control/current_controller.hpp"
#include "model/mixture/random_mixture.hpp"
#include "signal/joint_move.hpp"
#include "support/example_settings.hpp"
#include "support/examples/grey_box.hpp"
#include "support/examples/hysteresis.hpp"
#include "support/examples/linear.hpp"
#include "support/examples/network.hpp"
#include "support/examples/viscoelastic.hpp"
#include "support/monitored_joint.hpp"
#include "support/numbers.hpp"
#include "support/system_calls.hpp"
#include "torsio/actuator/joint_parameters.hpp"
#include "torsio/control/estimate_correction.hpp"
#include "torsio/control/joint_cascade.hpp"
#include "torsio/control/joint_controller.hpp"
#include "torsio/control/joint_impedance.hpp"
#include "torsio/control/joint_stop.hpp"
#include "torsio/control/model_inverse.hpp"
#include "torsio/control/torque_controller.hpp"
#include "torsio/control/tube_impedance.hpp"
#include "torsio/core/random.hpp"
#include "torsio/estimate/monitored_torque.hpp"
#include "torsio/estimate/torque_estimator.hpp"
#include "torsio/safety/history.hpp"
#include "torsio/safety/monitor.hpp"
#include "torsio/safety/redundancy.hpp"
#include "torsio/signal/excitation.hpp"

namespace torsio {
namespace {

using test::besides_computing;
using test::kRate_Hz;

constexpr int kCycles = 10'000'000;
constexpr int kLeastFaults = kCycles / 1000;

/// Numbers about 0 and, now and then, what is none; drawn before, so that drawing costs no time.
class Spoiled {
 public:
  /// @param count so many and over again: another for each signal, that all meet all
  Spoiled(double size, std::size_t count) : values_(count) {
    Random random(count);
    for (double& value : values_) {
      const double draw = random.uniform();
      value = draw < 0.002   ? std::numeric_limits<double>::quiet_NaN()
              : draw < 0.004 ? std::numeric_limits<double>::infinity()
              : draw < 0.006 ? 1e308
                             : size * random.normal();
    }
  }
  double next() noexcept {
    place_ = place_ + 1 < values_.size() ? place_ + 1 : 0;
    return values_[place_];
  }

 private:
  std::vector<double> values_;
  std::size_t place_ = 0;
};

TEST(BesidesComputing, ReportsTheKindOfCall) {
  EXPECT_EQ(besides_computing([] { return true; }), "");
  EXPECT_EQ(besides_computing([] { return false; }), "wrong results");
  EXPECT_EQ(besides_computing([] {
              int* volatile number = new int(1);
              delete number;
              return true;
            }),
            "the heap");
  std::mutex mutex;
  EXPECT_EQ(besides_computing([&] {
              const std::lock_guard guard(mutex);
              return true;
            }),
            "a lock");
  const auto call = [] { return syscall(SYS_getppid) > 0; };
  const bool has_filter =
      besides_computing([] { return test::allow_no_calls(); }) == "a system call";
  EXPECT_EQ(besides_computing(call), has_filter ? "a system call" : "");
}

TEST(ControlCalls, OfPidAreNone) {
  Pid pid({.gains = {.proportional = 2.0, .integral = 10.0, .derivative = 0.1},
           .limits = {.lowest = -1.0, .highest = 1.0, .rate_per_s = 100.0},
           .derivative_cutoff_Hz = 100.0},
          kRate_Hz);
  Spoiled reference(1.0, 4099);
  Spoiled measurement(1.0, 4111);
  EXPECT_EQ(besides_computing([&] {
              int faults = 0;
              for (int n = 0; n < kCycles; ++n) {
                const Pid::Output output = pid.step(reference.next(), measurement.next());
                faults += output.fault != Fault::none ? 1 : 0;
                if (n % 7 == 0) pid.track(0.5 * output.command);
                if (n % 777 == 0) static_cast<void>(pid.set_gains({3.0, n % 2 == 0 ? 5.0 : -5.0}));
                if (n % 77'777 == 0) pid.start(0.3);
                if (!(std::abs(output.command) <= 1.0)) return false;
              }
              return faults > kLeastFaults;
            }),
            "");
}

TEST(ControlCalls, OfCurrentControllerAreNone) {
  CurrentController controller({.windings = {.resistance_Ohm = 0.4,
                                             .inductance_H = 0.5e-3,
                                             .torque_constant_Nm_A = 0.104,
                                             .pole_pairs = 5},
                                .peak_current_A = 10.0,
                                .trip_current_A = 20.0},
                               30e3);
  Spoiled reference(5.0, 4099);
  Spoiled phase(2.0, 4111);
  Spoiled angle(10.0, 4127);
  Spoiled speed(1000.0, 4129);
  EXPECT_EQ(besides_computing([&] {
              int faults = 0;
              for (int n = 0; n < kCycles; ++n) {
                const double a = phase.next();
                const CurrentController::Output output =
                    controller.step({0.0, reference.next()}, {.phases_A = {a, 0.3, -a - 0.3},
                                                              .angle_rad = angle.next(),
                                                              .speed_rad_s = speed.next(),
                                                              .supply_V = 48.0});
                faults += output.fault != Fault::none ? 1 : 0;
                for (const double duty : {output.duties.a, output.duties.b, output.duties.c})
                  if (!(duty >= 0.0 && duty <= 1.0)) return false;
                if (output.is_tripped) controller.reset();
              }
              return faults > kLeastFaults;
            }),
            "");
}

// Every mode, the fault paths, gains that are taken and gains that are refused.
TEST(ControlCalls, OfJointCascadeAreNone) {
  const Drive drive = drive_of(data_sheet("dfki-50"));
  JointCascade cascade({.drive = drive,
                        .limits = {.lowest_rad = -1.0,
                                   .highest_rad = 1.0,
                                   .speed_rad_s = 2.0,
                                   .max_unmeasured_load_Nm = 2.0},
                        .has_torque = true},
                       kRate_Hz);
  const JointCascade::Gains gains = JointCascade::gains_for(drive, 40.0);
  Spoiled position(1.0, 4099);
  Spoiled torque(1.0, 4111);
  Spoiled angle(0.5, 4127);
  EXPECT_EQ(besides_computing([&] {
              int faults = 0;
              for (int n = 0; n < kCycles; ++n) {
                const auto output =
                    cascade.step({.mode = static_cast<JointMode>(n / 1000 % 5),
                                  .position_rad = position.next(),
                                  .torque_Nm = torque.next()},
                                 {.angle_rad = angle.next(), .speed_rad_s = 0.1, .torque_Nm = 1.0});
                faults += output.fault != Fault::none ? 1 : 0;
                if (n % 777 == 0) static_cast<void>(cascade.set_gains(gains));
                if (n % 777'777 == 0) cascade.reset();
                if (!(std::abs(output.current_A) <= drive.peak_current_A)) return false;
              }
              return faults > kLeastFaults;
            }),
            "");
}

// Through both loops, with a stop in between: every mode and every phase.
TEST(ControlCalls, OfJointControllerAndJointStopAreNone) {
  for (const auto actuation :
       {DeflectionController::Actuation::current, DeflectionController::Actuation::velocity}) {
    const SeriesElasticJoint joint = series_elastic_joint(data_sheet("dfki-50"));
    JointController controller(
        LinearInverse(joint.stiffness_Nm_rad),
        JointControllerCore::Settings{
            .torque = {.deflection = {.joint = joint, .actuation = actuation}},
            .limits = {.lowest_rad = -1.0,
                       .highest_rad = 1.0,
                       .speed_rad_s = 2.0,
                       .max_unmeasured_load_Nm = 2.0}},
        kRate_Hz);
    JointStop stop({.drive = joint.drive,
                    .speed_rad_s = 2.0,
                    .deceleration_rad_s2 = 5.0,
                    .brake_static_Nm = 100.0,
                    .brake_sliding_Nm = 80.0,
                    .brake_engage_s = 0.02,
                    .brake_release_s = 0.04},
                   kRate_Hz);
    Spoiled position(1.0, 4099);
    Spoiled torque(1.0, 4111);
    Spoiled angle(0.5, 4127);
    EXPECT_EQ(besides_computing([&] {
                int faults = 0;
                for (int n = 0; n < kCycles / 4; ++n) {
                  const double angle_rad = angle.next();
                  const JointState state = {.angle_rad = angle_rad,
                                            .speed_rad_s = n % 5000 < 4000 ? 0.1 : 0.0};
                  if (n % 5000 == 0) stop.trigger(static_cast<StopCategory>(n / 5000 % 3));
                  if (n % 5000 == 4500) static_cast<void>(stop.release());
                  const JointReference wanted = {.mode = static_cast<JointMode>(n / 1000 % 6),
                                                 .position_rad = position.next(),
                                                 .torque_Nm = torque.next(),
                                                 .deflection_rad = 0.01};
                  const auto output = controller.step(stop.reference(wanted, state),
                                                      {.motor_angle_rad = angle_rad * 120.0,
                                                       .gear_angle_rad = angle_rad,
                                                       .joint_angle_rad = 0.99 * angle_rad});
                  const auto stopped = stop.step(output.current_A, state, output.fault);
                  if (stopped.is_current_cut) controller.track(stopped.current_A);
                  faults += output.fault != Fault::none ? 1 : 0;
                  if (n % 777'777 == 0) controller.reset();
                  if (!(std::abs(stopped.current_A) <= joint.drive.peak_current_A)) return false;
                }
                return faults > kLeastFaults / 4;
              }),
              "");
  }
}

TEST(ControlCalls, OfDeflectionControllerAreNone) {
  for (const auto actuation :
       {DeflectionController::Actuation::current, DeflectionController::Actuation::velocity}) {
    const SeriesElasticJoint joint = series_elastic_joint(data_sheet("dfki-50"));
    DeflectionController controller(
        {.joint = joint,
         .actuation = actuation,
         .speed_loop = JointCascade::gains_for(joint.drive, 200.0).velocity},
        kRate_Hz);
    const Pid::Gains gains = controller.gains();
    Spoiled wanted(0.05, 4099);
    Spoiled deflection(0.05, 4111);
    EXPECT_EQ(besides_computing([&] {
                int faults = 0;
                for (int n = 0; n < kCycles / 2; ++n) {
                  const auto output = controller.step(wanted.next(), deflection.next());
                  faults += output.fault != Fault::none ? 1 : 0;
                  if (n % 7 == 0) controller.track(0.5 * output.command);
                  if (n % 777 == 0) static_cast<void>(controller.set_gains(gains));
                  if (!std::isfinite(output.command)) return false;
                }
                return faults > kLeastFaults / 2;
              }),
              "");
  }
}

/// Torque control with all that may be added to it. @returns what it asks for besides computing
template <SpringInverse I>
std::string calls_with(I inverse, int cycles, bool has_fallback) {
  const SeriesElasticJoint joint = series_elastic_joint(data_sheet("dfki-50"));
  TorqueController controller(std::move(inverse),
                              TorqueLoopCore::Settings{.deflection = {.joint = joint},
                                                       .largest_torque_Nm = 50.0,
                                                       .friction = FrictionCompensation{},
                                                       .observer_cutoff_Hz = 5.0,
                                                       .feeds_rate_forward = true},
                              kRate_Hz);
  const Pid::Gains gains = controller.core().deflection().gains();
  Spoiled wanted(10.0, 4099);
  Spoiled rotor(1.0, 4111);
  Spoiled gear(0.01, 4127);
  return besides_computing([&] {
    int faults = 0;
    int fallbacks = 0;
    JointSample sample;
    sample.joint_angle_rad = 0.0;
    for (int n = 0; n < cycles; ++n) {
      sample.motor_angle_rad = rotor.next();
      sample.gear_angle_rad = gear.next();
      const auto output = controller.step(wanted.next(), sample);
      faults += output.fault != Fault::none ? 1 : 0;
      fallbacks += output.inverse != Fault::none ? 1 : 0;
      if (n % 777 == 0) static_cast<void>(controller.set_gains(gains));
      if (n % 777'777 == 0) controller.reset();
      if (!(std::abs(output.current_A) <= joint.drive.peak_current_A)) return false;
    }
    return faults > cycles / 1000 && fallbacks < cycles / 2 &&
           (fallbacks > cycles / 1000) == has_fallback;
  });
}

template <SpringInverse I>
void expect_no_calls(I inverse) {
  EXPECT_EQ(calls_with(std::move(inverse), kCycles, !std::same_as<I, LinearInverse>), "");
}

/// Around a model of so many inputs: the range is left now and then.
EstimatorSettings inverse_settings(std::size_t inputs) {
  EstimatorSettings settings = test::example_settings();
  settings.zeroed_channels.clear();
  settings.ranges = {.lowest = {-0.03, -10.0}, .highest = {0.03, 10.0}, .margin = 0.1};
  settings.fallback = {.slope = {573.0, 0.0}, .residual_std = 1.5};
  settings.disturbances = {.largest_step = {1.0, 1.0}, .largest_travel = 1e-3};
  if (inputs == 3) {
    settings.features.inputs.emplace_back("lowpass(rate(joint_angle_rad), 10Hz)");
    settings.ranges.lowest.push_back(-1.0);
    settings.ranges.highest.push_back(1.0);
    settings.fallback.slope.push_back(0.0);
  }
  return settings;
}

TEST(ControlCalls, OfTorqueControllerWithALineAreNone) { expect_no_calls(LinearInverse(573.0)); }

TEST(ControlCalls, OfTorqueControllerWithAMixtureOf300AreNone) {
  Dgmm::Parameters mixture{
      .mixture = test::random_mixture({.components = 300, .background = true}, 4),
      .clamp = {.slope = {573.0, 0.0, 0.0}, .width = 2.0}};
  mixture.mixture.centre = {0.0, 0.0, 0.0, 0.0};
  mixture.mixture.scale = {10.0, 0.02, 5.0, 0.1};
  expect_no_calls(ModelInverse(inverse_settings(3), Dgmm(mixture)));
}

TEST(ControlCalls, OfTorqueControllerWithAGreyBoxAreNone) {
  expect_no_calls(ModelInverse(inverse_settings(2), test::example<GreyBox>()));
}

/// As a model file has it.
template <class Family>
void expect_no_calls_with_any() {
  const AnyModel model = test::example<Family>();
  SCOPED_TRACE(model.family());
  ASSERT_TRUE(model.can_invert());
  EstimatorSettings settings = inverse_settings(2);
  if (model.input_count() == 1) {
    settings.features.inputs.resize(1);
    settings.ranges = {.lowest = {-0.03}, .highest = {0.03}, .margin = 0.1};
    settings.fallback.slope.resize(1);
  }
  EXPECT_EQ(calls_with(AnyInverse::of(settings, model.parameters()), kCycles / 1000, true), "");
}

TEST(ControlCalls, OfTorqueControllerWithEachInvertibleFamilyAreNone) {
  expect_no_calls_with_any<Linear>();
  expect_no_calls_with_any<LinearCoulomb>();
  expect_no_calls_with_any<Polynomial>();
  expect_no_calls_with_any<Viscoelastic>();
  expect_no_calls_with_any<MaxwellSlipModel>();
  expect_no_calls_with_any<PrandtlIshlinskii>();
  expect_no_calls_with_any<ImprovedPrandtlIshlinskii>();
  expect_no_calls_with_any<BoucWenModel>();
  expect_no_calls_with_any<NonlinearBacklash>();
  expect_no_calls_with_any<ImprovedNonlinearBacklash>();
  expect_no_calls_with_any<ExponentialLoading>();
}

TEST(ControlCalls, OfTorqueControllerWithAGreyBoxAndItsResidualAreNone) {
  // Its inputs are those of the box and its two slips.
  Dgmm::Parameters mixture{.mixture = test::random_mixture({.components = 20, .dimension = 5}, 4),
                           .clamp = {.slope = {0.0, 0.0, 0.0, 0.0}, .width = 0.5}};
  mixture.mixture.centre = {0.0, 0.0, 0.0, 0.0, 0.0};
  mixture.mixture.scale = {0.5, 0.02, 5.0, 0.01, 0.01};
  GreyBox::Parameters parameters = test::example<GreyBox>().parameters();
  parameters.residual = {.model = mixture,
                         .bound = 0.5,
                         .lowest = {-0.03, -10.0, -0.03, -0.03},
                         .highest = {0.03, 10.0, 0.03, 0.03}};
  EXPECT_EQ(calls_with(ModelInverse(inverse_settings(2), GreyBox(parameters)), kCycles / 100, true),
            "");
}

TEST(ControlCalls, OfTorqueControllerWithANetworkAreNone) {
  EstimatorSettings settings = inverse_settings(2);
  settings.disturbances = {};
  settings.target = "spring_deflection_rad";
  settings.features.inputs.front() = "torque_Nm";
  settings.ranges = {.lowest = {-20.0, -10.0}, .highest = {20.0, 10.0}, .margin = 0.1};
  settings.fallback.slope.front() = 1.0 / 573.0;
  expect_no_calls(TrainedInverse(Estimator(settings, AnyModel(test::example<Mlp>()))));
}

TEST(ControlCalls, OfJointImpedanceAreNone) {
  JointImpedance impedance({.gains = {20.0, 1.0}, .torque_Nm = 40.0, .torque_rate_Nm_s = 1000.0},
                           kRate_Hz);
  Spoiled wanted(0.1, 4099);
  Spoiled angle(0.1, 4111);
  EXPECT_EQ(besides_computing([&] {
              int faults = 0;
              for (int n = 0; n < kCycles; ++n) {
                const auto output = impedance.step({.angle_rad = wanted.next()},
                                                   {.angle_rad = angle.next(), .speed_rad_s = 0.1});
                faults += output.fault != Fault::none ? 1 : 0;
                if (n % 777 == 0)
                  static_cast<void>(impedance.set_gains({n % 2 == 0 ? 10.0 : -10.0, 1.0}));
                if (!(std::abs(output.torque_Nm) <= 40.0)) return false;
              }
              return faults > kLeastFaults;
            }),
            "");
}

TEST(ControlCalls, OfTubeImpedanceAndItsCorrectionAreNone) {
  TubeImpedance::Settings settings =
      tube_impedance_settings(data_sheet("harmonic-drive"), TubeImpedance::kZero);
  settings.gains = TubeImpedance::gains_for(settings, 2000.0, 20.0, 0.5);
  TubeImpedance impedance(settings, kRate_Hz);
  EstimateCorrection correction({.torque_Nm = 10.0}, kRate_Hz);
  Spoiled wanted(0.1, 4099);
  Spoiled rotor(0.1, 4111);
  EXPECT_EQ(besides_computing([&] {
              int faults = 0;
              for (int n = 0; n < kCycles; ++n) {
                const auto output =
                    impedance.step(wanted.next(), 0.1,
                                   {.rotor_rad = rotor.next(), .middle_rad = 0.0, .joint_rad = 0.0},
                                   correction.step(0.1, {.value = wanted.next()}, false));
                faults += output.fault != Fault::none ? 1 : 0;
                if (!std::isfinite(output.current_A)) return false;
              }
              return faults > kLeastFaults;
            }),
            "");
}

TEST(ControlCalls, OfRedundancyAndHistoryAreNone) {
  RedundancySettings settings = test::joint_redundancy();
  settings.correlation = {1.0, 0.3, 0.2, 0.3, 1.0, -0.8, 0.2, -0.8, 1.0};
  Redundancy redundancy(settings);
  History history(1000, 2);
  Spoiled value(5.0, 4099);
  Spoiled std_dev(1.0, 4111);
  EXPECT_EQ(besides_computing([&] {
              int faults = 0;
              for (int n = 0; n < kCycles / 4; ++n) {
                std::array<Estimate, 3> sources;
                for (Estimate& source : sources)
                  source = {.value = value.next(),
                            .std_dev = std_dev.next(),
                            .fault = n % 5 == 0 ? Fault::warming_up : Fault::none};
                const auto count = static_cast<std::size_t>(n % 1000 == 0 ? 2 : 3);
                const FusedTorque fused = redundancy.step(std::span(sources).first(count));
                faults += fused.fault != Fault::none ? 1 : 0;
                static_cast<void>(redundancy.suspects({}));
                history.record(std::array{fused.value_Nm, fused.std_dev_Nm});
                if (n % 77'777 == 0) history.freeze();
                if (n % 77'777 == 7) history.reset();
                if (!std::isfinite(fused.value_Nm)) return false;
              }
              return faults > kLeastFaults / 4;
            }),
            "");
}

// Through every state: armed when it can be, reset after each stop.
TEST(ControlCalls, OfMonitorAreNone) {
  MonitorSettings settings = test::joint_monitor();
  settings.proof_s = 0.002;
  settings.signals[0].turn = 6.3;
  settings.signals[0].largest_rate = 1000.0;
  settings.signals[1].moves_with = "gear_angle_rad";
  settings.signals[1].largest_hidden_travel = 5.0;
  settings.largest_novelty = 1.0;
  for (PairLimits& pair : settings.pairs) pair.drift_limit_s = 0.01;
  Monitor monitor(settings);
  Spoiled torque(1.0, 4099);
  Spoiled angle(0.01, 4111);
  EXPECT_EQ(besides_computing([&] {
              int stops = 0;
              for (int n = 0; n < kCycles / 4; ++n) {
                const double t_s = n % 9999 == 0 ? 0.0 : 1e-3 * n;
                std::array<Estimate, 3> sources;
                std::array<SignalSample, 3> signals;
                for (Estimate& source : sources)
                  source = {.value = torque.next(), .std_dev = 0.1, .novelty = 0.9};
                for (SignalSample& sample : signals)
                  sample = {.value = angle.next(), .age_s = n % 777 == 0 ? 1.0 : 0.0};
                const auto count = static_cast<std::size_t>(n % 5000 == 0 ? 2 : 3);
                if (monitor.step(t_s, std::span(sources).first(count), signals) ==
                    Monitor::State::stopped) {
                  ++stops;
                  monitor.reset(t_s);
                }
                static_cast<void>(monitor.arm(t_s));
                if (n % 77'777 == 0) monitor.stop(t_s);
              }
              return stops > kLeastFaults / 4;
            }),
            "");
}

TEST(ControlCalls, OfMonitoredTorqueAreNone) {
  MonitoredTorque torque = test::monitored_joint();
  Spoiled value(0.001, 4099);
  EXPECT_EQ(besides_computing([&] {
              int faults = 0;
              for (int n = 0; n < kCycles / 20; ++n) {
                std::array<SignalSample, 4> raw;
                for (SignalSample& sample : raw)
                  sample = {.value = value.next(), .age_s = n % 777 == 0 ? 1.0 : 0.0};
                const auto count = static_cast<std::size_t>(n % 5000 == 0 ? 2 : 4);
                const FusedTorque fused = torque.step(1e-3 * n, std::span(raw).first(count));
                faults += fused.fault != Fault::none ? 1 : 0;
                static_cast<void>(torque.monitor().arm(1e-3 * n));
                if (torque.monitor().state() == Monitor::State::stopped && n % 100 == 0)
                  torque.monitor().reset(1e-3 * n);
                if (n % 7777 == 0) torque.reset();
                if (!std::isfinite(fused.value_Nm)) return false;
              }
              return faults > kCycles / 20 / 10'000 && torque.history().size() > 0;
            }),
            "");
}

TEST(ControlCalls, OfReferencesAreNone) {
  Chirp chirp({}, kRate_Hz);
  LogSweep sweep({}, kRate_Hz);
  BandLimitedNoise walk({}, kRate_Hz);
  Steps steps({.levels = {1.0, -1.0, 0.5}, .hold_s = 2.0}, kRate_Hz);
  Replay replay({.values = {0.0, 1.0, 0.5}, .recorded_Hz = 100.0}, kRate_Hz);
  JointMove move({.waypoints_rad = {0.0, 1.0, -0.5}}, kRate_Hz);
  EXPECT_EQ(besides_computing([&] {
              double sum = 0.0;
              for (int n = 0; n < kCycles / 5; ++n) {
                sum += chirp.step() + sweep.step() + walk.step() + steps.step() + replay.step() +
                       move.step().position_rad;
                if (n % 10'000 == 0) {
                  replay.reset();
                  move.reset();
                }
              }
              return std::isfinite(sum);
            }),
            "");
}

}  // namespace
}  // namespace torsio

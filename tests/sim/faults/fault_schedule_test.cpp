#include "torsio/sim/faults/fault_schedule.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "sim/experiments/results.hpp"
#include "sim/faults/fault_injector.hpp"
#include "support/error_message.hpp"
#include "support/numbers.hpp"
#include "torsio/actuator/data_sheet.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/units.hpp"
#include "torsio/sim/experiments/experiment.hpp"

namespace torsio {
namespace {

using test::error_message;
using test::kNaN;

/// The output of the injector for a gear encoder that turns at 1 rad/s and a load cell at 125 Hz
/// whose torque increases by 1 Nm/s, tick by tick at 1 kHz.
std::vector<Measurement> seen(const std::vector<ScheduledFault>& faults, std::size_t ticks = 100) {
  FaultInjector injector({faults}, data_sheet("dfki-50"));
  std::vector<Measurement> all(ticks);
  double cell_Nm = 0.0;
  for (std::size_t tick = 0; tick < ticks; ++tick) {
    const double time_s = 0.001 * static_cast<double>(tick);
    const bool is_fresh = tick % 8 == 2;
    if (is_fresh) cell_Nm = time_s;
    all[tick] = {.middle_angle_rad = time_s, .torque_Nm = cell_Nm, .is_torque_fresh = is_fresh};
    injector.apply(all[tick], time_s);
  }
  return all;
}

ScheduledFault gear(FaultKind kind, double amount = 0.0) {
  return {.what = "gear_angle_rad",
          .kind = kind,
          .start_s = 0.03,
          .duration_s = 0.02,
          .amount = amount};
}

TEST(FaultInjector, LastsAsLongAsSpecifiedAndHasNoLaterEffect) {
  for (const FaultKind kind :
       {FaultKind::freeze, FaultKind::jump, FaultKind::drift, FaultKind::sign_flip,
        FaultKind::quantised, FaultKind::dropout, FaultKind::nan}) {
    const std::vector<Measurement> faulty = seen({gear(kind, 0.05)});
    const std::vector<Measurement> sound = seen({});
    for (std::size_t tick = 0; tick < sound.size(); ++tick) {
      const bool equal = faulty[tick].middle_angle_rad == sound[tick].middle_angle_rad &&
                         faulty[tick].is_middle_angle_fresh;
      // A drift starts at nothing.
      const bool acts = tick >= (kind == FaultKind::drift ? 31 : 30) && tick < 50;
      EXPECT_EQ(equal, !acts) << "kind " << static_cast<int>(kind) << ", tick " << tick;
      EXPECT_EQ(faulty[tick].motor_angle_rad, sound[tick].motor_angle_rad);
    }
  }
}

TEST(FaultInjector, DoesToASensorWhatItsKindSays) {
  const auto at_tick_40 = [](FaultKind kind, double amount = 0.0) {
    return seen({gear(kind, amount)})[40].middle_angle_rad;
  };
  EXPECT_EQ(at_tick_40(FaultKind::freeze), 0.029);
  EXPECT_EQ(at_tick_40(FaultKind::dropout), 0.029);
  EXPECT_EQ(at_tick_40(FaultKind::jump, -2.0), 0.040 - 2.0);
  EXPECT_NEAR(at_tick_40(FaultKind::drift, 3.0), 0.040 + 0.01 * 3.0, 1e-12);
  EXPECT_EQ(at_tick_40(FaultKind::sign_flip), -0.040);
  EXPECT_NEAR(at_tick_40(FaultKind::quantised, 0.03), 0.03, 1e-12);
  EXPECT_TRUE(std::isnan(at_tick_40(FaultKind::nan)));
}

TEST(FaultInjector, ScalesZeroesAndWraps) {
  const auto at_tick_40 = [](FaultKind kind, double amount = 0.0) {
    return seen({gear(kind, amount)})[40].middle_angle_rad;
  };
  EXPECT_NEAR(at_tick_40(FaultKind::gain, 0.8), 0.8 * 0.040, 1e-15);
  EXPECT_EQ(at_tick_40(FaultKind::zero), 0.0);
  EXPECT_NEAR(at_tick_40(FaultKind::wrap, -2.0), 0.040 - 4.0 * std::numbers::pi, 1e-12);
  // The encoder of the rubber bench is on the rotor, the channel at the joint.
  FaultInjector clutch({{{.what = "input_angle_rad", .kind = FaultKind::wrap, .amount = 1.0}}},
                       data_sheet("rubber-clutch"));
  Measurement measured;
  clutch.apply(measured, 0.0);
  EXPECT_NEAR(measured.motor_angle_rad, 2.0 * std::numbers::pi, 1e-12);
}

TEST(FaultInjector, ASpikeIsOneSampleAndRepeatsIfAsked) {
  const auto spikes = [](double every_s) {
    ScheduledFault fault = gear(FaultKind::spike, 5.0);
    fault.every_s = every_s;
    std::vector<std::size_t> at;
    const std::vector<Measurement> all = seen({fault});
    for (std::size_t tick = 0; tick < all.size(); ++tick)
      if (all[tick].middle_angle_rad > 4.0) at.push_back(tick);
    return at;
  };
  EXPECT_EQ(spikes(0.0), (std::vector<std::size_t>{30}));
  EXPECT_EQ(spikes(0.004), (std::vector<std::size_t>{30, 34, 38, 42, 46}));
  // A slow sensor has it in its next sample.
  const std::vector<Measurement> all =
      seen({{.what = "torque_Nm", .kind = FaultKind::spike, .start_s = 0.0305, .amount = 5.0}});
  for (std::size_t tick = 0; tick < all.size(); ++tick)
    EXPECT_EQ(all[tick].torque_Nm > 4.0, tick >= 34 && tick < 42) << tick;
}

TEST(FaultInjector, SpikesAgainAfterAReset) {
  FaultInjector injector({{gear(FaultKind::spike, 5.0)}}, data_sheet("dfki-50"));
  for (int run = 0; run < 2; ++run) {
    Measurement measured;
    injector.apply(measured, 0.030);
    EXPECT_EQ(measured.middle_angle_rad, 5.0);
    Measurement next;
    injector.apply(next, 0.031);
    EXPECT_EQ(next.middle_angle_rad, 0.0);
    injector.reset();
  }
}

TEST(FaultInjector, AFrozenSensorDeliversAndASilentOneDoesNot) {
  EXPECT_TRUE(seen({gear(FaultKind::freeze)})[40].is_middle_angle_fresh);
  EXPECT_FALSE(seen({gear(FaultKind::dropout)})[40].is_middle_angle_fresh);
}

TEST(FaultInjector, FromTheFirstTickOnHoldsTheFirstValue) {
  for (const FaultKind kind : {FaultKind::freeze, FaultKind::dropout})
    EXPECT_EQ(seen({{.what = "gear_angle_rad", .kind = kind}})[99].middle_angle_rad, 0.0);
}

TEST(FaultInjector, AHeldValueNeverChangesBetweenDeliveries) {
  for (const FaultKind kind : {FaultKind::freeze, FaultKind::jump, FaultKind::drift,
                               FaultKind::sign_flip, FaultKind::dropout, FaultKind::nan}) {
    const std::vector<Measurement> all = seen({{.what = "torque_Nm",
                                                .kind = kind,
                                                .start_s = 0.0305,
                                                .duration_s = 0.03,
                                                .amount = 1.0}});
    for (std::size_t tick = 1; tick < all.size(); ++tick) {
      const double now = all[tick].torque_Nm;
      const double before = all[tick - 1].torque_Nm;
      if (all[tick].is_torque_fresh) continue;
      EXPECT_TRUE(now == before || (std::isnan(now) && std::isnan(before)))
          << "kind " << static_cast<int>(kind) << ", tick " << tick;
    }
    EXPECT_EQ(all[66].torque_Nm, 0.066);
  }
}

TEST(FaultInjector, CombinesTheFaultsOfASensorInTheirOrder) {
  const double jumped =
      seen({gear(FaultKind::sign_flip), gear(FaultKind::jump, 1.0)})[40].middle_angle_rad;
  const double flipped =
      seen({gear(FaultKind::jump, 1.0), gear(FaultKind::sign_flip)})[40].middle_angle_rad;
  EXPECT_EQ(jumped, 1.0 - 0.040);
  EXPECT_EQ(flipped, -1.0 - 0.040);
}

TEST(FaultInjector, ResetsToTheBeginning) {
  FaultInjector injector({{gear(FaultKind::freeze)}}, data_sheet("dfki-50"));
  const auto frozen = [&](double angle_rad) {
    Measurement measured{.middle_angle_rad = angle_rad};
    injector.apply(measured, 0.029);
    measured.middle_angle_rad = 9.0;
    injector.apply(measured, 0.030);
    return measured.middle_angle_rad;
  };
  EXPECT_EQ(frozen(1.0), 1.0);
  injector.reset();
  EXPECT_EQ(frozen(2.0), 2.0);
}

TEST(FaultInjector, TakesAmountsInTheUnitOfTheChannelNotOfTheSensor) {
  // The rubber bench logs the rotor's angle over the ratio of 51, the harmonic drive its motor's
  // current as torque.
  FaultInjector clutch({{{.what = "input_angle_rad", .kind = FaultKind::jump, .amount = 0.1}}},
                       data_sheet("rubber-clutch"));
  Measurement measured;
  clutch.apply(measured, 0.0);
  EXPECT_NEAR(measured.motor_angle_rad, 5.1, 1e-12);
  const DataSheet sheet = data_sheet("harmonic-drive");
  FaultInjector drive({{{.what = "motor_torque_Nm", .kind = FaultKind::jump, .amount = 0.5}}},
                      sheet);
  drive.apply(measured, 0.0);
  EXPECT_NEAR(measured.motor_current_A, 0.5 / sheet.motor.torque_constant_Nm_A.value, 1e-12);
}

TEST(FaultInjector, DriftsAPartToItsFactorAndStaysThere) {
  const FaultInjector injector({{{.what = "friction",
                                  .kind = FaultKind::drift,
                                  .start_s = 1.0,
                                  .amount = 1.3,
                                  .over_s = 60.0},
                                 {.what = "torque-constant",
                                  .kind = FaultKind::drift,
                                  .start_s = 2.0,
                                  .duration_s = 3.0,
                                  .amount = 0.8}}},
                               data_sheet("dfki-50"));
  EXPECT_EQ(injector.condition(0.5).friction_factor, 1.0);
  EXPECT_NEAR(injector.condition(31.0).friction_factor, 1.15, 1e-12);
  EXPECT_NEAR(injector.condition(500.0).friction_factor, 1.3, 1e-12);
  EXPECT_EQ(injector.condition(1.9).torque_constant_factor, 1.0);
  EXPECT_NEAR(injector.condition(2.0).torque_constant_factor, 0.8, 1e-12);
  EXPECT_EQ(injector.condition(5.0).torque_constant_factor, 1.0);
  EXPECT_NEAR(injector.condition(500.0, {.friction_factor = 2.0}).friction_factor, 2.6, 1e-12);
}

TEST(FaultInjector, OfTwoStopsTheNearerCountsAndBreaksMultiply) {
  const auto stop = [](double twist_rad, double stiffness_Nm_rad) {
    return ScheduledFault{.what = "spring",
                          .kind = FaultKind::bottom,
                          .amount = twist_rad,
                          .stop_stiffness_Nm_rad = stiffness_Nm_rad};
  };
  const ScheduledFault half{.what = "spring", .kind = FaultKind::broken, .amount = 0.5};
  const PlantCondition condition =
      FaultInjector({{stop(0.05, 3000.0), stop(0.02, 5000.0), stop(0.03, 4000.0), half, half}},
                    data_sheet("dfki-50"))
          .condition(0.0);
  EXPECT_EQ(condition.stop_twist_rad, 0.02);
  EXPECT_EQ(condition.stop_stiffness_Nm_rad, 5000.0);
  EXPECT_EQ(condition.second_stage_factor, 0.25);
}

TEST(FaultInjector, RefusesWhatCannotBe) {
  const auto message = [](const ScheduledFault& fault, double run_s = 10.0) {
    return error_message(
        [&] { const FaultInjector injector({{fault}}, data_sheet("dfki-50"), run_s); });
  };
  const auto expect = [&](const ScheduledFault& fault, const char* text) {
    EXPECT_NE(message(fault).find(text), std::string::npos) << message(fault);
  };
  expect({.what = "gear_angel_rad"}, "Did you mean 'gear_angle_rad'?");
  expect({.what = "gear_angle_rad", .kind = FaultKind::broken},
         "expected one of freeze, jump, drift, sign_flip, quantised, dropout, nan, gain, spike, "
         "wrap, zero, found break");
  expect({.what = "spring", .kind = FaultKind::freeze}, "expected one of break, bottom");
  expect({.what = "gear_angle_rad", .start_s = kNaN}, "at: expected 0 s");
  expect({.what = "gear_angle_rad", .start_s = -1.0}, "at: expected 0 s");
  expect({.what = "gear_angle_rad", .start_s = 10.0}, "before 10 s, found 10 s");
  expect({.what = "gear_angle_rad", .duration_s = 0.0}, "for: expected");
  expect({.what = "gear_angle_rad", .kind = FaultKind::jump, .amount = kNaN}, "by: expected");
  expect({.what = "gear_angle_rad", .kind = FaultKind::quantised, .amount = -0.1}, "to: expected");
  expect({.what = "spring", .kind = FaultKind::broken, .amount = -0.1}, "to: expected 0 to 1");
  expect({.what = "friction", .kind = FaultKind::drift, .amount = 1.1, .over_s = kNaN},
         "over: expected");
  expect(
      {.what = "spring", .kind = FaultKind::bottom, .amount = 0.05, .stop_stiffness_Nm_rad = 1e9},
      "stiffness: expected");
  expect({.what = "torque_Nm", .kind = FaultKind::wrap, .amount = 1.0}, "an angle");
  expect({.what = "gear_angle_rad", .kind = FaultKind::wrap, .amount = 1.5}, "whole number");
  expect({.what = "gear_angle_rad", .kind = FaultKind::gain, .amount = kNaN}, "to: expected");
  expect({.what = "gear_angle_rad", .kind = FaultKind::spike, .amount = 1.0, .every_s = -1.0},
         "every: expected");
  EXPECT_EQ(message({.what = "gear_angle_rad", .start_s = 9.9}), "");
  EXPECT_NE(error_message([] {
              const FaultInjector injector(
                  {std::vector<ScheduledFault>(257, {.what = "torque_Nm"})}, data_sheet("dfki-50"));
            }).find("at most 256 faults"),
            std::string::npos);
}

TEST(Injection, ReadsTheShortForm) {
  const DataSheet sheet = data_sheet("dfki-50");
  const ScheduledFault kt = parse_injection("kt=-20%@3s", sheet);
  EXPECT_EQ(kt.what, "torque-constant");
  EXPECT_EQ(kt.kind, FaultKind::drift);
  EXPECT_NEAR(kt.amount, 0.8, 1e-15);
  EXPECT_EQ(kt.over_s, 0.0);
  EXPECT_EQ(kt.start_s, 3.0);
  EXPECT_FALSE(kt.duration_s);
  const ScheduledFault jump = parse_injection("gear_angle=1deg@200ms..2s", sheet);
  EXPECT_EQ(jump.what, "gear_angle_rad");
  EXPECT_EQ(jump.kind, FaultKind::jump);
  EXPECT_NEAR(jump.amount, rad_from_deg(1.0), 1e-15);
  EXPECT_NEAR(*jump.duration_s, 1.8, 1e-12);
  const ScheduledFault gain = parse_injection("current=gain:-20%@2s", sheet);
  EXPECT_EQ(gain.what, "motor_current_A");
  EXPECT_EQ(gain.kind, FaultKind::gain);
  EXPECT_NEAR(gain.amount, 0.8, 1e-15);
  EXPECT_EQ(parse_injection("current=+5%@2s", sheet).kind, FaultKind::gain);
  EXPECT_EQ(parse_injection("motor_angle=freeze@2s", sheet).kind, FaultKind::freeze);
  EXPECT_EQ(parse_injection("joint_angle=nan@2s", sheet).kind, FaultKind::nan);
  EXPECT_EQ(parse_injection("joint_angle=wrap@2s", sheet).amount, 1.0);
  EXPECT_EQ(parse_injection("joint_angle=wrap:-1@2s", sheet).amount, -1.0);
  EXPECT_EQ(parse_injection("spring=break@2s", sheet).amount, 0.0);
  EXPECT_NEAR(parse_injection("spring=-60%@2s", sheet).amount, 0.4, 1e-15);
  EXPECT_GT(parse_injection("spring=bottom:3deg@2s", sheet).stop_stiffness_Nm_rad, 0.0);
  EXPECT_EQ(parse_injection("current=gain:-20%@2s", data_sheet("harmonic-drive")).what,
            "motor_torque_Nm");
}

TEST(Injection, RefusesWhatIsNotOneAndListsWhatIs) {
  const auto expect = [](const char* text, const char* part) {
    const std::string message =
        error_message([&] { (void)parse_injection(text, data_sheet("dfki-50")); });
    EXPECT_NE(message.find(part), std::string::npos) << text << ": " << message;
  };
  expect("", "WHAT=AMOUNT@TIME");
  expect("kt=-20%", "WHAT=AMOUNT@TIME");
  expect("kt@3s", "WHAT=AMOUNT@TIME");
  expect("@3s=", "WHAT=AMOUNT@TIME");
  expect("gear_angel=1deg@2s", "Did you mean 'gear_angle'?");
  expect("gear_angel=1deg@2s", "motor_current, current, torque_Nm");
  expect("gear_angle=1Nm@2s", "a number in rad");
  expect("gear_angle=freez@2s", "Did you mean 'freeze'?");
  expect("gear_angle=freeze:3@2s", "'freeze' without an amount");
  expect("gear_angle=jump@2s", "an amount, 'jump:...'");
  expect("gear_angle=1deg@soon", "a number in s");
  expect("gear_angle=1deg@3s..2s", "an end after the start");
  expect("gear_angle=1deg@-3s", "at: expected");
  expect("kt=20%@3s", "a change with its sign");
  expect("kt=-120%@3s", "to: expected");
  expect("kt=-2x%@3s", "a number");
  expect("kt=freeze@3s", "one of drift");
  expect("current=wrap@3s", "an angle");
}

TEST(FaultSchedule, ReadsEveryKindWithUnits) {
  const FaultSchedule schedule = parse_fault_schedule(
      "faults:\n"
      "  - {sensor: gear_angle_rad, fault: freeze, at: 5s, for: 200ms}\n"
      "  - {sensor: joint_angle_rad, fault: jump, at: 3s, by: 2deg}\n"
      "  - {sensor: motor_angle_rad, fault: drift, at: 3s, per_second: -1deg}\n"
      "  - {sensor: motor_current_A, fault: sign_flip, at: 3}\n"
      "  - {sensor: torque_Nm, fault: quantised, at: 3s, to: 50Ncm}\n"
      "  - {sensor: torque_Nm, fault: dropout, at: 3s}\n"
      "  - {sensor: torque_Nm, fault: nan, at: 3s}\n"
      "  - {part: friction, fault: drift, at: 0s, to: 130pct, over: 1min}\n"
      "  - {part: torque-constant, fault: drift, at: 0s, to: 0.9, over: 0s}\n"
      "  - {part: spring, fault: break, at: 10s}\n"
      "  - {part: spring, fault: break, at: 10s, to: 0.4}\n"
      "  - {part: spring, fault: bottom, at: 10s, beyond: 3deg, times: 5}\n"
      "  - {part: spring, fault: bottom, at: 10s, beyond: 3deg, stiffness: 50Nm_deg}\n",
      "faults.yaml", data_sheet("dfki-50"));
  const auto& faults = schedule.faults;
  ASSERT_EQ(faults.size(), 13U);
  EXPECT_EQ(faults[0].what, "gear_angle_rad");
  EXPECT_EQ(faults[0].kind, FaultKind::freeze);
  EXPECT_EQ(faults[0].start_s, 5.0);
  EXPECT_NEAR(faults[0].duration_s.value_or(0.0), 0.2, 1e-15);
  EXPECT_NEAR(faults[1].amount, rad_from_deg(2.0), 1e-15);
  EXPECT_FALSE(faults[1].duration_s.has_value());
  EXPECT_NEAR(faults[2].amount, rad_from_deg(-1.0), 1e-15);
  EXPECT_NEAR(faults[4].amount, 0.5, 1e-15);
  EXPECT_EQ(faults[6].kind, FaultKind::nan);
  EXPECT_NEAR(faults[7].amount, 1.3, 1e-15);
  EXPECT_EQ(faults[7].over_s, 60.0);
  EXPECT_EQ(faults[9].amount, 0.0);
  EXPECT_EQ(faults[10].amount, 0.4);
  EXPECT_NEAR(faults[11].stop_stiffness_Nm_rad, 5.0 * deg_from_rad(10.0), 1e-9);
  EXPECT_NEAR(faults[12].stop_stiffness_Nm_rad, deg_from_rad(50.0), 1e-9);
  EXPECT_EQ(faults[12].place, "faults.yaml: line 14 (faults[12])");
}

TEST(FaultSchedule, KnowsTheSensorsAndPartsOfEveryActuator) {
  for (const DataSheet& sheet : data_sheets()) {
    for (const std::string& sensor : fault_sensors(sheet))
      EXPECT_EQ(parse_fault_schedule("faults: [{sensor: " + sensor + ", fault: sign_flip, at: 0}]",
                                     "f", sheet)
                    .faults.size(),
                1U);
    EXPECT_EQ(fault_parts(sheet).front(), sheet.name == "harmonic-drive" ? "gear" : "spring");
    EXPECT_EQ(parse_fault_schedule("faults: [{part: " + fault_parts(sheet).front() +
                                       ", fault: bottom, at: 0, beyond: 1deg, times: 10}]",
                                   "f", sheet)
                  .faults.size(),
              1U);
  }
}

ExperimentSpec faulty_sweep(std::vector<ScheduledFault> faults) {
  return {.duration_s = 4.0, .with_truth = true, .faults = {std::move(faults)}};
}

double largest_of(const Recording& recording, const char* channel) {
  return test::largest(recording.channel(channel).values);
}

TEST(SimulateWithFaults, LogsWhatTheSensorSaysAndKeepsTheTruth) {
  const Recording sound = simulate(faulty_sweep({}));
  // The load cell is in no loop: its faults leave the run as it was.
  const Recording faulty = simulate(faulty_sweep(
      {{.what = "torque_Nm", .kind = FaultKind::jump, .start_s = 2.0, .amount = 7.0}}));
  EXPECT_EQ(faulty.channel("truth_torque_Nm").values, sound.channel("truth_torque_Nm").values);
  EXPECT_EQ(faulty.channel("joint_angle_rad").values, sound.channel("joint_angle_rad").values);
  EXPECT_EQ(faulty.channel("torque_Nm").values[1999], sound.channel("torque_Nm").values[1999]);
  EXPECT_EQ(faulty.channel("torque_Nm").values[3000],
            sound.channel("torque_Nm").values[3000] + 7.0);
}

TEST(SimulateWithFaults, TheLoopSeesThem) {
  const Recording sound = simulate(faulty_sweep({}));
  // The sweep's loop uses the rotor's encoder: an error of 12 rad there is 0.1 rad at the joint.
  const Recording faulty = simulate(faulty_sweep(
      {{.what = "motor_angle_rad", .kind = FaultKind::jump, .start_s = 1.0, .amount = 12.0}}));
  EXPECT_NEAR(faulty.channel("joint_angle_rad").values.back(),
              sound.channel("joint_angle_rad").values.back() - 0.1, 0.02);
}

TEST(SimulateWithFaults, NaNIsLoggedAndTheRunSurvivesIt) {
  const Recording sound = simulate(faulty_sweep({}));
  const ScheduledFault glitch{
      .what = "motor_angle_rad", .kind = FaultKind::nan, .start_s = 1.0, .duration_s = 0.01};
  const Recording faulty = simulate(faulty_sweep({glitch}));
  const auto& angle = faulty.channel("motor_angle_rad").values;
  EXPECT_EQ(std::ranges::count_if(angle, [](double v) { return std::isnan(v); }), 10);
  // The loop takes no harm.
  EXPECT_NEAR(faulty.channel("joint_angle_rad").values.back(),
              sound.channel("joint_angle_rad").values.back(), 1e-2);
  ScheduledFault from_the_start = glitch;
  from_the_start.start_s = 0.0;
  from_the_start.duration_s.reset();
  const Recording blind = simulate(faulty_sweep({from_the_start}));
  EXPECT_TRUE(std::isfinite(blind.channel("joint_angle_rad").values.back()));
}

TEST(SimulateWithFaults, ASilentSensorIsMarkedInTheLog) {
  const Recording recording = simulate(faulty_sweep(
      {{.what = "gear_angle_rad", .kind = FaultKind::dropout, .start_s = 1.0, .duration_s = 0.5}}));
  const Channel& channel = recording.channel("gear_angle_rad");
  EXPECT_TRUE(channel.is_fresh(999));
  EXPECT_FALSE(channel.is_fresh(1000));
  EXPECT_FALSE(channel.is_fresh(1499));
  EXPECT_TRUE(channel.is_fresh(1500));
  EXPECT_EQ(channel.values[1499], channel.values[999]);
  EXPECT_TRUE(recording.channel("joint_angle_rad").fresh.empty());
}

TEST(SimulateWithFaults, ABrokenSpringCarriesNothing) {
  const Recording recording =
      simulate(faulty_sweep({{.what = "spring", .kind = FaultKind::broken, .start_s = 1.0}}));
  const auto& torque = recording.channel("truth_spring_torque_Nm").values;
  EXPECT_NE(torque[999], 0.0);
  EXPECT_TRUE(std::all_of(torque.begin() + 1001, torque.end(), [](double v) { return v == 0.0; }));
  const auto& friction = recording.channel("truth_spring_friction_Nm").values;
  EXPECT_NE(friction[999], 0.0);
  EXPECT_TRUE(
      std::all_of(friction.begin() + 1001, friction.end(), [](double v) { return v == 0.0; }));
}

TEST(SimulateWithFaults, ABottomedSpringStopsAtItsStop) {
  const auto cycle = [](std::vector<ScheduledFault> faults) {
    return simulate({.experiment = "static-cycle",
                     .duration_s = 6.0,
                     .with_truth = true,
                     .faults = {std::move(faults)}});
  };
  const double stop_rad = rad_from_deg(1.0);
  const Recording sound = cycle({});
  const Recording faulty = cycle({{.what = "spring",
                                   .kind = FaultKind::bottom,
                                   .amount = stop_rad,
                                   .stop_stiffness_Nm_rad = 50000.0}});
  EXPECT_GT(largest_of(sound, "truth_spring_deflection_rad"), 3.0 * stop_rad);
  EXPECT_LT(largest_of(faulty, "truth_spring_deflection_rad"), 1.1 * stop_rad);
}

TEST(SimulateWithFaults, AColdOldPieceInWhichEverythingFailsStaysFinite) {
  std::vector<ScheduledFault> everything = {
      {.what = "friction", .kind = FaultKind::drift, .amount = 10.0, .over_s = 0.5},
      {.what = "friction", .kind = FaultKind::drift, .amount = 10.0, .over_s = 0.5},
      {.what = "torque-constant", .kind = FaultKind::drift, .start_s = 1.0, .amount = 10.0},
      {.what = "spring",
       .kind = FaultKind::bottom,
       .start_s = 0.5,
       .amount = 1e-3,
       .stop_stiffness_Nm_rad = 1e4},
      {.what = "spring", .kind = FaultKind::broken, .start_s = 2.0},
      {.what = "motor_angle_rad", .kind = FaultKind::jump, .start_s = 2.2, .amount = 1e6},
      {.what = "motor_angle_rad", .kind = FaultKind::nan, .start_s = 2.5}};
  for (const char* actuator : {"dfki-28", "dfki-50:bouc-wen", "dfki-120:lugre", "dfki-300"}) {
    ExperimentSpec spec = faulty_sweep(everything);
    spec.actuator = actuator;
    spec.conditions = {.temperature_K = OperatingConditions::kColdest_K, .age = 1.0};
    const Recording recording = simulate(spec);
    for (const Channel& channel : recording.channels()) {
      if (channel.name == "motor_angle_rad") continue;
      EXPECT_TRUE(std::ranges::all_of(channel.values, [](double v) { return std::isfinite(v); }))
          << actuator << " " << channel.name;
    }
    EXPECT_LT(largest_of(recording, "truth_joint_speed_rad_s"), 100.0) << actuator;
  }
}

TEST(SimulateWithWear, ColdAndWarmingPiecesRubAsTheirTemperatureSays) {
  const auto friction_Nm = [](const OperatingConditions& conditions) {
    const Recording recording =
        simulate({.duration_s = 4.0, .with_truth = true, .conditions = conditions});
    return recording.channel("truth_motor_friction_Nm").values[3000];
  };
  const double reference = friction_Nm({});
  EXPECT_NEAR(friction_Nm({.temperature_K = 273.15}) / reference, 1.517, 0.05);
  // 50 K with a time constant of 1 s: 47.5 K after three.
  EXPECT_NEAR(friction_Nm({.warm_up_K = 50.0, .warm_up_time_s = 1.0}) / reference, 0.453, 0.03);
}

TEST(SimulateWithWear, AnOldSpringGivesMore) {
  const auto deflection_rad = [](double age) {
    return largest_of(simulate({.actuator = "dfki-120",
                                .experiment = "static-cycle",
                                .duration_s = 6.0,
                                .with_truth = true,
                                .conditions = {.age = age}}),
                      "truth_spring_deflection_rad");
  };
  // 120 Nm = K x + f + μ K x, and half the play on top of x [deg].
  const double fresh_deg = (120.0 - 0.957) / 1.0317 / 19.8 + 0.01;
  const double old_deg = (120.0 - 2.0 * 0.957) / (1.0 + 2.0 * 0.0317) / (0.9 * 19.8) + 0.03;
  EXPECT_NEAR(deflection_rad(1.0) / deflection_rad(0.0), old_deg / fresh_deg, 0.002);
}

TEST(SimulateWithFaults, AWeakMotorNeedsMoreCurrent) {
  const Recording sound = simulate(faulty_sweep({}));
  const Recording faulty = simulate(
      faulty_sweep({{.what = "torque-constant", .kind = FaultKind::drift, .amount = 0.5}}));
  EXPECT_NEAR(faulty.channel("motor_current_A").values[3000] /
                  sound.channel("motor_current_A").values[3000],
              2.0, 0.2);
}

TEST(FaultInjector, InjectsInPreparedSpaceAndKeepsItsSchedule) {
  using Injection = FaultInjector::Injection;
  FaultInjector injector({{gear(FaultKind::jump, 1.0)}}, data_sheet("dfki-50"));
  const Injection jump{.kind = FaultKind::jump,
                       .value = &Measurement::middle_angle_rad,
                       .is_fresh = &Measurement::is_middle_angle_fresh,
                       .amount = 0.5};
  const auto angle_at = [&](double time_s) {
    Measurement measured{.middle_angle_rad = 0.25};
    injector.apply(measured, time_s);
    return measured.middle_angle_rad;
  };
  injector.prepare(std::vector{jump}, 2);
  EXPECT_TRUE(injector.inject(jump));
  EXPECT_EQ(angle_at(0.0), 0.75);
  Injection short_one = jump;
  short_one.end_s = 0.02;
  EXPECT_TRUE(injector.inject(short_one));
  EXPECT_FALSE(injector.inject(jump)) << "no space";
  EXPECT_EQ(angle_at(0.01), 1.25);
  Injection later = jump;
  later.start_s = 0.02;
  EXPECT_TRUE(injector.inject(later)) << "one has ended";
  EXPECT_EQ(angle_at(0.04), 2.25) << "with that of the schedule";
  injector.end_injections();
  EXPECT_EQ(angle_at(0.041), 1.25);
  Injection part{.factor = &PlantCondition::friction_factor, .amount = 2.0};
  EXPECT_TRUE(injector.inject(part));
  EXPECT_EQ(injector.condition(0.05).friction_factor, 2.0);
  injector.end_injections();
  EXPECT_EQ(injector.condition(0.05).friction_factor, 1.0);
}

}  // namespace
}  // namespace torsio

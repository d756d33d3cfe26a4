// Sensors that write something else than their quantity: coded numbers, held values, a torque that is switched off.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "check/check_support.hpp"
#include "torsio/data/mapping.hpp"
#include "torsio/sim/experiments/experiment.hpp"

namespace torsio {
namespace {

using test::add_record;
using test::alone;
using test::bench_recording;
using test::changed;
using test::findings_of;
using test::first_of;
using test::text_of;
using test::verdict_of;

constexpr double kCode_Nm = 0.02;

/// The torque in whole codes, each made another number.
Recording coded(const std::function<double(double)>& code) {
  return changed(bench_recording("coded"), [&](Channel& channel) {
    if (channel.name != "torque_Nm") return;
    for (double& value : channel.values) value = kCode_Nm * code(std::round(value / kCode_Nm));
  });
}

TEST(CheckSensors, NameSignedNumbersThatWereReadAsUnsigned) {
  const auto findings =
      findings_of(alone(coded([](double n) { return n < 0.0 ? n + 65536.0 : n; })));
  ASSERT_EQ(verdict_of(findings, "coding"), Verdict::fail) << text_of(findings);
  const Finding& found = first_of(findings, "coding");
  EXPECT_NE(found.message.find("65536 of its steps"), std::string::npos) << found.message;
  EXPECT_NE(found.advice.find("modulus: 1310.72"), std::string::npos) << found.advice;
  // Numbers that are still coded have no sign.
  EXPECT_TRUE(std::ranges::none_of(findings, [](const Finding& finding) {
    return finding.check == "sign";
  })) << text_of(findings);
}

TEST(CheckSensors, NameASignBit) {
  const auto findings =
      findings_of(alone(coded([](double n) { return n < 0.0 ? 1024.0 - n : n; })));
  ASSERT_EQ(verdict_of(findings, "coding"), Verdict::fail) << text_of(findings);
  const Finding& found = first_of(findings, "coding");
  EXPECT_NE(found.message.find("1024 of its steps"), std::string::npos) << found.message;
  EXPECT_NE(found.advice.find("sign_bit: 20.48"), std::string::npos) << found.advice;
}

TEST(CheckSensors, NameAnAngleThatBeginsAgainAfterATurn) {
  const auto findings = findings_of(alone(changed(bench_recording("turns"), [](Channel& channel) {
    if (channel.name == "torque_Nm") return;
    for (double& value : channel.values) {
      const double turned = value + 6.0;  // joint and gear pass through a whole turn
      value = turned - 2.0 * M_PI * std::floor(turned / (2.0 * M_PI));
    }
  })));
  ASSERT_EQ(verdict_of(findings, "coding"), Verdict::fail) << text_of(findings);
  EXPECT_NE(first_of(findings, "coding").advice.find("unwrap: 6.28318531"), std::string::npos)
      << first_of(findings, "coding").advice;
}

/// The angle of one turn, in a channel in which that is `turn`.
double within_turn(double value, double turn) { return value - turn * std::floor(value / turn); }

TEST(CheckSensors, NameTheTurnOfAMotorBeforeItsGear) {
  constexpr double kTurn = 2.0 * M_PI / 100.0;
  Recording motor = changed(bench_recording("motor"), [](Channel& channel) {
    if (channel.name != "gear_angle_rad") return;
    for (double& value : channel.values) value = within_turn(value, kTurn);
  });
  motor.mapping = "channels: {gear_angle_rad: {from: motor_deg, unit: deg, gear_ratio: 100}}";
  const auto findings = findings_of(alone(motor));
  ASSERT_EQ(verdict_of(findings, "coding"), Verdict::fail) << text_of(findings);
  const std::string& advice = first_of(findings, "coding").advice;
  EXPECT_NE(advice.find("unwrap: 360 to the rule of gear_angle_rad"), std::string::npos) << advice;
  EXPECT_NE(advice.find("zero:"), std::string::npos) << advice;
  EXPECT_EQ(text_of(findings).find("gaps"), std::string::npos) << text_of(findings);
}

TEST(CheckSensors, NameOneCrossingOfAWholeTurnButNoSlip) {
  const auto crossing = [](double jump) {
    return findings_of(alone(changed(bench_recording("once"), [jump](Channel& channel) {
      if (channel.name != "joint_angle_rad") return;
      for (std::size_t n = 2000; n < channel.values.size(); ++n) channel.values[n] += jump;
    })));
  };
  const auto turned = crossing(2.0 * M_PI);
  EXPECT_EQ(verdict_of(turned, "coding"), Verdict::fail) << text_of(turned);
  EXPECT_EQ(text_of(turned).find("gaps"), std::string::npos) << text_of(turned);
  const auto slipped = crossing(1.0);
  EXPECT_EQ(verdict_of(slipped, "coding"), Verdict::pass) << text_of(slipped);
  EXPECT_EQ(verdict_of(slipped, "gaps"), Verdict::warn) << text_of(slipped);
}

TEST(CheckSensors, RecogniseASensorThatIsHeldInAFasterLog) {
  const auto held = [](bool is_marked) {
    return alone(changed(bench_recording("held"), [is_marked](Channel& channel) {
      if (channel.name != "torque_Nm") return;
      for (std::size_t n = 0; n < channel.values.size(); ++n) {
        if (is_marked) channel.fresh.push_back(n % 20 == 0 ? 1 : 0);
        if (n % 20 != 0) channel.values[n] = channel.values[n - 1];
      }
    }));
  };
  const auto findings = findings_of(held(false));
  EXPECT_EQ(verdict_of(findings, "delay"), Verdict::pass) << text_of(findings);
  ASSERT_EQ(verdict_of(findings, "resolution"), Verdict::warn) << text_of(findings);
  EXPECT_NE(first_of(findings, "resolution").message.find("a sensor of 50 Hz"), std::string::npos);
  EXPECT_NE(first_of(findings, "resolution").advice.find("hold: [torque_Nm]"), std::string::npos);
  EXPECT_EQ(verdict_of(findings_of(held(true)), "resolution"), Verdict::pass);
}

TEST(CheckSensors, FindATorqueThatIsSwitchedOffBeforeTheEnd) {
  const auto findings = findings_of(alone(changed(bench_recording("off"), [](Channel& channel) {
    if (channel.name != "torque_Nm") return;
    for (std::size_t n = 3500; n < channel.values.size(); ++n)
      channel.values[n] = 0.01 * std::sin(1e3 * static_cast<double>(n));
  })));
  ASSERT_NE(verdict_of(findings, "frozen sensors"), Verdict::pass) << text_of(findings);
  const Finding& found = first_of(findings, "frozen sensors");
  EXPECT_NE(found.message.find("to the end"), std::string::npos) << found.message;
  // The advice is a line of a mapping.
  EXPECT_NO_THROW((void)parse_mapping(found.advice.substr(found.advice.find("to: ")), "advice"));
}

TEST(CheckSensors, WarnWhereTheZeroIsTakenInMotion) {
  const auto zeroed_in = [](double first_s) {
    Recording recording = bench_recording("zero");
    recording.zeros = {{.channel = "torque_Nm", .first_s = first_s}};
    return verdict_of(findings_of(alone(recording)), "offsets");
  };
  EXPECT_EQ(zeroed_in(0.2), Verdict::warn);
  EXPECT_EQ(zeroed_in(0.008), Verdict::pass);  // too short for a motion beyond the noise
}

TEST(CheckSensors, TakeATemperatureForWhatItIs) {
  Dataset dataset;
  for (const double temperature_degC : {20.0, 40.0, 60.0}) {
    Recording recording =
        changed(bench_recording("at_" + std::to_string(temperature_degC)), [&](Channel& channel) {
          if (channel.name == "torque_Nm")
            for (double& value : channel.values) value += 1.5 * (temperature_degC - 20.0);
        });
    Channel temperature{"case_K", std::vector<double>(recording.size())};
    for (std::size_t n = 0; n < recording.size(); ++n)
      temperature.values[n] = temperature_degC + 0.1 * std::sin(0.01 * static_cast<double>(n));
    recording.add(std::move(temperature));
    dataset.records.push_back(alone(std::move(recording)).records.front());
  }
  dataset.target = "torque_Nm";
  const auto without =
      findings_of(dataset, resolve_inputs(dataset, {"gear_angle_rad - joint_angle_rad"}));
  EXPECT_NE(verdict_of(without, "offsets"), Verdict::pass) << text_of(without);
  const auto with =
      findings_of(dataset, resolve_inputs(dataset, {"gear_angle_rad - joint_angle_rad", "case_K"}));
  EXPECT_EQ(verdict_of(with, "offsets"), Verdict::pass) << text_of(with);
}

TEST(CheckSensors, FailWhereTheInputsExplainLittle) {
  const auto findings = findings_of(alone(changed(bench_recording("folded"), [](Channel& channel) {
    if (channel.name == "torque_Nm")
      for (std::size_t n = 0; n < channel.values.size(); ++n)
        channel.values[n] += 40.0 * std::sin(0.05 * static_cast<double>(n));
  })));
  ASSERT_EQ(verdict_of(findings, "training data"), Verdict::fail) << text_of(findings);
}

/// Friction that grows with the load: 20 Nm/rad loading and 33 unloading, the same in each cycle.
TEST(CheckSensors, DoNotTakeALoadDependentFrictionForAChange) {
  for (const double cycles : {1.0, 2.0, 3.0, 5.0}) {
    Recording recording("loaded", 100.0);
    Channel deflection{"spring_deflection_rad", {}};
    Channel torque{"torque_Nm", {}};
    Random random(7);
    const auto samples = static_cast<std::size_t>(4000.0 * cycles);
    double last = 0.0;
    for (std::size_t n = 0; n < samples; ++n) {
      const double phase = 2.0 * M_PI * static_cast<double>(n) / 4000.0;
      const double x = 0.5 * std::sin(phase);
      const double direction = std::tanh((x - last) / 1e-4);
      last = x;
      const double spring_Nm = 26.0 * x;
      deflection.values.push_back(x);
      torque.values.push_back(spring_Nm + 0.25 * std::abs(spring_Nm) * direction +
                              0.05 * random.normal());
    }
    recording.add(std::move(deflection));
    recording.add(std::move(torque));
    const auto findings = findings_of(alone(recording));
    EXPECT_EQ(verdict_of(findings, "change"), Verdict::pass) << cycles << ": " << text_of(findings);
  }
}

/// A deflection with dry friction inside: 20 Nm/rad where the load grows, 33 where it falls. The load holds at its extremes,
/// as a command of ramps makes it.
Recording wedge_recording(std::size_t cycles) {
  constexpr double kLoading_Nm_rad = 20.0;
  constexpr double kUnloading_Nm_rad = 33.0;
  constexpr double kPeriod_s = 30.0;
  constexpr std::size_t kWedgeRate_Hz = 50;
  const auto command_Nm = [](double t_s) {
    const double phase = 4.0 * std::fmod(t_s, kPeriod_s) / kPeriod_s;
    const double triangle = phase < 1.0 ? phase : phase < 3.0 ? 2.0 - phase : phase - 4.0;
    return std::clamp(9.0 * triangle, -7.0, 7.0);
  };
  Random random(5);
  Channel deflection{"spring_deflection_rad", {}};
  Channel torque{"torque_Nm", {}};
  double load_Nm = 0.0;
  double x = 0.0;
  for (std::size_t n = 0; n < cycles * 30 * kWedgeRate_Hz; ++n) {
    const double next_Nm = command_Nm(static_cast<double>(n) / kWedgeRate_Hz);
    const bool is_loading = std::abs(next_Nm) > std::abs(load_Nm);
    x += (next_Nm - load_Nm) / (is_loading ? kLoading_Nm_rad : kUnloading_Nm_rad);
    load_Nm = next_Nm;
    deflection.values.push_back(x + 1e-3 * random.normal());
    torque.values.push_back(load_Nm + 0.02 * random.normal());
  }
  Recording recording("wedge", static_cast<double>(kWedgeRate_Hz));
  recording.add(std::move(deflection));
  recording.add(std::move(torque));
  return recording;
}

TEST(CheckSensors, CompareBranchesOfALoadDependentFrictionWithEachOther) {
  for (const std::size_t cycles : {1, 2, 3, 4, 5}) {
    const auto findings = findings_of(alone(wedge_recording(cycles)));
    EXPECT_EQ(verdict_of(findings, "change"), Verdict::pass) << cycles << ": " << text_of(findings);
  }
  // A zero that slips between the cycles is found all the same.
  const auto findings = findings_of(alone(changed(wedge_recording(4), [](Channel& channel) {
    if (channel.name == "torque_Nm")
      for (std::size_t n = channel.values.size() / 2; n < channel.values.size(); ++n)
        channel.values[n] += 1.5;
  })));
  EXPECT_EQ(verdict_of(findings, "change"), Verdict::warn) << text_of(findings);
}

TEST(CheckSensors, DoNotTakeACreepUnderNoLoadForATorqueThatIsSwitchedOff) {
  for (const std::uint64_t seed : {101, 102}) {
    const auto findings = findings_of(
        alone(simulate({.actuator = "elastomer:unbonded", .experiment = "hold", .seed = seed})));
    EXPECT_EQ(verdict_of(findings, "frozen sensors"), Verdict::pass) << text_of(findings);
  }
}

TEST(CheckSensors, DoNotTakeADriftForADelay) {
  const auto findings = findings_of(alone(changed(bench_recording("warm"), [](Channel& channel) {
    if (channel.name == "torque_Nm")
      for (std::size_t n = 0; n < channel.values.size(); ++n)
        channel.values[n] += 1e-4 * static_cast<double>(n);
  })));
  EXPECT_EQ(verdict_of(findings, "delay"), Verdict::pass) << text_of(findings);
}

TEST(CheckSensors, NameTheLimitOfAnAmplifierInItsNoise) {
  Random random(3);
  const auto clipped = [&](double limit_Nm) {
    return findings_of(alone(changed(bench_recording("clipped"), [&](Channel& channel) {
      if (channel.name != "torque_Nm") return;
      for (double& value : channel.values)
        value = std::clamp(value, -limit_Nm, limit_Nm) + 0.02 * random.normal();
    })));
  };
  const auto findings = clipped(6.0);
  ASSERT_EQ(verdict_of(findings, "saturation"), Verdict::warn) << text_of(findings);
  EXPECT_NE(first_of(findings, "saturation").message.find("within its noise"), std::string::npos);
  EXPECT_EQ(verdict_of(clipped(1e3), "saturation"), Verdict::pass);
  // With most of the torque beyond the limit a model would be that of the limit.
  const auto hidden = clipped(3.0);
  EXPECT_EQ(verdict_of(hidden, "saturation"), Verdict::fail) << text_of(hidden);
}

TEST(CheckSensors, NameTheOnlyEndAtWhichATorqueStays) {
  Random random(4);
  const auto findings =
      findings_of(alone(changed(bench_recording("one side"), [&](Channel& channel) {
        if (channel.name != "torque_Nm") return;
        for (double& value : channel.values) value = std::min(value, 3.0) + 0.02 * random.normal();
      })));
  ASSERT_EQ(verdict_of(findings, "saturation"), Verdict::warn) << text_of(findings);
  const std::string& message = first_of(findings, "saturation").message;
  EXPECT_NE(message.find("at one end of its values, 3."), std::string::npos) << message;
}

TEST(CheckSensors, DoNotFailALoadThatPullsToOneSideOnly) {
  Random random(5);
  const auto findings =
      findings_of(alone(changed(bench_recording("unilateral"), [&](Channel& channel) {
        if (channel.name != "torque_Nm") return;
        for (double& value : channel.values)
          value = std::max(value - 4.0, 0.0) + 0.02 * random.normal();
      })));
  ASSERT_EQ(verdict_of(findings, "saturation"), Verdict::warn) << text_of(findings);
  EXPECT_NE(first_of(findings, "saturation").message.find("within its noise at zero"),
            std::string::npos);
}

TEST(CheckSensors, PassAFewMissingTorquesAndAdviseToHoldThoseOfASlowerSensor) {
  const auto missing = [](auto is_missing) {
    return findings_of(alone(changed(bench_recording("missing"), [&](Channel& channel) {
      if (channel.name != "torque_Nm") return;
      for (std::size_t n = 0; n < channel.values.size(); ++n)
        if (is_missing(n)) channel.values[n] = kNotMeasured;
    })));
  };
  const auto two = missing([](std::size_t n) { return n < 2; });
  EXPECT_EQ(verdict_of(two, "missing values"), Verdict::pass) << text_of(two);
  EXPECT_NE(first_of(two, "missing values").message.find("2 of"), std::string::npos);
  const auto slower = missing([](std::size_t n) { return n % 4 != 0; });
  EXPECT_EQ(verdict_of(slower, "missing values"), Verdict::warn) << text_of(slower);
  EXPECT_NE(first_of(slower, "missing values").advice.find("hold: [torque_Nm]"), std::string::npos);
}

TEST(CheckSensors, FailForTheAmountOfATorque) {
  const auto findings = findings_of(alone(changed(bench_recording("amount"), [](Channel& channel) {
    if (channel.name == "torque_Nm")
      for (double& value : channel.values) value = std::abs(value);
  })));
  ASSERT_EQ(verdict_of(findings, "sign"), Verdict::fail) << text_of(findings);
  EXPECT_NE(first_of(findings, "sign").message.find("the amount of a torque"), std::string::npos);
}

TEST(CheckSensors, NameAValueThatIsWrittenInsteadOfAMeasurement) {
  for (const double written : {0.0, 500.0}) {
    const auto findings = findings_of(alone(changed(bench_recording("gone"), [&](Channel& channel) {
      if (channel.name == "torque_Nm")
        for (std::size_t n = 40; n < channel.values.size(); n += 97) channel.values[n] = written;
    })));
    ASSERT_EQ(verdict_of(findings, "spikes"), Verdict::warn) << text_of(findings);
    const std::string& advice = first_of(findings, "spikes").advice;
    EXPECT_NE(advice.find(fmt::format("missing: [{:g}]", written)), std::string::npos) << advice;
  }
}

/// The bench with a joint that turns through more than half a turn.
Recording turning(const std::function<double(double)>& more_Nm) {
  const Recording bench = bench_recording("turning", {.samples = 16000});
  std::vector<double> angle;
  for (std::size_t n = 0; n < bench.size(); ++n)
    angle.push_back(2.0 * std::sin(2.1e-3 * static_cast<double>(n)));
  const std::vector<double> joint = bench.channel("joint_angle_rad").values;
  return changed(bench, [&](Channel& channel) {
    for (std::size_t n = 0; n < angle.size(); ++n)
      channel.values[n] += channel.name == "torque_Nm" ? more_Nm(angle[n]) : angle[n] - joint[n];
  });
}

TEST(CheckSensors, WarnOfATorqueThatFollowsTheAngleOfTheJoint) {
  const auto bent = findings_of(alone(turning([](double q) { return 1.5 * std::cos(q); })));
  ASSERT_EQ(verdict_of(bent, "position"), Verdict::warn) << text_of(bent);
  const auto straight = findings_of(alone(turning([](double) { return 0.0; })));
  EXPECT_EQ(verdict_of(straight, "position"), Verdict::pass) << text_of(straight);
}

TEST(CheckSensors, DistinguishTwoClocksFromADelay) {
  const Recording bench = bench_recording("clocks", {.samples = 8000});
  const std::vector<double> torque = bench.channel("torque_Nm").values;
  const auto late = [&](double samples, double share) {
    return findings_of(alone(changed(bench, [&](Channel& channel) {
      if (channel.name != "torque_Nm") return;
      for (std::size_t n = 0; n < torque.size(); ++n) {
        const double at = (1.0 - share) * static_cast<double>(n) - samples;
        channel.values[n] = torque[static_cast<std::size_t>(std::max(at, 0.0))];
      }
    })));
  };
  const auto two_clocks = late(0.0, 0.01);
  ASSERT_EQ(verdict_of(two_clocks, "delay"), Verdict::warn) << text_of(two_clocks);
  EXPECT_NE(first_of(two_clocks, "delay").message.find("two clocks"), std::string::npos)
      << text_of(two_clocks);
  const auto constant = late(40.0, 0.0);
  ASSERT_EQ(verdict_of(constant, "delay"), Verdict::warn) << text_of(constant);
  EXPECT_NE(first_of(constant, "delay").message.find(" ms after "), std::string::npos)
      << text_of(constant);
}

TEST(CheckSensors, WarnOfAZeroThatWarmsUp) {
  const auto findings = findings_of(alone(changed(
      bench_recording("cold", {.friction_Nm = 0.2, .samples = 16000}), [](Channel& channel) {
        if (channel.name == "torque_Nm")
          for (std::size_t n = 0; n < channel.values.size(); ++n)
            channel.values[n] += 3.0 * -std::expm1(-static_cast<double>(n) / 3000.0);
      })));
  EXPECT_EQ(verdict_of(findings, "change"), Verdict::warn) << text_of(findings);
}

TEST(CheckSensors, FindTorquesThatWereComputed) {
  const auto rounded = [](double value) { return 1e-3 * std::round(1e3 * value); };
  const Recording bench = bench_recording("computed");
  const std::vector<double>& gear = bench.channel("gear_angle_rad").values;
  const std::vector<double>& joint = bench.channel("joint_angle_rad").values;
  for (const double share : {1.0, 0.2}) {  // unfiltered, low-passed
    double torque_Nm = 300.0 * (gear[0] - joint[0]);
    const auto findings = findings_of(alone(changed(bench, [&](Channel& channel) {
      if (channel.name != "torque_Nm") return;
      for (std::size_t n = 0; n < channel.values.size(); ++n) {
        torque_Nm += share * (300.0 * (gear[n] - joint[n]) - torque_Nm);
        channel.values[n] = rounded(torque_Nm);
      }
    })));
    ASSERT_EQ(verdict_of(findings, "leak"), Verdict::fail) << share << text_of(findings);
    EXPECT_NE(first_of(findings, "leak").advice.find("No sensor measured"), std::string::npos);
  }
  const auto findings_beside = [&](const char* name) {
    Recording beside = bench;
    Channel other{name, {}};
    for (const double value : bench.channel("torque_Nm").values)
      other.values.push_back(rounded(value / 11.0));
    beside.add(other);
    return findings_of(alone(changed(beside, [&](Channel& channel) {
      if (channel.name == "torque_Nm")
        for (std::size_t n = 0; n < channel.values.size(); ++n)
          channel.values[n] = rounded(11.0 * other.values[n]);
    })));
  };
  const auto of_current = findings_beside("motor_current_A");
  EXPECT_EQ(verdict_of(of_current, "leak"), Verdict::warn) << text_of(of_current);
  // The cell of a lever measures its force.
  const auto of_force = findings_beside("cell_force_N");
  EXPECT_EQ(verdict_of(of_force, "leak"), Verdict::pass) << text_of(of_force);
}

TEST(CheckSensors, NameTheTestRecordingWhoseZeroIsAnother) {
  Dataset dataset;
  add_record(dataset, bench_recording("trained"), Role::train);
  add_record(dataset,
             changed(bench_recording("tested"),
                     [](Channel& channel) {
                       if (channel.name == "torque_Nm")
                         for (double& value : channel.values) value += 6.0;
                     }),
             Role::test);
  const auto findings = findings_of(dataset);
  ASSERT_EQ(verdict_of(findings, "offsets"), Verdict::warn) << text_of(findings);
  EXPECT_EQ(first_of(findings, "offsets").recording, "tested");
  EXPECT_NE(
      first_of(findings, "offsets").message.find("6 Nm away from that of the training recordings"),
      std::string::npos)
      << text_of(findings);
}

TEST(CheckSensors, ReadALogOfTenHertzWithTheDefaultInputs) {
  Recording slow("slow", 10.0);
  const Recording fast = wedge_recording(5);
  for (const Channel& channel : fast.channels()) {
    Channel every_fifth{channel.name, {}};
    for (std::size_t n = 0; n < channel.values.size(); n += 5)
      every_fifth.values.push_back(channel.values[n]);
    slow.add(std::move(every_fifth));
  }
  const auto findings = findings_of(alone(slow));
  EXPECT_TRUE(std::ranges::none_of(findings, [](const Finding& finding) {
    return finding.verdict == Verdict::fail;
  })) << text_of(findings);
}

}  // namespace
}  // namespace torsio

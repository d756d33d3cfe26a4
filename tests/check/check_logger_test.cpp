// Faults of recordings as loggers write them: bursts without measurements, a clock or a speed in another unit, blocks that
// are written twice.
#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include "check/check_support.hpp"
#include "check/dropouts.hpp"
#include "torsio/core/random.hpp"

namespace torsio {
namespace {

using test::alone;
using test::bench_recording;
using test::findings_of;
using test::first_of;
using test::text_of;
using test::verdict_of;
using test::with_channel;

/// Ten seconds of the made-up bench.
Recording long_bench() { return bench_recording("long", {.samples = 10000}); }

/// Where a bus loses frames: burst k begins at sample 700 + 1130 k and has 42 + 8 k samples.
template <class Body>
void for_each_burst(std::size_t bursts, const Body& body) {
  for (std::size_t k = 0; k < bursts; ++k) body(700 + 1130 * k, 42 + 8 * k);
}

TEST(CheckDropouts, WarnOfBurstsOfOneValueHoweverMany) {
  for (const std::size_t bursts : {2U, 5U, 8U})
    for (const double written : {0.0, 3.25}) {
      const auto findings =
          findings_of(alone(with_channel(long_bench(), "torque_Nm", [&](Channel& channel) {
            for_each_burst(bursts, [&](std::size_t begin, std::size_t length) {
              std::fill_n(channel.values.begin() + static_cast<std::ptrdiff_t>(begin), length,
                          written);
            });
          })));
      ASSERT_EQ(verdict_of(findings, "frozen sensors"), Verdict::warn) << bursts << '\n'
                                                                       << text_of(findings);
      const Finding& found = first_of(findings, "frozen sensors");
      EXPECT_NE(
          found.message.find(written == 0.0 ? "is exactly 0 Nm in " : "is exactly 3.25 Nm in "),
          std::string::npos)
          << found.message;
      EXPECT_NE(found.advice.find(written == 0.0 ? "missing: [0]" : "missing: [3.25]"),
                std::string::npos)
          << found.advice;
      EXPECT_EQ(verdict_of(findings, "gaps"), Verdict::pass) << text_of(findings);
      EXPECT_EQ(verdict_of(findings, "change"), Verdict::pass) << text_of(findings);
    }
}

TEST(CheckDropouts, WarnOfBurstsThatKeepTheLastValue) {
  const auto findings =
      findings_of(alone(with_channel(long_bench(), "torque_Nm", [&](Channel& channel) {
        for_each_burst(8, [&](std::size_t begin, std::size_t length) {
          std::fill_n(channel.values.begin() + static_cast<std::ptrdiff_t>(begin), length,
                      channel.values[begin]);
        });
      })));
  ASSERT_EQ(verdict_of(findings, "frozen sensors"), Verdict::warn) << text_of(findings);
  const Finding& found = first_of(findings, "frozen sensors");
  EXPECT_NE(found.message.find("keeps its last value in "), std::string::npos) << found.message;
}

TEST(CheckDropouts, AreNotFoundInACommandThatStepsOrInCoarseCodes) {
  Channel steps{"command_rad", {}};
  Channel coarse{"angle_rad", {}};
  for (int n = 0; n < 4000; ++n) {
    steps.values.push_back(n / 400 % 2 == 0 ? 0.0 : 1.0);
    coarse.values.push_back(0.1 * std::round(10.0 * std::sin(3e-3 * n)));
  }
  EXPECT_FALSE(find_dropouts(steps, 0.05));
  EXPECT_FALSE(find_dropouts(coarse, 0.05));
}

TEST(CheckGaps, WarnOfSeveralJumpsOfOneHeight) {
  const auto findings =
      findings_of(alone(with_channel(long_bench(), "torque_Nm", [&](Channel& channel) {
        for_each_burst(2, [&](std::size_t begin, std::size_t length) {
          for (std::size_t i = begin; i < begin + length; ++i) channel.values[i] += 10.0;
        });
      })));
  ASSERT_EQ(verdict_of(findings, "gaps"), Verdict::warn) << text_of(findings);
  const std::string& message = first_of(findings, "gaps").message;
  EXPECT_NE(message.find("torque_Nm jumps 4 times by "), std::string::npos) << message;
  EXPECT_NE(message.find("t = 0.7 s"), std::string::npos) << message;
}

TEST(CheckGaps, WarnOfSeveralSlipsOfOneAngle) {
  const auto findings =
      findings_of(alone(with_channel(long_bench(), "gear_angle_rad", [&](Channel& channel) {
        for (const std::size_t begin : {2000U, 5000U, 8000U})
          for (std::size_t i = begin; i < channel.values.size(); ++i) channel.values[i] += 0.006;
      })));
  ASSERT_EQ(verdict_of(findings, "gaps"), Verdict::warn) << text_of(findings);
  const std::string& message = first_of(findings, "gaps").message;
  EXPECT_NE(message.find("spring_deflection_rad jumps 3 times by 0.00"), std::string::npos)
      << message;
  EXPECT_NE(message.find("comes from gear_angle_rad"), std::string::npos) << message;
}

/// The same samples at another rate, read from a column of stamps.
Recording at_rate(double rate_Hz, const std::string& column, const std::string& unit) {
  Recording recording("clock", rate_Hz);
  const Recording sound = long_bench();
  for (Channel channel : sound.channels()) recording.add(std::move(channel));
  recording.columns = {{"t_s", column, unit}};
  return recording;
}

TEST(CheckClock, NameStampsInAnotherUnit) {
  struct Case {
    double rate_Hz;
    std::string unit;
    std::string factor;
    std::string line;
  };
  for (const Case& each :
       {Case{1.0, "s", "1000 times too slow", "channels: {t_s: {from: stamp, unit: ms}}"},
        Case{1.0, "ms", "1000 times too slow", "channels: {t_s: {from: stamp, unit: us}}"},
        Case{1e-3, "s", "1e+06 times too slow", "channels: {t_s: {from: stamp, unit: us}}"},
        Case{1e6, "ms", "1000 times too fast", "channels: {t_s: {from: stamp, unit: s}}"}}) {
    const auto findings =
        check_dataset(alone(at_rate(each.rate_Hz, "stamp", each.unit)),
                      {.inputs = {"gear_angle_rad - joint_angle_rad"}, .definitions = {}});
    ASSERT_EQ(verdict_of(findings, "clock"), Verdict::warn) << each.line;
    const Finding& found = first_of(findings, "clock");
    EXPECT_NE(found.message.find(each.factor), std::string::npos) << found.message;
    EXPECT_NE(found.advice.find(each.line), std::string::npos) << found.advice;
  }
}

TEST(CheckClock, ReportNothingAtUsualRates) {
  for (const double rate_Hz : {10.0, 100.0, 1000.0, 2e4})
    EXPECT_EQ(
        text_of(check_dataset(alone(at_rate(rate_Hz, "stamp", "s")),
                              {.inputs = {"gear_angle_rad - joint_angle_rad"}, .definitions = {}}))
            .find("clock"),
        std::string::npos)
        << rate_Hz;
}

/// The bench with a speed of the joint from another sensor, `factor` times what it is.
Recording with_speed(double factor) {
  Recording recording = long_bench();
  Random random(6);
  Channel speed{"joint_speed_rad_s", {}};
  for (std::size_t n = 0; n < recording.size(); ++n)
    speed.values.push_back(
        factor * (0.36 * std::cos(9e-4 * static_cast<double>(n)) + 0.01 * random.normal()));
  recording.add(std::move(speed));
  recording.columns = {{"joint_speed_rad_s", "omega", "rad_s"}};
  return recording;
}

TEST(CheckRates, CompareASpeedWithTheDerivativeOfItsAngle) {
  EXPECT_EQ(verdict_of(findings_of(alone(with_speed(1.0))), "units"), Verdict::pass);
  for (const auto& [factor, entry] :
       {std::pair{180.0 / std::numbers::pi, "unit: deg_s"}, std::pair{-1.0, "sign: -1"},
        std::pair{30.0 / std::numbers::pi, "unit: rpm"},
        std::pair{-180.0 / std::numbers::pi, "unit: deg_s, sign: -1"}}) {
    const auto findings = findings_of(alone(with_speed(factor)));
    ASSERT_EQ(verdict_of(findings, "units"), Verdict::fail) << factor;
    const std::string line =
        std::string("channels: {joint_speed_rad_s: {from: omega, ") + entry + "}}";
    EXPECT_TRUE(std::ranges::any_of(
        findings,
        [&](const Finding& finding) { return finding.advice.find(line) != std::string::npos; }))
        << line << '\n'
        << text_of(findings);
  }
  const auto geared = findings_of(alone(with_speed(40.0)));
  EXPECT_EQ(verdict_of(geared, "units"), Verdict::warn) << text_of(geared);
}

TEST(CheckRepeats, NameEveryBlockThatIsWrittenTwice) {
  Recording recording("flushed", 1000.0);
  const Recording bench = long_bench();
  for (Channel copy : bench.channels()) {
    const std::vector<double> sound = copy.values;
    const auto flush = [&](std::size_t at, double rounding) {
      for (std::size_t i = 0; i < 512; ++i)
        copy.values[at + 512 + i] = sound[at + i] * (1.0 + rounding);
    };
    flush(2003, 0.0);
    flush(7001, 1e-15);  // as after resampling
    recording.add(std::move(copy));
  }
  const auto findings = findings_of(alone(recording));
  ASSERT_EQ(verdict_of(findings, "repeats"), Verdict::warn) << text_of(findings);
  const Finding& found = first_of(findings, "repeats");
  ASSERT_EQ(found.places.size(), 2U) << found.message;
  EXPECT_EQ(found.places[0].begin, 2515U);
  EXPECT_EQ(found.places[1].begin, 7513U);
  EXPECT_NE(found.message.find("again from t = 7.513 s on"), std::string::npos) << found.message;
}

TEST(CheckUnits, NameBothAnglesWhereOneHasAWrongNumberOfCounts) {
  Recording recording = with_channel(long_bench(), "joint_angle_rad", [](Channel& channel) {
    for (double& value : channel.values) value *= 4.0;
  });
  recording.mapping =
      "channels: {gear_angle_rad: {from: motor, unit: rev, scale: 1/262144}, joint_angle_rad: "
      "{from: "
      "link, unit: rev, scale: 1/4096}}";
  const auto findings = findings_of(alone(recording));
  ASSERT_EQ(verdict_of(findings, "units"), Verdict::fail) << text_of(findings);
  const std::string& advice = first_of(findings, "units").advice;
  EXPECT_EQ(advice.find("remove gear_ratio"), std::string::npos) << advice;
  EXPECT_NE(advice.find("write scale: 6.10351562e-05 instead of 0.000244140625 into the rule of "
                        "joint_angle_rad"),
            std::string::npos)
      << advice;
  EXPECT_NE(advice.find("into the rule of gear_angle_rad"), std::string::npos) << advice;
}

/// Within half a turn about 0.
double within_half_turn(double value) {
  constexpr double kTurn = 2.0 * std::numbers::pi;
  return value - kTurn * std::round(value / kTurn);
}

TEST(CheckCoding, GivesTheOneWrappedAngleOfTwoTheTurnOfTheOther) {
  Recording recording("wrapped", 1000.0);
  const Recording sound = long_bench();
  for (Channel channel : sound.channels()) {
    if (channel.name != "torque_Nm")
      for (double& value : channel.values) value += 3.2;
    if (channel.name == "joint_angle_rad")
      for (double& value : channel.values) value = within_half_turn(value);
    recording.add(std::move(channel));
  }
  recording.columns = {{"joint_angle_rad", "joint_angle_rad", "rad"}};
  const auto findings = findings_of(alone(recording));
  ASSERT_EQ(verdict_of(findings, "coding"), Verdict::fail) << text_of(findings);
  const std::string& advice = first_of(findings, "coding").advice;
  EXPECT_NE(advice.find("channels: {joint_angle_rad: {from: joint_angle_rad, unwrap: 6.28318531, "
                        "offset: 6.28318531}}"),
            std::string::npos)
      << advice;
  EXPECT_EQ(advice.find("zero:"), std::string::npos) << advice;
}

TEST(CheckCoding, PrintsTheSpanInTheUnitOfTheColumn) {
  Recording recording = with_channel(long_bench(), "torque_Nm", [](Channel& channel) {
    for (double& value : channel.values) {
      const double code = std::round(2e3 * value);
      value = 1e-3 * (code - 32768.0 * std::round(code / 32768.0));
    }
  });
  recording.columns = {{"torque_Nm", "torque_mNm", "mNm"}};
  const auto findings = findings_of(alone(recording));
  ASSERT_EQ(verdict_of(findings, "coding"), Verdict::fail) << text_of(findings);
  const std::string& advice = first_of(findings, "coding").advice;
  EXPECT_NE(advice.find("channels: {torque_Nm: {from: torque_mNm, unwrap: 32768}}"),
            std::string::npos)
      << advice;
  EXPECT_EQ(advice.find("zero:"), std::string::npos) << advice;
}

TEST(CheckUnits, WarnOfADeflectionOfAWholeTurn) {
  const Recording turned = with_channel(long_bench(), "joint_angle_rad", [](Channel& channel) {
    for (double& value : channel.values) value -= 2.0 * std::numbers::pi;
  });
  const auto findings = findings_of(alone(turned));
  ASSERT_EQ(verdict_of(findings, "units"), Verdict::warn) << text_of(findings);
  EXPECT_NE(first_of(findings, "units").advice.find("offset: 6.28318531"), std::string::npos)
      << first_of(findings, "units").advice;
}

/// A triangle whose period is 10 s, with a friction that grows with the load.
Recording slow_triangle(double width_rad_s = 0.005) {
  Random random(8);
  Channel deflection{"spring_deflection_rad", {}};
  Channel torque{"torque_Nm", {}};
  double last = 0.0;
  for (int n = 0; n < 60000; ++n) {
    const double x = 0.09 * (2.0 / std::numbers::pi) *
                     std::asin(0.999 * std::sin(2.0 * std::numbers::pi * 1e-4 * n));
    const double load = 300.0 * x + 4000.0 * x * x * x;
    torque.values.push_back(load +
                            0.08 * std::abs(load) * std::tanh(1e3 * (x - last) / width_rad_s) +
                            0.03 * random.normal());
    last = x;
    deflection.values.push_back(x);
  }
  Recording recording("triangle", 1000.0);
  recording.add(std::move(deflection));
  recording.add(std::move(torque));
  return recording;
}

TEST(CheckDelay, IsNotFoundWhereItExplainsHardlyAnything) {
  const auto findings = findings_of(alone(slow_triangle()));
  EXPECT_EQ(verdict_of(findings, "delay"), Verdict::pass) << text_of(findings);
  EXPECT_EQ(verdict_of(findings, "gaps"), Verdict::pass) << text_of(findings);
}

TEST(CheckGaps, AreNotFoundWhereAFrictionReverses) {
  for (const double width_rad_s : {1e-6, 0.002}) {
    const auto findings = findings_of(alone(slow_triangle(width_rad_s)));
    EXPECT_EQ(verdict_of(findings, "gaps"), Verdict::pass) << text_of(findings);
  }
}

/// A sweep whose spring relaxes with two time constants; the stiffness grows by `stiffer` meanwhile.
Recording relaxing_sweep(bool is_upward, double relaxing_Nm_rad, double stiffer) {
  Random random(9);
  Channel deflection{"spring_deflection_rad", {}};
  Channel torque{"torque_Nm", {}};
  double slow = 0.0;
  double fast = 0.0;
  const double rise = std::log(30.0) / 60.0;
  for (int n = 0; n < 30000; ++n) {
    const double t_s = 2e-3 * (is_upward ? n : 29999 - n);
    const double x = 0.09 * std::sin(2.0 * std::numbers::pi * 0.05 / rise * std::expm1(rise * t_s));
    if (n == 0) slow = fast = x;
    slow += 2e-3 / 1.5 * (x - slow);
    fast += 2e-3 / 0.15 * (x - fast);
    deflection.values.push_back(x);
    torque.values.push_back(300.0 * (1.0 + stiffer * n / 30000.0) * x +
                            relaxing_Nm_rad * ((x - slow) + 0.75 * (x - fast)) +
                            0.03 * random.normal());
  }
  Recording recording("relaxing", 500.0);
  recording.add(std::move(deflection));
  recording.add(std::move(torque));
  return recording;
}

TEST(CheckChange, IsNotFoundInASpringThatRelaxesWhileTheRateOfTheMotionChanges) {
  for (const bool is_upward : {true, false}) {
    const auto relaxing = findings_of(alone(relaxing_sweep(is_upward, 80.0, 0.0)));
    EXPECT_EQ(verdict_of(relaxing, "change"), Verdict::pass) << text_of(relaxing);
    for (const double stiffer : {-0.3, 0.3}) {
      const auto changing = findings_of(alone(relaxing_sweep(is_upward, 0.0, stiffer)));
      EXPECT_EQ(verdict_of(changing, "change"), Verdict::warn) << stiffer;
    }
  }
}

TEST(CheckChange, WarnOfAZeroThatDriftsAndReturns) {
  const auto drifting = [](double amplitude_Nm) {
    const Recording sound = bench_recording("drifting", {.samples = 40000});
    return findings_of(alone(with_channel(sound, "torque_Nm", [&](Channel& channel) {
      for (std::size_t n = 0; n < channel.values.size(); ++n)
        channel.values[n] +=
            amplitude_Nm * std::cos(1e-4 * std::numbers::pi * static_cast<double>(n));
    })));
  };
  EXPECT_EQ(verdict_of(drifting(0.0), "change"), Verdict::pass);
  const auto findings = drifting(4.0);
  ASSERT_EQ(verdict_of(findings, "change"), Verdict::warn) << text_of(findings);
  const std::string& message = first_of(findings, "change").message;
  const std::size_t at = message.find("changes slowly by ");
  ASSERT_NE(at, std::string::npos) << message;
  EXPECT_NEAR(std::stod(message.substr(at + 18)), 8.0, 1.0) << message;
}

}  // namespace
}  // namespace torsio

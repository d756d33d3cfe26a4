// Checks of the relation between input and torque: delay, scale, sign, change, other recordings.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <regex>
#include <string>
#include <vector>

#include "check/check_support.hpp"
#include "data/csv/csv_table.hpp"
#include "data/mapping/measured_recordings.hpp"
#include "torsio/core/random.hpp"
#include "torsio/data/mapping.hpp"
#include "torsio/sim/experiments/experiment.hpp"

namespace torsio {
namespace {

using test::add_record;
using test::alone;
using test::bench_recording;
using test::findings_of;
using test::first_of;
using test::text_of;
using test::verdict_of;
using test::with_channel;
using test::with_record;

/// A deflection and the torque of an elastic spring in parallel with a slip element that carries
/// `slip_Nm` and is elastic over `elastic_rad`; `late` samples late.
Recording hysteretic(double frequency_Hz, double slip_Nm, double elastic_rad, std::ptrdiff_t late,
                     std::size_t samples = 20000) {
  Random random(4);
  Channel deflection{"spring_deflection_rad", {}};
  Channel torque{"torque_Nm", {}};
  double slip = 0.0;
  double last = 0.0;
  std::vector<double> now;
  for (std::size_t n = 0; n < samples; ++n) {
    const double phase = 2.0 * std::numbers::pi * frequency_Hz * 1e-3 * static_cast<double>(n);
    const double x = 0.05 * (0.7 * std::sin(phase) + 0.3 * std::sin(2.7 * phase));
    slip = std::clamp(slip + (x - last) / elastic_rad, -1.0, 1.0);
    last = x;
    deflection.values.push_back(x);
    now.push_back(100.0 * x + slip_Nm * slip);
  }
  for (std::ptrdiff_t n = 0; n < static_cast<std::ptrdiff_t>(samples); ++n)
    torque.values.push_back(now[static_cast<std::size_t>(std::max<std::ptrdiff_t>(0, n - late))] +
                            0.005 * random.normal());
  Recording recording("hysteretic", 1000.0);
  recording.add(std::move(deflection));
  recording.add(std::move(torque));
  return recording;
}

TEST(CheckDelay, DoesNotTakeHysteresisForADelay) {
  for (const double elastic_rad : {0.004, 0.02, 0.05}) {
    const auto findings = findings_of(alone(hysteretic(0.5, 3.0, elastic_rad, 0)));
    EXPECT_EQ(verdict_of(findings, "delay"), Verdict::pass) << elastic_rad << '\n'
                                                            << text_of(findings);
  }
}

TEST(CheckDelay, IsFoundInSpiteOfHysteresis) {
  for (const std::ptrdiff_t late : {20, 100, 500}) {
    const auto findings = findings_of(alone(hysteretic(0.2, 3.0, 0.02, late)));
    ASSERT_EQ(verdict_of(findings, "delay"), Verdict::warn) << late;
    const std::string& message = first_of(findings, "delay").message;
    const std::size_t at = message.find("comes ");
    ASSERT_NE(at, std::string::npos) << message;
    EXPECT_NEAR(std::stod(message.substr(at + 6)), static_cast<double>(late), 3.0) << message;
    EXPECT_NE(message.find("after"), std::string::npos) << message;
  }
}

TEST(CheckDelay, IsNotReportedForALeadThatDampingExplains) {
  const Recording elastic = hysteretic(0.5, 3.0, 0.02, 0);
  const std::vector<double> x = elastic.channel("spring_deflection_rad").values;
  const auto findings = findings_of(alone(with_channel(elastic, "torque_Nm", [&](Channel& channel) {
    for (std::size_t i = 1; i < x.size(); ++i)
      channel.values[i] += 3.0 * (x[i] - x[i - 1]) / 1e-3;  // as much as a lead of 30 ms
  })));
  EXPECT_EQ(verdict_of(findings, "delay"), Verdict::pass) << text_of(findings);
}

TEST(CheckDelay, OfTheDeflectionMakesTheTorqueComeBeforeIt) {
  const auto findings = findings_of(alone(
      with_channel(hysteretic(2.0, 3.0, 0.02, 0), "spring_deflection_rad", [](Channel& channel) {
        std::rotate(channel.values.begin(), channel.values.end() - 100, channel.values.end());
        std::fill_n(channel.values.begin(), 100, channel.values[100]);
      })));
  ASSERT_EQ(verdict_of(findings, "delay"), Verdict::warn);
  EXPECT_NE(first_of(findings, "delay").message.find("before spring_deflection_rad"),
            std::string::npos)
      << first_of(findings, "delay").message;
}

TEST(CheckDelay, CannotBeDeterminedFromASlowMotionWithNoise) {
  const Recording clear = hysteretic(0.05, 3.0, 0.02, 0, 40000);
  const auto slow = with_channel(clear, "torque_Nm", [](Channel& channel) {
    Random random(6);
    for (double& value : channel.values) value += 0.3 * random.normal();
  });
  const auto message = [](const Recording& recording) {
    return first_of(findings_of(alone(recording)), "delay").message;
  };
  EXPECT_NE(message(slow).find("cannot be determined from so slow a motion"), std::string::npos)
      << message(slow);
  EXPECT_EQ(message(clear).find("cannot be determined"), std::string::npos) << message(clear);
}

Recording sweep() { return simulate({.actuator = "dfki-28", .experiment = "sweep", .seed = 3}); }

TEST(CheckDelay, OfOneOfTwoAnglesIsReportedWithItsName) {
  for (const std::string name : {"gear_angle_rad", "joint_angle_rad"}) {
    const auto findings = findings_of(alone(with_channel(sweep(), name, [](Channel& channel) {
      std::rotate(channel.values.begin(), channel.values.end() - 20, channel.values.end());
      std::fill_n(channel.values.begin(), 20, channel.values[20]);
    })));
    ASSERT_EQ(verdict_of(findings, "delay"), Verdict::warn) << name;
    const std::string& message = first_of(findings, "delay").message;
    EXPECT_EQ(message.find(name), 0U) << message;
    EXPECT_NEAR(std::stod(message.substr(message.find("comes ") + 6)), 20.0, 3.0) << message;
  }
}

TEST(CheckUnits, FailOnAWrongGearRatio) {
  EXPECT_EQ(verdict_of(findings_of(alone(sweep())), "units"), Verdict::pass);
  const auto findings =
      findings_of(alone(with_channel(sweep(), "gear_angle_rad", [](Channel& channel) {
        for (double& value : channel.values) value *= 1.1;
      })));
  ASSERT_EQ(verdict_of(findings, "units"), Verdict::fail);
  EXPECT_NE(first_of(findings, "units").message.find("gear_angle_rad moves 1.1"), std::string::npos)
      << first_of(findings, "units").message;
}

TEST(CheckUnits, NameTheRatioOfAGearWhereOneAngleMovesFurther) {
  const auto with_factor = [](const std::string& channel, double factor) {
    return findings_of(alone(with_channel(bench_recording("gear"), channel, [&](Channel& angle) {
      for (double& value : angle.values) value *= factor;
    })));
  };
  for (const double ratio : {30.0, 100.0, 161.0}) {
    const auto missing = with_factor("gear_angle_rad", ratio);
    ASSERT_EQ(verdict_of(missing, "units"), Verdict::fail) << text_of(missing);
    const std::string& advice = first_of(missing, "units").advice;
    const std::size_t at = advice.find("gear_ratio: ");
    ASSERT_NE(at, std::string::npos) << advice;
    EXPECT_NEAR(std::stod(advice.substr(at + 12)), ratio, 0.02 * ratio) << advice;
    EXPECT_EQ(advice.find("Ncm"), std::string::npos) << advice;
    const auto twice = with_factor("gear_angle_rad", 1.0 / ratio);
    ASSERT_EQ(verdict_of(twice, "units"), Verdict::fail) << text_of(twice);
    EXPECT_NE(first_of(twice, "units").advice.find("once too often"), std::string::npos)
        << first_of(twice, "units").advice;
  }
}

TEST(CheckUnits, WarnOfADeflectionOfMoreThanOneAndAHalfRadians) {
  Recording degrees = sweep();
  for (const std::string name : {"gear_angle_rad", "joint_angle_rad"})
    degrees = with_channel(degrees, name, [](Channel& channel) {
      for (double& value : channel.values) value *= 180.0 / std::numbers::pi;
    });
  const auto findings = findings_of(alone(degrees));
  ASSERT_EQ(verdict_of(findings, "units"), Verdict::warn);
  EXPECT_NE(first_of(findings, "units").message.find("turns"), std::string::npos);
}

TEST(CheckUnits, WarnOfATorqueThatHardlyAnyJointCarries) {
  const auto findings = findings_of(alone(with_channel(sweep(), "torque_Nm", [](Channel& channel) {
    for (double& value : channel.values) value *= 1000.0;
  })));
  ASSERT_EQ(verdict_of(findings, "units"), Verdict::warn);
  EXPECT_NE(first_of(findings, "units").message.find("torque_Nm ranges through"),
            std::string::npos);
}

TEST(CheckColumns, WarnWhereTheCurrentFollowsTheDeflectionMoreCloselyThanTheTorque) {
  EXPECT_EQ(verdict_of(findings_of(alone(sweep())), "columns"), Verdict::pass);
  const Recording sound = sweep();
  Recording swapped("swapped", sound.sample_rate_Hz());
  for (Channel copy : sound.channels()) {
    if (copy.name == "torque_Nm") copy.values = sound.channel("motor_current_A").values;
    if (copy.name == "motor_current_A") copy.values = sound.channel("torque_Nm").values;
    copy.fresh.clear();
    swapped.add(std::move(copy));
  }
  const auto findings = findings_of(alone(swapped));
  ASSERT_EQ(verdict_of(findings, "columns"), Verdict::warn);
  EXPECT_NE(first_of(findings, "columns").message.find("motor_current_A follows"),
            std::string::npos);
}

TEST(CheckSign, IgnoresAPartThatHardlyMoves) {
  // At the end the joint is held: within a thousandth of the range friction reverses the relation.
  Recording recording =
      with_channel(bench_recording("held", {.noise_Nm = 0.0}), "torque_Nm", [](Channel& channel) {
        for (std::size_t i = 3000; i < 4000; ++i) {
          const double phase = 0.02 * static_cast<double>(i - 3000);
          channel.values[i] = channel.values[3000] - 0.02 * std::sin(phase);
        }
      });
  const std::vector<double> joint = recording.channel("joint_angle_rad").values;
  recording = with_channel(recording, "gear_angle_rad", [&](Channel& channel) {
    const double deflection_rad = channel.values[3000] - joint[3000];
    for (std::size_t i = 3000; i < 4000; ++i)
      channel.values[i] =
          joint[i] + deflection_rad + 3e-5 * std::sin(0.02 * static_cast<double>(i - 3000));
  });
  // Before, the torque follows closely as well, so that only the range distinguishes the parts.
  EXPECT_EQ(verdict_of(findings_of(alone(recording)), "sign"), Verdict::pass)
      << text_of(findings_of(alone(recording)));
}

TEST(CheckChange, IsFoundForAGainThatChangesByAThird) {
  const Recording sound = simulate({.actuator = "dfki-50", .experiment = "sweep", .seed = 3});
  EXPECT_EQ(verdict_of(findings_of(alone(sound)), "change"), Verdict::pass);
  const auto findings = findings_of(alone(with_channel(sound, "torque_Nm", [](Channel& channel) {
    for (std::size_t i = channel.values.size() / 2; i < channel.values.size(); ++i)
      channel.values[i] *= 1.3;
  })));
  EXPECT_EQ(verdict_of(findings, "change"), Verdict::warn) << text_of(findings);
}

TEST(CheckChange, IsFoundWithTwoReversalsAndNotTakenForADelayOrForAnotherFault) {
  const auto findings = findings_of(alone(with_channel(sweep(), "torque_Nm", [](Channel& channel) {
    const auto samples = static_cast<double>(channel.values.size());
    for (std::size_t i = 0; i < channel.values.size(); ++i)
      channel.values[i] += 4.0 * static_cast<double>(i) / samples;
  })));
  EXPECT_EQ(verdict_of(findings, "change"), Verdict::warn) << text_of(findings);
  for (const char* check : {"delay", "columns", "units"})
    EXPECT_EQ(verdict_of(findings, check), Verdict::pass) << text_of(findings);
}

TEST(CheckChange, IsNotReportedForRelaxationAtRest) {
  for (const char* variant : {"elastomer", "elastomer:unbonded"}) {
    const auto findings =
        findings_of(alone(simulate({.actuator = variant, .experiment = "hold", .seed = 101})));
    EXPECT_EQ(verdict_of(findings, "change"), Verdict::pass) << variant << text_of(findings);
  }
}

/// A softening spring: 20 tanh(x / 0.03), over inputs around `middle_rad`.
Recording softening(const std::string& name, double middle_rad, double offset_Nm = 0.0,
                    double gain = 1.0) {
  Random random(2);
  Channel deflection{"spring_deflection_rad", {}};
  Channel torque{"torque_Nm", {}};
  for (std::size_t n = 0; n < 8000; ++n) {
    const double x = middle_rad + 0.03 * std::sin(3e-3 * static_cast<double>(n));
    deflection.values.push_back(x);
    torque.values.push_back(gain * 20.0 * std::tanh(x / 0.03) + offset_Nm + 0.02 * random.normal());
  }
  Recording recording(name, 1000.0);
  recording.add(std::move(deflection));
  recording.add(std::move(torque));
  return recording;
}

std::vector<Finding> compared(Recording third) {
  Dataset dataset;
  add_record(dataset, softening("first", 0.0), Role::train);
  add_record(dataset, softening("second", 0.01), Role::train);
  add_record(dataset, std::move(third), Role::train);
  return findings_of(dataset);
}

TEST(CheckOffsets, CompareASofteningSpringAtCommonInputs) {
  const auto findings = compared(softening("third", 0.03));
  EXPECT_EQ(verdict_of(findings, "offsets"), Verdict::pass) << text_of(findings);
}

TEST(CheckOffsets, NameTheRecordWithAnotherGain) {
  const auto findings = compared(softening("third", 0.01, 0.0, 1.3));
  ASSERT_EQ(verdict_of(findings, "offsets"), Verdict::warn);
  EXPECT_EQ(first_of(findings, "offsets").recording, "third");
  EXPECT_NE(text_of(findings).find("times as steeply"), std::string::npos) << text_of(findings);
}

TEST(CheckOffsets, WarnWhereTheTorqueIsZeroAtADeflection) {
  EXPECT_EQ(verdict_of(findings_of(alone(bench_recording("sound"))), "offsets"), Verdict::pass);
  const auto findings = findings_of(alone(test::changed("gear_angle_rad", [](Channel& gear) {
    for (double& angle : gear.values) angle += 0.05;
  })));
  ASSERT_EQ(verdict_of(findings, "offsets"), Verdict::warn) << text_of(findings);
  EXPECT_NE(text_of(findings).find("torque_Nm is zero at spring_deflection_rad = 0.0"),
            std::string::npos)
      << text_of(findings);
  const std::string advice = first_of(findings, "offsets").advice;
  EXPECT_NE(advice.find("begins in motion"), std::string::npos) << advice;
  EXPECT_EQ(advice.find("zero: ["), std::string::npos) << "no zero can be taken there: " << advice;
}

/// A log that begins at rest without load, of encoders with that zero.
std::string log_from_rest(double zero_rad) {
  std::string text = "t_s,gear_angle_rad,joint_angle_rad,torque_Nm\n";
  Random random(6);
  for (int row = 0; row < 6000; ++row) {
    const double t = std::max(1e-3 * row - 0.3, 0.0);
    const double twist = 0.03 * std::sin(4.0 * t) + 0.01 * std::sin(11.0 * t);
    const double joint = 0.3 * std::sin(0.9 * t);
    text += fmt::format("{:.3f},{:.7f},{:.7f},{:.4f}\n", 1e-3 * row, joint + twist + zero_rad,
                        joint, 500.0 * twist + 0.05 * random.normal());
  }
  return text;
}

Dataset read_with(const std::string& mapping, const std::vector<double>& zeros_rad) {
  Dataset dataset;
  for (const double zero_rad : zeros_rad) {
    const std::string name = fmt::format("boot{}.csv", dataset.records.size() + 1);
    add_record(dataset,
               std::move(measured_recordings(parse_csv(log_from_rest(zero_rad), name),
                                             parse_mapping(mapping, "m.yaml"))
                             .front()),
               Role::train);
  }
  return dataset;
}

std::string zero_line_of(const std::string& text) {
  const std::size_t begin = text.find("zero: [");
  return begin == std::string::npos ? "" : text.substr(begin, text.find(']', begin) - begin + 1);
}

TEST(CheckOffsets, AreGoneWithTheLineThatTheWarningNames) {
  const std::string none = "drop: []";
  const auto one = findings_of(read_with(none, {0.2}));
  ASSERT_EQ(verdict_of(one, "offsets"), Verdict::warn) << text_of(one);
  EXPECT_NE(first_of(one, "offsets").advice.find("incremental encoder"), std::string::npos);
  const std::string line = zero_line_of(first_of(one, "offsets").advice);
  EXPECT_EQ(verdict_of(findings_of(read_with(line, {0.2})), "offsets"), Verdict::pass) << line;

  const auto two = findings_of(read_with(none, {0.0, 0.004}));
  ASSERT_EQ(verdict_of(two, "offsets"), Verdict::warn) << text_of(two);
  EXPECT_TRUE(std::regex_search(
      text_of(two),
      std::regex("as if about 0\\.00[34][0-9]* rad had been added to spring_deflection_rad")))
      << text_of(two);
  const std::string of_two = zero_line_of(first_of(two, "offsets").advice);
  EXPECT_EQ(verdict_of(findings_of(read_with(of_two, {0.0, 0.004})), "offsets"), Verdict::pass)
      << of_two;
}

TEST(CheckPosition, IsNotExaminedWhereTheJointHardlyMoves) {
  const Recording sound = bench_recording("sound");
  EXPECT_EQ(first_of(findings_of(alone(sound)), "position").message,
            "the torque does not depend on the angle of the joint");
  // The joint moves with its load, and the ratio is wrong by a third: no other check finds it.
  std::string text = "t_s,gear_angle_rad,joint_angle_rad,torque_Nm\n";
  for (int row = 0; row < 8000; ++row) {
    const double t = 1e-3 * row;
    const double torque = 25.0 * std::sin(1.9 * t) + 6.0 * std::sin(4.1 * t);
    text += fmt::format("{:.3f},{:.7f},{:.7f},{:.4f}\n", t,
                        80.0 / 60.0 * (torque / 300.0 + torque / 350.0), torque / 300.0, torque);
  }
  Dataset dataset;
  add_record(dataset,
             std::move(measured_recordings(parse_csv(text, "elastic.csv"),
                                           parse_mapping("drop: []", "m.yaml"))
                           .front()),
             Role::train);
  const Finding position = first_of(findings_of(dataset), "position");
  EXPECT_EQ(position.verdict, Verdict::pass);
  EXPECT_TRUE(position.message.starts_with(
      "nothing was found, but a wrong gear ratio would not be found: "))
      << position.message;
  EXPECT_NE(position.advice.find("without load"), std::string::npos) << position.advice;
}

TEST(CheckOffsets, FailWhereAZeroIsFurtherAwayThanTheTorqueReaches) {
  EXPECT_EQ(verdict_of(compared(softening("third", 0.0, 8.0)), "offsets"), Verdict::warn);
  EXPECT_EQ(verdict_of(compared(softening("third", 0.0, 60.0)), "offsets"), Verdict::fail);
}

}  // namespace
}  // namespace torsio

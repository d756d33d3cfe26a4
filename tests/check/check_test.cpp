#include "torsio/check/check.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>

#include "check/check_support.hpp"
#include "support/bench_dataset.hpp"
#include "support/error_message.hpp"
#include "torsio/fit/common/inputs.hpp"
#include "torsio/fit/common/training_data.hpp"

namespace torsio {
namespace {

using test::add_record;
using test::bench_recording;
using test::BenchOptions;
using test::changed;
using test::findings_of;
using test::first_of;
using test::verdict_of;
using test::with_record;

TEST(Check, PassesAGoodBench) {
  for (const Finding& finding : findings_of(test::bench_dataset()))
    EXPECT_EQ(finding.verdict, Verdict::pass) << finding.check << ": " << finding.message;
}

TEST(Check, SaysThatAShortRecordIsTooShort) {
  const auto findings = findings_of(with_record(bench_recording("short", {.samples = 50})));
  EXPECT_EQ(verdict_of(findings, "length"), Verdict::fail);
}

TEST(Check, FailsOnAMissingInputAndWarnsOfAMissingTarget) {
  const auto spoil = [](Channel& channel) {
    std::fill_n(channel.values.begin() + 100, 20, std::numeric_limits<double>::quiet_NaN());
  };
  EXPECT_EQ(verdict_of(findings_of(with_record(changed("torque_Nm", spoil))), "missing values"),
            Verdict::warn);
  EXPECT_EQ(
      verdict_of(findings_of(with_record(changed("gear_angle_rad", spoil))), "missing values"),
      Verdict::fail);
}

TEST(TrainingData, NamesTheTimeAndHoldWhereAnInputIsMissing) {
  Dataset dataset;
  add_record(dataset,
             changed("gear_angle_rad",
                     [](Channel& channel) {
                       channel.values[100] = std::numeric_limits<double>::quiet_NaN();
                     }),
             Role::train);
  const FeatureSpec spec = resolve_inputs(dataset, {});
  const std::string message =
      test::error_message([&] { static_cast<void>(training_data(dataset, spec, Role::train)); });
  EXPECT_NE(message.find("at t = 0.1 s (sample 100)"), std::string::npos) << message;
  EXPECT_NE(message.find("hold: [gear_angle_rad]"), std::string::npos) << message;
}

TEST(Check, FailsOnADeadChannel) {
  const auto dead = [](Channel& channel) { std::ranges::fill(channel.values, 1.5); };
  const auto findings = findings_of(with_record(changed("torque_Nm", dead)));
  EXPECT_EQ(verdict_of(findings, "constant channels"), Verdict::fail);
  EXPECT_NE(
      first_of(findings, "constant channels").message.find("torque_Nm never changes from 1.5"),
      std::string::npos);
}

TEST(Check, WarnsOfASensorAtItsLimit) {
  const auto clip = [](Channel& channel) {
    for (double& value : channel.values) value = std::clamp(value, -8.0, 8.0);
  };
  EXPECT_EQ(verdict_of(findings_of(with_record(changed("torque_Nm", clip))), "saturation"),
            Verdict::warn);
}

TEST(Check, DoesNotCallTheLastOfFewCodesALimit) {
  Channel deflection{"spring_deflection_rad", {}};
  Channel torque{"torque_Nm", {}};
  constexpr double kCode_rad = 0.002;
  for (int n = 0; n < 4000; ++n) {
    const double phase = std::fmod(1e-3 * static_cast<double>(n), 1.0);
    const double triangle_rad = 0.0505 * (4.0 * std::abs(phase - 0.5) - 1.0);
    deflection.values.push_back(kCode_rad * std::round(triangle_rad / kCode_rad));
    torque.values.push_back(100.0 * triangle_rad);
  }
  Recording recording("triangles", 1000.0);
  recording.add(std::move(deflection));
  recording.add(std::move(torque));
  Dataset dataset;
  add_record(dataset, std::move(recording), Role::train);
  EXPECT_EQ(verdict_of(findings_of(dataset), "saturation"), Verdict::pass);
}

TEST(Check, WarnsOfASensorThatFreezesWhileTheOthersMove) {
  const auto findings = findings_of(with_record(changed("gear_angle_rad", [](Channel& channel) {
    for (std::size_t i = 1000; i < 2200; ++i) channel.values[i] = channel.values[1000];
  })));
  EXPECT_EQ(verdict_of(findings, "frozen sensors"), Verdict::warn);
  const std::string message = first_of(findings, "frozen sensors").message;
  EXPECT_NE(message.find("gear_angle_rad"), std::string::npos) << message;
  EXPECT_NE(message.find("for 1.2 s from t = 1 s"), std::string::npos) << message;
}

TEST(Check, WarnsOfAStallDuringSlowMotion) {
  // A slow ramp and back; a second of it is next to nothing of the range.
  Channel gear{"gear_angle_rad", {}};
  Channel joint{"joint_angle_rad", {}};
  Channel torque{"torque_Nm", {}};
  for (int n = 0; n < 6000; ++n) {
    const double phase = 1e-3 * static_cast<double>(n);
    joint.values.push_back(2.0 * std::sin(phase));
    gear.values.push_back(2.02 * std::sin(phase));
    torque.values.push_back(10.0 * std::sin(phase));
  }
  const auto verdict = [&](double stalls_at, double twice_at) {
    Recording spoiled("slow", 100.0);
    Channel stalled = gear;
    for (const double at_s : {stalls_at, twice_at})
      for (std::size_t i = 0; i < 100 && at_s > 0.0; ++i)
        stalled.values[static_cast<std::size_t>(100.0 * at_s) + i] =
            stalled.values[static_cast<std::size_t>(100.0 * at_s)];
    for (const Channel& each : {stalled, joint, torque}) spoiled.add(each);
    Dataset dataset;
    add_record(dataset, std::move(spoiled), Role::train);
    return verdict_of(findings_of(dataset), "frozen sensors");
  };
  EXPECT_EQ(verdict(-1.0, -1.0), Verdict::pass);
  EXPECT_EQ(verdict(30.0, -1.0), Verdict::warn);
  EXPECT_EQ(verdict(30.0, 32.0), Verdict::pass) << "a joint that sticks does so again";
}

TEST(Check, ReportsNoFrozenSensorAtRest) {
  Recording at_rest = bench_recording("at rest");
  Recording recording("at rest", 1000.0);
  for (Channel copy : at_rest.channels()) {
    for (std::size_t i = 3000; i < 3600; ++i) copy.values[i] = copy.values[3000];
    recording.add(std::move(copy));
  }
  EXPECT_EQ(verdict_of(findings_of(with_record(std::move(recording))), "frozen sensors"),
            Verdict::pass);
}

TEST(Check, WarnsOfCodesThatAreCoarseForTheDeflection) {
  const auto findings_with_code = [](double code_rad) {
    return findings_of(with_record(changed("gear_angle_rad", [=](Channel& channel) {
      for (double& value : channel.values) value = code_rad * std::round(value / code_rad);
    })));
  };
  const Recording sound = bench_recording("sound");
  const auto& gear = sound.channel("gear_angle_rad").values;
  const auto& joint = sound.channel("joint_angle_rad").values;
  double widest_rad = 0.0;  // range of the deflection
  for (std::size_t i = 0; i < gear.size(); ++i)
    widest_rad = std::max(widest_rad, std::abs(gear[i] - joint[i]));
  EXPECT_EQ(verdict_of(findings_with_code(0.005 * widest_rad), "resolution"), Verdict::pass);
  const auto coarse = findings_with_code(0.1 * widest_rad);
  EXPECT_EQ(verdict_of(coarse, "resolution"), Verdict::warn);
  EXPECT_NE(first_of(coarse, "resolution").message.find("gear_angle_rad has a resolution of"),
            std::string::npos);
}

TEST(Check, WarnsOfAJump) {
  const auto jump = [](Channel& channel) {
    for (std::size_t i = 2000; i < channel.values.size(); ++i) channel.values[i] += 20.0;
  };
  const auto findings = findings_of(with_record(changed("torque_Nm", jump)));
  EXPECT_EQ(verdict_of(findings, "gaps"), Verdict::warn);
  EXPECT_NE(first_of(findings, "gaps").message.find("t = 2 s"), std::string::npos);
}

/// The joint's encoder with the error `error_rad(time)` added.
Recording with_joint_error(const std::function<double(double)>& error_rad) {
  return changed("joint_angle_rad", [&](Channel& channel) {
    for (std::size_t i = 0; i < channel.values.size(); ++i)
      channel.values[i] += error_rad(1e-3 * static_cast<double>(i));
  });
}

TEST(Check, WarnsOfAnEncoderThatSlipsByHalfTheDeflectionAlthoughThatIsLittleForTheAngle) {
  const auto findings = findings_of(
      with_record(with_joint_error([](double t_s) { return t_s < 2.0 ? 0.0 : 0.009; })));
  ASSERT_EQ(verdict_of(findings, "gaps"), Verdict::warn);
  const std::string& message = first_of(findings, "gaps").message;
  EXPECT_NE(message.find("spring_deflection_rad jumps by 0.009"), std::string::npos) << message;
  EXPECT_NE(message.find("t = 2 s"), std::string::npos) << message;
  EXPECT_NE(message.find("it comes from joint_angle_rad"), std::string::npos) << message;
}

TEST(Check, WarnsOfAZeroThatDrifts) {
  const auto drifting = [](double rad_s) {
    Recording good = bench_recording("drifting", {.samples = 20000});
    Recording recording("drifting", 1000.0);
    for (Channel copy : good.channels()) {
      if (copy.name == "joint_angle_rad")
        for (std::size_t i = 0; i < copy.values.size(); ++i)
          copy.values[i] += 1e-3 * rad_s * static_cast<double>(i);
      recording.add(std::move(copy));
    }
    return findings_of(with_record(std::move(recording)));
  };
  EXPECT_EQ(verdict_of(drifting(0.0), "change"), Verdict::pass);
  const auto findings = drifting(0.0012);
  ASSERT_EQ(verdict_of(findings, "change"), Verdict::warn);
  EXPECT_NE(first_of(findings, "change").message.find("gradually"), std::string::npos)
      << first_of(findings, "change").message;
}

TEST(Check, WarnsOfASpringThatBreaksAndSaysWhen) {
  Recording good = bench_recording("broken", {.samples = 20000});
  Recording recording("broken", 1000.0);
  for (Channel copy : good.channels()) {
    if (copy.name == "torque_Nm")
      for (std::size_t i = 12000; i < copy.values.size(); ++i) copy.values[i] *= 0.4;
    recording.add(std::move(copy));
  }
  const auto findings = findings_of(with_record(std::move(recording)));
  ASSERT_EQ(verdict_of(findings, "change"), Verdict::warn);
  const std::string& message = first_of(findings, "change").message;
  EXPECT_NE(message.find("the slope of torque_Nm changes to 0.4"), std::string::npos) << message;
  const std::size_t at = message.find("t = ");
  ASSERT_NE(at, std::string::npos) << message;
  EXPECT_NEAR(std::stod(message.substr(at + 4)), 12.0, 0.7) << message;
}

TEST(Check, NamesTheRecordThatDiffersByAUnitAndItsChannel) {
  Recording odd = changed("torque_Nm", [](Channel& channel) {
    for (double& value : channel.values) value *= 1000.0;
  });
  const auto findings = findings_of(with_record(std::move(odd)));
  ASSERT_EQ(verdict_of(findings, "units"), Verdict::fail);
  const Finding& finding = first_of(findings, "units");
  EXPECT_EQ(finding.recording, "changed");
  EXPECT_NE(finding.message.find("1000 times larger"), std::string::npos) << finding.message;
  EXPECT_NE(finding.advice.find("torque_Nm in this recording"), std::string::npos)
      << finding.advice;
  EXPECT_EQ(verdict_of(findings, "offsets"), Verdict::pass) << "a zero does not correct a unit";
}

TEST(Check, DoubtsTheUnitOfARecordingThatAModelWasNotTrainedOn) {
  EstimatorSettings trained;
  trained.features = resolve_inputs(test::bench_dataset(), {});
  trained.target = "torque_Nm";
  trained.fallback.slope = {500.0, 0.0, 0.0};
  EXPECT_EQ(unit_doubt(bench_recording("as trained"), trained), "");
  trained.fallback.slope[0] = 0.5;
  EXPECT_EQ(unit_doubt(bench_recording("odd"), trained), "a unit and its thousandth");
}

TEST(Check, BlamesNeitherOfTwoRecordsForAUnit) {
  Dataset dataset;
  add_record(dataset, bench_recording("one"), Role::train);
  add_record(dataset,
             bench_recording("other", {.stiffness_Nm_rad = 500.0 / 57.29578, .friction_Nm = 0.02}),
             Role::train);
  const auto findings = findings_of(dataset);
  ASSERT_EQ(verdict_of(findings, "units"), Verdict::fail);
  EXPECT_EQ(first_of(findings, "units").recording, "other or one");
  EXPECT_NE(first_of(findings, "units").advice.find("degrees and radians"), std::string::npos);
}

TEST(Check, FailsOnOneOfTwoAnglesInDegrees) {
  Dataset dataset;
  add_record(dataset,
             changed("gear_angle_rad",
                     [](Channel& channel) {
                       for (double& value : channel.values) value *= 57.29578;
                     }),
             Role::train);
  const auto findings = findings_of(dataset);
  ASSERT_EQ(verdict_of(findings, "units"), Verdict::fail);
  EXPECT_NE(first_of(findings, "units").message.find("gear_angle_rad moves"), std::string::npos);
}

TEST(Check, NamesTheAngleThatIsTurnedRound) {
  const auto turned = [](const std::string& name) {
    Dataset dataset;
    add_record(dataset,
               changed(name,
                       [](Channel& channel) {
                         for (double& value : channel.values) value = -value;
                       }),
               Role::train);
    add_record(dataset, dataset.records.front().recording, Role::train);
    return findings_of(dataset);
  };
  for (const std::string name : {"joint_angle_rad", "gear_angle_rad"}) {
    const auto findings = turned(name);
    ASSERT_EQ(verdict_of(findings, "sign"), Verdict::fail) << name;
    EXPECT_EQ(verdict_of(findings, "offsets"), Verdict::pass) << "the turned angle explains it";
    EXPECT_NE(first_of(findings, "sign").message.find("with the sign of " + name),
              std::string::npos)
        << first_of(findings, "sign").message;
  }
}

TEST(Check, FailsOnASignThatFlipsWithinARecordAndSaysWhen) {
  const auto findings = findings_of(with_record(changed("torque_Nm", [](Channel& channel) {
    for (std::size_t i = 2200; i < channel.values.size(); ++i) channel.values[i] *= -1.0;
  })));
  ASSERT_EQ(verdict_of(findings, "sign"), Verdict::fail);
  EXPECT_NE(first_of(findings, "sign").message.find("until t = 2.2"), std::string::npos)
      << first_of(findings, "sign").message;
  EXPECT_EQ(verdict_of(findings, "gaps"), Verdict::pass) << "the flip is not a lost sample";
}

TEST(Check, WarnsOfATorqueThatFreezesWhileTheDeflectionMoves) {
  const auto findings = findings_of(with_record(changed("torque_Nm", [](Channel& channel) {
    for (std::size_t i = 1000; i < 1350; ++i) channel.values[i] = channel.values[1000];
  })));
  EXPECT_EQ(verdict_of(findings, "frozen sensors"), Verdict::warn);
}

TEST(Check, FailsOnAnEncoderThatNeverMovesWhileTheOtherDoes) {
  for (const char* const dead : {"joint_angle_rad", "gear_angle_rad"}) {
    const auto findings = findings_of(with_record(
        changed(dead, [](Channel& channel) { std::ranges::fill(channel.values, 0.25); })));
    ASSERT_EQ(verdict_of(findings, "frozen sensors"), Verdict::fail) << text_of(findings);
    EXPECT_NE(first_of(findings, "frozen sensors").message.find(std::string(dead) + " is 0.25"),
              std::string::npos);
  }
}

TEST(Check, ReportsOnceThatALockedOutputDoesNotMove) {
  Recording good = bench_recording("locked");
  Recording recording("locked", 1000.0);
  const std::vector<double> joint = good.channel("joint_angle_rad").values;
  for (Channel copy : good.channels()) {
    for (std::size_t i = 0; i < joint.size(); ++i) {
      if (copy.name == "gear_angle_rad") copy.values[i] -= joint[i];
      if (copy.name == "joint_angle_rad") copy.values[i] = i < 1500 ? -1.2e-5 : 1.2e-5;
    }
    recording.add(std::move(copy));
  }
  Dataset dataset;
  add_record(dataset, std::move(recording), Role::train);
  const auto findings = findings_of(dataset);
  for (const Finding& finding : findings)
    EXPECT_EQ(finding.verdict, Verdict::pass) << finding.check << ": " << finding.message;
  EXPECT_NE(first_of(findings, "constant channels").message.find("joint_angle_rad does not move"),
            std::string::npos);
}

TEST(Check, StillFailsOnADeadEncoderOfAMovingJoint) {
  const auto findings = findings_of(with_record(changed(
      "joint_angle_rad", [](Channel& channel) { std::ranges::fill(channel.values, 0.1); })));
  EXPECT_EQ(verdict_of(findings, "constant channels"), Verdict::fail);
}

TEST(Check, MeasuresADelayAndSaysTheMappingLine) {
  const auto findings = findings_of(with_record(bench_recording("late", {.torque_delay = 30})));
  ASSERT_EQ(verdict_of(findings, "delay"), Verdict::warn);
  // Friction leads the deflection a little, so the delay is estimated to a few milliseconds.
  const std::string& advice = first_of(findings, "delay").advice;
  const std::size_t at = advice.find("torque_Nm: ");
  ASSERT_NE(at, std::string::npos) << advice;
  EXPECT_NEAR(std::stod(advice.substr(at + 11)), 30.0, 6.0) << advice;
}

TEST(Check, FailsOnAWrongSign) {
  const auto flip = [](Channel& channel) {
    for (double& value : channel.values) value = -value;
  };
  EXPECT_EQ(verdict_of(findings_of(with_record(changed("torque_Nm", flip))), "sign"),
            Verdict::fail);
}

TEST(Check, WarnsWhenARecordHasAnotherZero) {
  const auto findings = findings_of(with_record(bench_recording("shifted", {.offset_Nm = 6.0})));
  EXPECT_EQ(verdict_of(findings, "offsets"), Verdict::warn);
  EXPECT_EQ(first_of(findings, "offsets").recording, "shifted");
}

TEST(Check, IsNotMisledByATargetThatIsMissingInPart) {
  const auto spoil = [](Channel& channel) {
    std::fill(channel.values.begin() + 1500, channel.values.end(),
              std::numeric_limits<double>::quiet_NaN());
  };
  const auto findings = findings_of(with_record(changed("torque_Nm", spoil)));
  EXPECT_EQ(verdict_of(findings, "offsets"), Verdict::pass);
  EXPECT_EQ(verdict_of(findings, "gaps"), Verdict::pass);
}

TEST(Check, WarnsOfOneSpeedWithoutReversal) {
  Recording recording("ramp", 1000.0);
  Channel gear{"gear_angle_rad", {}};
  Channel joint{"joint_angle_rad", {}};
  Channel torque{"torque_Nm", {}};
  for (std::size_t n = 0; n < 3000; ++n) {
    const double x = 1e-5 * static_cast<double>(n);
    gear.values.push_back(x);
    joint.values.push_back(1e-9 * static_cast<double>(n));
    torque.values.push_back(500.0 * x + 0.1 * std::sin(static_cast<double>(n)));
  }
  recording.add(std::move(gear));
  recording.add(std::move(joint));
  recording.add(std::move(torque));
  Dataset dataset;
  add_record(dataset, std::move(recording), Role::train);
  EXPECT_EQ(verdict_of(findings_of(dataset), "excitation"), Verdict::warn);
}

TEST(Check, FailsOnATargetThatWasComputedFromAnInput) {
  Recording recording = bench_recording("leaky");
  Channel current{"motor_current_A", recording.channel("torque_Nm").values};
  for (double& value : current.values) value = 0.2 * value - 1.0;
  recording.add(std::move(current));
  Dataset dataset;
  add_record(dataset, std::move(recording), Role::train);
  const auto findings =
      findings_of(dataset, resolve_inputs(dataset, {"gear_angle_rad", "motor_current_A"}));
  EXPECT_EQ(verdict_of(findings, "leak"), Verdict::fail);
}

TEST(Check, WarnsOfTestDataOutsideTheTrainingRange) {
  Dataset dataset = test::bench_dataset();
  add_record(dataset, bench_recording("far", {.amplitude_rad = 0.06}), Role::test);
  const auto findings = findings_of(dataset);
  EXPECT_EQ(verdict_of(findings, "range"), Verdict::warn);
}

}  // namespace
}  // namespace torsio

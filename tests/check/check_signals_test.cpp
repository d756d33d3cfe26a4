// Checks of single channels: codes, turning points, noise, spikes, repeated and missing rows.
#include <algorithm>
#include <cmath>
#include <numbers>

#include "check/check_support.hpp"
#include "data/resample.hpp"
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

/// Deflection and torque at 1 kHz as functions of time.
Recording recording_of(const std::string& name, std::size_t samples,
                       const std::function<double(double)>& deflection_rad,
                       const std::function<double(double)>& torque_Nm) {
  Random random(5);
  Channel deflection{"spring_deflection_rad", {}};
  Channel torque{"torque_Nm", {}};
  for (std::size_t n = 0; n < samples; ++n) {
    const double t_s = 1e-3 * static_cast<double>(n);
    deflection.values.push_back(deflection_rad(t_s));
    torque.values.push_back(torque_Nm(t_s) + 0.01 * random.normal());
  }
  Recording recording(name, 1000.0);
  recording.add(std::move(deflection));
  recording.add(std::move(torque));
  return recording;
}

double rounded(double value, double code) { return code * std::round(value / code); }

/// A triangle of amplitude 1, 4 s long.
double triangle(double t_s) { return 1.0 - std::abs(std::fmod(t_s + 1.0, 4.0) - 2.0); }

TEST(CheckSignals, MeasureTheCodesOfAnEncoderBeforeItWasResampled) {
  const Recording raw = recording_of(
      "coarse", 8000, [](double t_s) { return rounded(0.011 * triangle(t_s), 1e-3); },
      [](double t_s) { return 5.0 * triangle(t_s); });
  const Recording even = resample(raw, 737.0);
  EXPECT_NEAR(even.channel("spring_deflection_rad").step_before_resampling, 1e-3, 1e-9);
  const auto findings = findings_of(alone(even));
  ASSERT_EQ(verdict_of(findings, "resolution"), Verdict::warn);
  EXPECT_NE(first_of(findings, "resolution").message.find("only 22 such steps"), std::string::npos)
      << first_of(findings, "resolution").message;
  EXPECT_EQ(verdict_of(findings, "saturation"), Verdict::pass) << text_of(findings);
  EXPECT_EQ(verdict_of(findings, "frozen sensors"), Verdict::pass) << text_of(findings);
}

TEST(CheckSignals, MeasureTheCodesBeforeUnevenStampsWereInterpolated) {
  Channel coarse{"angle_rad", {}};
  std::vector<double> stamps_s;
  for (int n = 0; n < 100; ++n) {
    stamps_s.push_back(1e-2 * n + 1e-3 * (n % 3));
    coarse.values.push_back(rounded(1e-3 * n, 0.02));
  }
  const Channel even = on_even_clock(coarse, stamps_s, 130.0, 120);
  EXPECT_NEAR(even.step_before_resampling, 0.02, 1e-12);
}

/// The deflection rests at its largest value while the torque falls by 5 % of its range.
Recording with_dwell(double torque_beyond_Nm) {
  const auto deflection = [](double t_s) {
    return 0.05 * (t_s < 5.0 ? triangle(t_s) : t_s < 6.0 ? 1.0 : triangle(t_s - 1.0));
  };
  return recording_of("dwell", 16000, deflection, [=](double t_s) {
    const double extra = t_s < 5.0 ? 0.0 : t_s < 6.0 ? t_s - 5.0 : 1.0;
    return 100.0 * deflection(t_s) - torque_beyond_Nm * (extra < 1.0 ? extra : 1.0);
  });
}

TEST(CheckSignals, ReportNeitherAStallNorALimitWhereFrictionHoldsTheJointAtATurningPoint) {
  const auto findings = findings_of(alone(with_dwell(0.5)));
  EXPECT_EQ(verdict_of(findings, "saturation"), Verdict::pass) << text_of(findings);
  EXPECT_EQ(verdict_of(findings, "frozen sensors"), Verdict::pass) << text_of(findings);
}

TEST(CheckSignals, StillReportALimitThatHidesTheRestOfTheMotion) {
  Recording recording = with_dwell(0.0);
  const auto findings =
      findings_of(alone(with_channel(recording, "spring_deflection_rad", [](Channel& channel) {
        for (double& value : channel.values) value = std::min(value, 0.04);
      })));
  EXPECT_EQ(verdict_of(findings, "saturation"), Verdict::warn);
}

/// Ten seconds of the made-up bench with encoders that have noise.
Recording noisy_bench() {
  Recording sound = bench_recording("noisy", {.samples = 10000});
  for (const std::string name : {"gear_angle_rad", "joint_angle_rad"})
    sound = with_channel(sound, name, [&](Channel& channel) {
      Random random(name == "gear_angle_rad" ? 7 : 8);
      for (double& value : channel.values) value += 1e-5 * random.normal();
    });
  return sound;
}

TEST(CheckSignals, FindNothingInANoisyBench) {
  const auto findings = findings_of(alone(noisy_bench()));
  for (const Finding& finding : findings)
    EXPECT_EQ(finding.verdict, Verdict::pass) << finding.check << ": " << finding.message;
}

TEST(CheckSignals, WarnOfABurstOfNoiseAndStateWhen) {
  for (const std::string name : {"gear_angle_rad", "torque_Nm"}) {
    const auto findings = findings_of(alone(with_channel(noisy_bench(), name, [](Channel& channel) {
      Random random(9);
      const double sigma = channel.name == "torque_Nm" ? 2.0 : 0.004;
      for (std::size_t i = 6000; i < 6500; ++i) channel.values[i] += sigma * random.normal();
    })));
    ASSERT_EQ(verdict_of(findings, "noise"), Verdict::warn) << name;
    const std::string& message = first_of(findings, "noise").message;
    EXPECT_NE(message.find(name), std::string::npos) << message;
    const std::size_t from = message.find("from t = ");
    const std::size_t to = message.find(" s to ");
    ASSERT_TRUE(from != std::string::npos && to != std::string::npos) << message;
    EXPECT_NEAR(std::stod(message.substr(from + 9)), 6.0, 0.005) << message;
    EXPECT_NEAR(std::stod(message.substr(to + 6)), 6.5, 0.005) << message;
  }
}

TEST(CheckSignals, WarnOfNoiseThroughout) {
  const auto findings =
      findings_of(alone(with_channel(noisy_bench(), "torque_Nm", [](Channel& channel) {
        Random random(9);
        for (double& value : channel.values) value += 2.0 * random.normal();
      })));
  EXPECT_EQ(verdict_of(findings, "noise"), Verdict::warn);
}

TEST(CheckSignals, WarnOfSingleSamplesFarFromTheirNeighbours) {
  const auto findings =
      findings_of(alone(with_channel(noisy_bench(), "torque_Nm", [](Channel& channel) {
        for (const std::size_t i : {2000U, 4500U, 7000U}) channel.values[i] += 8.0;
      })));
  ASSERT_EQ(verdict_of(findings, "spikes"), Verdict::warn);
  const std::string& message = first_of(findings, "spikes").message;
  EXPECT_NE(message.find("torque_Nm: 3 single samples"), std::string::npos) << message;
  EXPECT_NE(message.find("t = 2 s"), std::string::npos) << message;
  EXPECT_EQ(verdict_of(findings, "gaps"), Verdict::pass) << "reported once";
}

/// Every channel of the noisy bench with its rows in another order.
Recording with_rows(const std::function<void(std::vector<double>&)>& change) {
  Recording recording("changed", 1000.0);
  const Recording sound = noisy_bench();
  for (Channel copy : sound.channels()) {
    change(copy.values);
    recording.add(std::move(copy));
  }
  return recording;
}

TEST(CheckSignals, WarnOfRowsThatOccurTwice) {
  const auto findings = findings_of(alone(with_rows([](std::vector<double>& values) {
    std::copy(values.begin() + 3000, values.begin() + 5000, values.begin() + 5000);
  })));
  ASSERT_EQ(verdict_of(findings, "repeats"), Verdict::warn);
  const std::string& message = first_of(findings, "repeats").message;
  EXPECT_NE(message.find("occur again from t = 5"), std::string::npos) << message;
}

TEST(CheckSignals, DoNotTakeARestForRowsThatOccurTwice) {
  const auto findings = findings_of(alone(with_rows([](std::vector<double>& values) {
    std::fill(values.begin() + 3000, values.begin() + 4000, values[3000]);
    std::fill(values.begin() + 6000, values.begin() + 7000, values[3000]);
  })));
  EXPECT_EQ(verdict_of(findings, "repeats"), Verdict::pass) << text_of(findings);
}

TEST(CheckSignals, WarnOfMissingRowsWhoseStampsWereClosedUp) {
  const auto findings = findings_of(alone(with_rows([](std::vector<double>& values) {
    values.erase(values.begin() + 4100, values.begin() + 4200);
  })));
  ASSERT_EQ(verdict_of(findings, "gaps"), Verdict::warn);
  EXPECT_NE(text_of(findings).find("several channels jump together at t = 4.1 s"),
            std::string::npos)
      << text_of(findings);
}

TEST(CheckSignals, WarnOfRowsThatAreMissingAtATurningPointByTheClockOfASlowSensor) {
  const auto with_cut = [](std::size_t rows) {
    const Recording sound = noisy_bench();
    Recording recording("cut", 1000.0);
    for (Channel copy : sound.channels()) {
      if (copy.name == "torque_Nm") {
        copy.fresh.resize(copy.values.size());
        for (std::size_t i = 0; i < copy.values.size(); ++i) {
          copy.fresh[i] = i % 8 == 0 ? 1 : 0;
          copy.values[i] = copy.values[i / 8 * 8];
        }
        copy.fresh.erase(copy.fresh.begin() + 4100,
                         copy.fresh.begin() + 4100 + static_cast<std::ptrdiff_t>(rows));
      }
      const double level = copy.values[4099];  // nothing moves
      std::fill(copy.values.begin() + 4100, copy.values.end(), level);
      copy.values.resize(copy.values.size() - rows);
      recording.add(std::move(copy));
    }
    return findings_of(alone(recording));
  };
  EXPECT_EQ(verdict_of(with_cut(0), "gaps"), Verdict::pass) << text_of(with_cut(0));
  const auto findings = with_cut(100);
  ASSERT_EQ(verdict_of(findings, "gaps"), Verdict::warn);
  EXPECT_NE(text_of(findings).find("a new sample in every 8. row, but at t = 4.1 s after 4 rows"),
            std::string::npos)
      << text_of(findings);
}

}  // namespace
}  // namespace torsio

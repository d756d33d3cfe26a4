#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "sim/campaign/duty_bench.hpp"
#include "sim/campaign/duty_recording.hpp"
#include "sim/campaign/toy_monitor.hpp"
#include "torsio/core/error.hpp"

namespace torsio {
namespace {

std::vector<DutyLane> lanes(const DataSheet& sheet, std::size_t count, std::uint64_t seed) {
  std::vector<DutyLane> of;
  for (std::size_t i = 0; i < count; ++i) of.push_back({.sheet = sheet, .seed = seed + i});
  return of;
}

double sum(const Measurement& m) {
  return m.motor_angle_rad + m.middle_angle_rad + m.joint_angle_rad + m.twist_rad +
         m.motor_current_A + m.torque_Nm;
}

class EveryActuatorAtWork : public testing::TestWithParam<std::string> {};

TEST_P(EveryActuatorAtWork, StaysWithinItsLimits) {
  const DataSheet sheet = data_sheet(GetParam());
  const DutyLimits limits = duty_limits(sheet);
  DutyBench bench(lanes(sheet, 8, 1));
  double largest_Nm = 0.0;
  double farthest_rad = 0.0;
  double largest_error_rad = 0.0;
  double largest_A = 0.0;
  int impacts = 0;
  constexpr int kTicks = 120'000;
  for (int tick = 0; tick < kTicks; ++tick) {
    bench.sense();
    for (std::size_t lane = 0; lane < bench.size(); ++lane) {
      largest_Nm = std::max(largest_Nm, std::abs(bench.torque_Nm(lane)));
      farthest_rad = std::max(farthest_rad, std::abs(bench.sound(lane).joint_angle_rad));
      largest_A = std::max(largest_A, std::abs(bench.sound(lane).motor_current_A));
      const double ratio = total_ratio(plant_parameters(sheet));
      largest_error_rad = std::max(
          largest_error_rad,
          std::abs(bench.sound(lane).motor_angle_rad / ratio - bench.duty(lane).wanted_rad()));
      impacts += bench.duty(lane).has_impact_begun() ? 1 : 0;
      EXPECT_TRUE(std::isfinite(sum(bench.sound(lane))));
    }
    bench.act();
  }
  EXPECT_LT(largest_Nm, limits.torque_Nm);
  EXPECT_GT(largest_Nm, 0.5 * limits.torque_Nm);
  EXPECT_LT(farthest_rad, 1.5 * limits.range_rad);
  EXPECT_LT(largest_error_rad, 0.03);
  EXPECT_LT(largest_A, plant_parameters(sheet).motor.peak_current_A);
  EXPECT_GT(impacts, 30);
}

INSTANTIATE_TEST_SUITE_P(Actuators, EveryActuatorAtWork,
                         testing::Values("dfki-28", "dfki-50", "dfki-120", "dfki-300", "elastomer",
                                         "rubber-clutch", "harmonic-drive"),
                         [](const auto& of) {
                           std::string name = of.param;
                           std::ranges::replace(name, '-', '_');
                           return name;
                         });

TEST(DutyBench, AJointDependsNeitherOnTheOthersNorOnTheirNumber) {
  const DataSheet sheet = data_sheet("dfki-50");
  DutyBench many(lanes(sheet, 11, 5));
  DutyBench few(lanes(sheet, 2, 8));
  for (int tick = 0; tick < 20'000; ++tick) {
    many.sense();
    few.sense();
    for (std::size_t lane = 0; lane < 2; ++lane) {
      ASSERT_EQ(sum(many.measured(lane + 3)), sum(few.measured(lane))) << tick;
      ASSERT_EQ(many.torque_Nm(lane + 3), few.torque_Nm(lane));
    }
    many.act();
    few.act();
  }
}

TEST(DutyBench, AFaultIsSeenButDoesNotChangeTheSoundSignals) {
  const DataSheet sheet = data_sheet("dfki-50");
  std::vector<DutyLane> with = lanes(sheet, 2, 3);
  with[0].faults = {
      {{.what = "gear_angle_rad", .kind = FaultKind::jump, .start_s = 1.0, .amount = 0.1}}};
  DutyBench faulty(with);
  DutyBench sound(lanes(sheet, 2, 3));
  for (int tick = 0; tick < 2000; ++tick) {
    faulty.sense();
    sound.sense();
    // The loop runs on the rotor's encoder: the plant moves in the same way.
    ASSERT_EQ(faulty.sound(0).middle_angle_rad, sound.measured(0).middle_angle_rad);
    const double offset_rad =
        faulty.measured(0).middle_angle_rad - faulty.sound(0).middle_angle_rad;
    EXPECT_NEAR(offset_rad, tick < 1000 ? 0.0 : 0.1, 1e-12);
    ASSERT_EQ(faulty.measured(1).middle_angle_rad, sound.measured(1).middle_angle_rad);
    faulty.act();
    sound.act();
  }
}

TEST(DutyRecording, HasTheChannelsOfItsActuatorAndALoadCellAtTheRateOfTheLoop) {
  const Recording recording =
      duty_recording(data_sheet("harmonic-drive"), {.seed = 4, .duration_s = 3.0});
  EXPECT_EQ(recording.sample_rate_Hz(), 1000.0);
  EXPECT_EQ(recording.size(), 3000U);
  EXPECT_TRUE(recording.has("wave_generator_angle_rad"));
  EXPECT_TRUE(recording.has("motor_torque_Nm"));
  const Channel& torque = recording.channel("torque_Nm");
  for (std::size_t i = 0; i < recording.size(); ++i) ASSERT_TRUE(torque.is_fresh(i));
  const Recording again =
      duty_recording(data_sheet("harmonic-drive"), {.seed = 4, .duration_s = 3.0});
  EXPECT_EQ(again.channel("torque_Nm").values, torque.values);
  const Recording other =
      duty_recording(data_sheet("harmonic-drive"), {.seed = 5, .duration_s = 3.0});
  EXPECT_NE(other.channel("torque_Nm").values, torque.values);
}

TEST(DutyRecording, HasTruthAndTheElectricalSideOnRequest) {
  const Recording recording = duty_recording(
      data_sheet("dfki-28"), {.duration_s = 0.5, .is_electrical = true, .with_truth = true});
  EXPECT_TRUE(recording.has("supply_current_A"));
  EXPECT_TRUE(recording.has("truth_temperature_K"));
  const std::vector<double>& measured_Nm = recording.channel("torque_Nm").values;
  const std::vector<double>& truth_Nm = recording.channel("truth_torque_Nm").values;
  for (std::size_t i = 0; i < recording.size(); ++i) EXPECT_NEAR(measured_Nm[i], truth_Nm[i], 0.1);
}

TEST(DutyRecording, HasTheFaultsOfItsSensors) {
  const DataSheet sheet = data_sheet("dfki-50");
  const FaultSchedule faults{{parse_injection("joint_angle=dropout@200ms..300ms", sheet),
                              parse_injection("gear_angle=1rad@400ms", sheet)}};
  const Recording sound = duty_recording(sheet, {.duration_s = 0.5});
  const Recording faulty = duty_recording(sheet, {.duration_s = 0.5, .faults = faults});
  EXPECT_TRUE(faulty.channel("joint_angle_rad").is_fresh(199));
  EXPECT_FALSE(faulty.channel("joint_angle_rad").is_fresh(250));
  EXPECT_NEAR(faulty.channel("gear_angle_rad").values[450],
              sound.channel("gear_angle_rad").values[450] + 1.0, 1e-12);
  EXPECT_THROW((void)duty_recording(sheet, {.duration_s = 0.1, .faults = faults}), UsageError);
}

TEST(DutyRecording, RefusesADurationOutOfRange) {
  EXPECT_THROW((void)duty_recording(data_sheet("dfki-28"), {.duration_s = -1.0}), UsageError);
  EXPECT_THROW((void)duty_recording(data_sheet("dfki-28"), {.duration_s = NAN}), UsageError);
}

TEST(GuardedWork, EndsAtRestAfterTheStopOfItsMonitor) {
  const DataSheet sheet = data_sheet("dfki-50");
  const MonitoredTorque monitor = test::toy_monitor();
  DutyRun work{.seed = 1, .duration_s = 8.0, .with_truth = true};
  work.faults.faults.push_back(parse_injection("gear_angle=5deg@4s", sheet));
  const Recording without = duty_recording(sheet, work);
  work.guard = &monitor;
  const Recording guarded = duty_recording(sheet, work);
  const auto moved_rad = [](const Recording& recording) {
    const std::vector<double>& angle = recording.channel("truth_joint_angle_rad").values;
    const auto [low, high] = std::minmax_element(angle.begin() + 4500, angle.end());
    return *high - *low;
  };
  EXPECT_GT(moved_rad(without), 0.1);
  EXPECT_LT(moved_rad(guarded), 1e-3);
  // The work before the fault is the same; the smaller steps of a plant with a brake change it little.
  const std::vector<double>& angle = guarded.channel("truth_joint_angle_rad").values;
  EXPECT_NEAR(angle[3900], without.channel("truth_joint_angle_rad").values[3900], 1e-3);
}

}  // namespace
}  // namespace torsio

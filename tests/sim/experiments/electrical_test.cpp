#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

#include "sim/plant/energy_audit.hpp"
#include "support/every_actuator.hpp"
#include "torsio/actuator/electrical_sheet.hpp"
#include "torsio/signal/excitation.hpp"
#include "torsio/sim/experiments/experiment.hpp"

namespace torsio {
namespace {

/// The drive without errors of its sensors.
ElectricalDrive::Parameters exact_drive(const DataSheet& sheet) {
  ElectricalDrive::Parameters parameters = electrical_parameters(sheet, 1);
  parameters.sensors = {};
  parameters.commutation_error_rad = 0.0;
  return parameters;
}

struct Comparison {
  double rms_Nm = 0.0;
  double difference_Nm = 0.0;
  double residual_share = 0.0;  ///< residual of the energy audit over the throughput
};

/// One actuator with the lag of a current loop and once more with its electrical side, under the same
/// smooth random current. Its joint is locked: a free one would reach the limit of the voltage.
Comparison compared(const DataSheet& sheet, double share_of_rated) {
  const PlantParameters parts = plant_parameters(sheet);
  Plant lag(parts);
  Plant electrical(parts);
  electrical.use(exact_drive(sheet));
  const Load load{.is_locked = true};
  lag.reset(0.0, load);
  electrical.reset(0.0, load);
  EnergyAudit audit(electrical, load);
  BandLimitedNoise current(
      {.rms = share_of_rated * sheet.rating.current_A.value, .cutoff_Hz = 0.5, .seed = 3}, 1000.0);
  const int steps = static_cast<int>(std::ceil(1e-3 / lag.longest_step()));
  Comparison of;
  constexpr int kTicks = 4000;
  for (int tick = 0; tick < kTicks; ++tick) {
    const PlantCommand command{.current_A = current.step()};
    for (int i = 0; i < steps; ++i) {
      EXPECT_EQ(lag.step(command, load, 1e-3 / steps), Fault::none);
      EXPECT_EQ(electrical.step(command, load, 1e-3 / steps), Fault::none);
      audit.observe(electrical, load, 1e-3 / steps);
    }
    const double torque_Nm = lag.torques().second_Nm;
    of.rms_Nm += torque_Nm * torque_Nm / kTicks;
    of.difference_Nm += std::pow(electrical.torques().second_Nm - torque_Nm, 2) / kTicks;
  }
  of.rms_Nm = std::sqrt(of.rms_Nm);
  of.difference_Nm = std::sqrt(of.difference_Nm);
  of.residual_share = std::abs(audit.residual()) / audit.throughput();
  return of;
}

class ElectricalSide : public testing::TestWithParam<std::string> {};

TEST_P(ElectricalSide, AgreesWithTheLagBelowItsLimits) {
  const Comparison of = compared(data_sheet(GetParam()), 0.3);
  EXPECT_LT(of.difference_Nm, 0.02 * of.rms_Nm);
  EXPECT_LT(of.residual_share, 2e-4) << "energy audit";
}

TEST_P(ElectricalSide, HasPositiveValues) {
  for (const SheetRow& row : describe(electrical_sheet(data_sheet(GetParam()))))
    EXPECT_GT(row.value.value, 0.0) << row.name;
}

INSTANTIATE_TEST_SUITE_P(Actuators, ElectricalSide, testing::ValuesIn(test::every_actuator()),
                         [](const auto& parameter) {
                           std::string name = parameter.param;
                           std::ranges::replace_if(
                               name, [](char c) { return c == '-' || c == ':'; }, '_');
                           return name;
                         });

// The lag lets the voltage reach the supply; the phases only its share 1.5 / √3, so that a fast joint
// accelerates less.
TEST(ElectricalDriveOfAJoint, TurnsSlowerThanTheLagAtTheVoltageLimit) {
  const DataSheet sheet = data_sheet("dfki-50");
  Plant lag(plant_parameters(sheet));
  Plant electrical(plant_parameters(sheet));
  electrical.use(exact_drive(sheet));
  for (int n = 0; n < 2000; ++n) {
    ASSERT_EQ(lag.step({.current_A = 10.0}, {}, 1e-3), Fault::none);
    ASSERT_EQ(electrical.step({.current_A = 10.0}, {}, 1e-3), Fault::none);
  }
  const double ratio = electrical.state().rotor_speed_rad_s / lag.state().rotor_speed_rad_s;
  EXPECT_LT(ratio, 0.95);
  EXPECT_GT(ratio, 0.8);
}

TEST(SimulateElectrical, LogsWhatTheDriveMeasures) {
  const Recording recording =
      simulate({.duration_s = 3.0, .is_electrical = true, .with_truth = true});
  const auto& a = recording.channel("phase_a_current_A").values;
  const auto& b = recording.channel("phase_b_current_A").values;
  const auto& motor = recording.channel("motor_current_A").values;
  const auto& supply = recording.channel("supply_current_A").values;
  const auto& stator = recording.channel("stator_temperature_K").values;
  const auto& copper = recording.channel("truth_copper_temperature_K").values;
  double largest_A = 0.0;
  double max_amplitude_A = 0.0;
  double supply_A = 0.0;
  for (std::size_t i = 0; i < motor.size(); ++i) {
    // The amplitude of three phases that add up to zero.
    const double amplitude_A = std::sqrt(4.0 / 3.0 * (a[i] * a[i] + a[i] * b[i] + b[i] * b[i]));
    EXPECT_GE(amplitude_A + 1e-9, std::abs(motor[i])) << i;
    largest_A = std::max(largest_A, std::abs(motor[i]));
    max_amplitude_A = std::max(max_amplitude_A, amplitude_A);
    supply_A += supply[i] / static_cast<double>(motor.size());
  }
  EXPECT_GT(largest_A, 0.5);
  EXPECT_LT(max_amplitude_A, 1.2 * largest_A);
  EXPECT_GT(supply_A, 0.0);
  EXPECT_GT(stator.back(), 293.15);
  EXPECT_GT(copper.back(), stator.back());
  EXPECT_EQ(recording.channels()[recording.channels().size() - 1].name, "truth_temperature_K");
}

TEST(SimulateElectrical, IsReproducible) {
  const ExperimentSpec spec{.duration_s = 0.5, .is_electrical = true};
  const Recording one = simulate(spec);
  const Recording two = simulate(spec);
  for (const Channel& channel : one.channels())
    EXPECT_EQ(channel.values, two.channel(channel.name).values) << channel.name;
}

TEST(SimulateElectrical, DeratesAHotMotor) {
  const DataSheet sheet = data_sheet("dfki-50");
  ElectricalDrive::Parameters parameters = electrical_parameters(sheet, 1);
  parameters.ambient_K = 0.5 * (parameters.derating_begins_K + parameters.derating_ends_K);
  ElectricalDrive drive(parameters);
  const double peak_A = parameters.control.peak_current_A;
  for (int n = 0; n < 500; ++n) (void)drive.step(peak_A, 0.0, 0.0, 1e-4);
  EXPECT_NEAR(drive.current(), 0.5 * peak_A, 0.03 * peak_A);
}

}  // namespace
}  // namespace torsio

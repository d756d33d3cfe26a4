#include "sim/sensors/sensor_set.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <string>
#include <string_view>
#include <vector>

#include "support/moments.hpp"
#include "support/numbers.hpp"
#include "torsio/sim/experiments/experiment.hpp"

namespace torsio {
namespace {

using test::kRate_Hz;
using test::Moments;
using test::moments;

constexpr int kReadings = 60000;

/// One encoder of a sheet: measured and true angle.
struct EncoderUnderTest {
  std::string_view name;
  SheetValue SensorSheet::*bits;
  SheetValue SensorSheet::*zero_rad;
  double Measurement::*estimated_rad;
  double (*truth_rad)(const Plant& plant);
};
const std::vector<EncoderUnderTest>& encoders() {
  static const std::vector<EncoderUnderTest> all = {
      {"motor", &SensorSheet::motor_encoder_bits, &SensorSheet::motor_zero_rad,
       &Measurement::motor_angle_rad,
       [](const Plant& plant) { return plant.state().rotor_angle_rad; }},
      {"middle", &SensorSheet::middle_encoder_bits, &SensorSheet::middle_zero_rad,
       &Measurement::middle_angle_rad,
       [](const Plant& plant) { return plant.state().middle_angle_rad; }},
      {"joint", &SensorSheet::joint_encoder_bits, &SensorSheet::joint_zero_rad,
       &Measurement::joint_angle_rad,
       [](const Plant& plant) { return plant.state().joint_angle_rad; }},
      {"twist", &SensorSheet::twist_sensor_bits, &SensorSheet::twist_zero_rad,
       &Measurement::twist_rad, [](const Plant& plant) { return plant.second_twist(); }},
  };
  return all;
}

void expect_encoder_errors(const DataSheet& sheet) {
  Plant plant(plant_parameters(sheet));
  SensorSet sensors(sheet, kRate_Hz, 21);
  sensors.reset(0.0);
  Random random(5);
  std::vector<std::vector<double>> errors_rad(encoders().size());
  for (int i = 0; i < kReadings; ++i) {
    plant.reset(PlantState{.rotor_angle_rad = 2.0 * random.uniform() - 1.0,
                           .middle_angle_rad = 2.0 * random.uniform() - 1.0,
                           .joint_angle_rad = 2.0 * random.uniform() - 1.0});
    const Measurement measured = sensors.step(sensed(plant), 0.0);
    for (std::size_t k = 0; k < encoders().size(); ++k)
      errors_rad[k].push_back(measured.*encoders()[k].estimated_rad -
                              encoders()[k].truth_rad(plant));
  }
  const double jitter_lsb = sheet.sensors.encoder_jitter_lsb.value;
  const double expected_lsb = std::sqrt(jitter_lsb * jitter_lsb + 1.0 / 12.0);
  for (std::size_t k = 0; k < encoders().size(); ++k) {
    const double bits = (sheet.sensors.*encoders()[k].bits).value;
    if (bits == 0.0) continue;
    const double lsb_rad = 2.0 * std::numbers::pi / std::exp2(bits);
    const Moments error = moments(errors_rad[k]);
    const std::string which = full_name(sheet) + " " + std::string(encoders()[k].name);
    EXPECT_NEAR(error.std_dev / lsb_rad, expected_lsb, 0.02 * expected_lsb) << which;
    EXPECT_NEAR(error.mean / lsb_rad, (sheet.sensors.*encoders()[k].zero_rad).value / lsb_rad,
                5.0 * expected_lsb / std::sqrt(static_cast<double>(kReadings)))
        << which;
  }
}

TEST(SensorSet, EncoderErrorsAreJitterAndQuantisationOnEverySheet) {
  for (const DataSheet& sheet : data_sheets()) expect_encoder_errors(sheet);
}

TEST(SensorSet, EncodersHaveTheZeroErrorsOfTheSpecimen) {
  for (const DataSheet& sheet : data_sheets())
    expect_encoder_errors(data_sheet(std::string(sheet.name) + "#05"));
}

TEST(SensorSet, LoadCellAndCurrentSensorHaveTheirNoiseOnEverySheet) {
  for (const DataSheet& sheet : data_sheets()) {
    const Plant plant(plant_parameters(sheet));
    SensorSet sensors(sheet, kRate_Hz, 22);
    const double torque_Nm = 0.3 * sheet.rating.torque_Nm.value;
    sensors.reset(torque_Nm);
    std::vector<double> torques_Nm;
    std::vector<double> currents_A;
    for (int i = 0; i < kReadings; ++i) {
      const Measurement measured = sensors.step(sensed(plant), torque_Nm);
      currents_A.push_back(measured.motor_current_A);
      if (measured.is_torque_fresh) torques_Nm.push_back(measured.torque_Nm);
    }
    const double noise_Nm =
        sheet.sensors.torque_noise_share.value * sheet.sensors.torque_range_Nm.value;
    EXPECT_EQ(torques_Nm.size(),
              static_cast<std::size_t>(kReadings * sheet.sensors.torque_rate_Hz.value / kRate_Hz))
        << sheet.name;
    EXPECT_NEAR(moments(torques_Nm).mean, torque_Nm, 0.06 * noise_Nm) << sheet.name;
    EXPECT_NEAR(moments(torques_Nm).std_dev, noise_Nm, 0.05 * noise_Nm) << sheet.name;
    const double noise_A = sheet.sensors.current_noise_A.value;
    EXPECT_NEAR(moments(currents_A).mean, 0.0, 0.02 * noise_A) << sheet.name;
    EXPECT_NEAR(moments(currents_A).std_dev, noise_A, 0.02 * noise_A) << sheet.name;
  }
}

/// Root mean square of the difference between what was delivered and the truth `lag` ticks before.
double misfit(const std::vector<Measurement>& measured, const std::vector<double>& truth,
              std::size_t lag) {
  double square = 0.0;
  int fresh = 0;
  for (std::size_t i = 100; i < measured.size(); ++i) {
    if (!measured[i].is_torque_fresh) continue;
    const double error = measured[i].torque_Nm - truth[i - lag];
    square += error * error;
    ++fresh;
  }
  return std::sqrt(square / fresh);
}

TEST(SensorSet, LoadCellIsLateByItsLatencyOnEverySheet) {
  for (const DataSheet& sheet : data_sheets()) {
    const Plant plant(plant_parameters(sheet));
    SensorSet sensors(sheet, kRate_Hz, 23);
    std::vector<double> truth;
    std::vector<Measurement> measured;
    Random random(6);
    for (int i = 0; i < 20000; ++i) {
      truth.push_back(sheet.rating.torque_Nm.value * random.normal());
      measured.push_back(sensors.step(sensed(plant), truth.back()));
    }
    const auto expected_lag =
        static_cast<std::size_t>(std::lround(kRate_Hz * sheet.sensors.torque_latency_s.value));
    const double noise_Nm =
        sheet.sensors.torque_noise_share.value * sheet.sensors.torque_range_Nm.value;
    for (std::size_t lag = 0; lag < 10; ++lag) {
      if (lag == expected_lag) {
        EXPECT_NEAR(misfit(measured, truth, lag), noise_Nm, 0.06 * noise_Nm) << sheet.name;
      } else {
        EXPECT_GT(misfit(measured, truth, lag), 100.0 * noise_Nm) << sheet.name << " " << lag;
      }
    }
  }
}

TEST(SensorSet, RecordingsHaveTheRateOfTheirLoggerAndALoadCellThatIsFreshAtItsOwn) {
  int tried = 0;
  for (const DataSheet& sheet : data_sheets()) {
    const std::vector<ExperimentInfo> known = experiments(sheet);
    if (known.empty()) continue;
    ++tried;
    const std::string experiment(known.front().name);
    const Recording recording =
        simulate(sheet, {.experiment = experiment, .duration_s = 4.0, .with_truth = true});
    const double rate_Hz = sheet.sensors.log_rate_Hz.value;
    EXPECT_EQ(recording.sample_rate_Hz(), rate_Hz) << sheet.name;
    EXPECT_EQ(recording.size(), static_cast<std::size_t>(4.0 * rate_Hz)) << sheet.name;
    const Channel& cell = recording.channel("torque_Nm");
    const auto& truth = recording.channel("truth_torque_Nm").values;
    std::vector<double> errors_Nm;
    const auto lag =
        static_cast<std::size_t>(std::lround(rate_Hz * sheet.sensors.torque_latency_s.value));
    for (std::size_t i = 0; i < recording.size(); ++i) {
      if (cell.is_fresh(i) && i >= lag) errors_Nm.push_back(cell.values[i] - truth[i - lag]);
    }
    const double fresh_Hz = std::min(rate_Hz, sheet.sensors.torque_rate_Hz.value);
    EXPECT_NEAR(static_cast<double>(errors_Nm.size()), 4.0 * fresh_Hz, 1.0) << sheet.name;
    const double noise_Nm =
        sheet.sensors.torque_noise_share.value * sheet.sensors.torque_range_Nm.value;
    EXPECT_NEAR(moments(errors_Nm).std_dev, noise_Nm, 0.2 * noise_Nm) << sheet.name;
  }
  EXPECT_GE(tried, 5);
}

}  // namespace
}  // namespace torsio

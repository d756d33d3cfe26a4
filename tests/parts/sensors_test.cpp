#include <gtest/gtest.h>

#include <cmath>
#include <cstddef>
#include <vector>

#include "parts/current_sensor.hpp"
#include "parts/encoder.hpp"
#include "parts/torque_sensor.hpp"
#include "support/moments.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/units.hpp"

namespace torsio {
namespace {

using test::Moments;
using test::moments;

TEST(Encoder, NineteenBitsAreThePrintedResolution) {
  Random random(1);
  const Encoder encoder({.bits = 19.0}, random);
  EXPECT_NEAR(deg_from_rad(encoder.resolution()), 6.8665e-4, 5e-9);
}

TEST(Encoder, GivesWholeCodesOnly) {
  Random random(2);
  const Encoder encoder({.bits = 19.0}, random);
  const double first = encoder.read(0.3, random);
  for (int i = 0; i < 1000; ++i) {
    const double codes = (encoder.read(0.3 + 1e-4 * i, random) - first) / encoder.resolution();
    EXPECT_NEAR(codes, std::round(codes), 1e-6);
  }
}

TEST(Encoder, ErrorIsJitterPlusQuantisation) {
  Random random(3);
  const Encoder encoder({.bits = 19.0, .jitter_lsb = 0.5}, random);
  std::vector<double> errors;
  for (int i = 0; i < 200000; ++i) {
    const double angle = 2.0 * random.uniform() - 1.0;
    errors.push_back((encoder.read(angle, random) - angle) / encoder.resolution());
  }
  const Moments of = moments(errors);
  EXPECT_NEAR(of.mean, 0.0, 0.006);
  EXPECT_NEAR(of.std_dev, std::sqrt(0.25 + 1.0 / 12.0), 0.005);
}

TEST(CurrentSensor, AddsItsNoise) {
  Random random(4);
  const CurrentSensor sensor({.noise_A = 0.02});
  std::vector<double> readings;
  for (int i = 0; i < 100000; ++i) readings.push_back(sensor.read(3.0, random));
  EXPECT_NEAR(moments(readings).mean, 3.0, 3e-4);
  EXPECT_NEAR(moments(readings).std_dev, 0.02, 3e-4);
}

TEST(TorqueSensor, DeliversEveryEighthTickWhatItSampledTwoTicksBefore) {
  Random random(5);
  TorqueSensor sensor({.noise_Nm = 0.0, .sample_rate_Hz = 125.0, .latency_s = 2e-3}, 1e-3);
  sensor.reset(-1.0, random);
  for (int tick = 0; tick < 50; ++tick) {
    const auto reading = sensor.step(tick, random);
    EXPECT_EQ(reading.is_fresh, tick % 8 == 2) << tick;
    EXPECT_EQ(reading.torque_Nm, tick < 2 ? -1.0 : (tick - 2) / 8 * 8) << tick;
  }
}

TEST(TorqueSensor, NoiseIsDrawnOnceASample) {
  Random random(6);
  TorqueSensor sensor({.noise_Nm = 0.1, .sample_rate_Hz = 125.0, .latency_s = 2e-3}, 1e-3);
  sensor.reset(5.0, random);
  std::vector<double> fresh;
  double last = sensor.step(5.0, random).torque_Nm;
  for (int tick = 1; tick < 400000; ++tick) {
    const auto reading = sensor.step(5.0, random);
    if (reading.is_fresh) {
      fresh.push_back(reading.torque_Nm);
    } else {
      EXPECT_EQ(reading.torque_Nm, last);
    }
    last = reading.torque_Nm;
  }
  EXPECT_EQ(fresh.size(), 50000U);
  EXPECT_NEAR(moments(fresh).mean, 5.0, 0.003);
  EXPECT_NEAR(moments(fresh).std_dev, 0.1, 0.002);
}

TEST(Sensors, RefuseImpossibleParameters) {
  Random random(7);
  EXPECT_THROW(Encoder({.bits = 0.0}, random), Error);
  EXPECT_THROW(CurrentSensor({.noise_A = -0.1}), Error);
  EXPECT_THROW(TorqueSensor({.noise_Nm = 0.0, .sample_rate_Hz = 300.0}, 1e-3), Error);
  EXPECT_THROW(TorqueSensor({.noise_Nm = 0.0, .sample_rate_Hz = 125.0, .latency_s = 8e-3}, 1e-3),
               Error);
}

}  // namespace
}  // namespace torsio

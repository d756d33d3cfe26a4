#include "parts/motor.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "torsio/core/error.hpp"

namespace torsio {
namespace {

constexpr Motor::Parameters kMotor = {.torque_constant_Nm_A = 0.104,
                                      .peak_current_A = 10.0,
                                      .current_time_constant_s = 5e-4,
                                      .supply_V = 48.0,
                                      .resistance_Ohm = 0.5,
                                      .ripple = 0.002,
                                      .ripple_order = 30.0};

TEST(Motor, CurrentFollowsTheExactFirstOrderLag) {
  Motor motor(kMotor);
  motor.set_period(1e-4);
  for (int i = 0; i < 5; ++i) motor.step(4.0, 0.0, 0.0);
  EXPECT_NEAR(motor.current(), 4.0 * (1.0 - std::exp(-1.0)), 1e-14);
}

TEST(Motor, CurrentStopsAtItsPeak) {
  Motor motor(kMotor);
  motor.set_period(1.0);
  EXPECT_NEAR(motor.step(1e300, 0.0, 0.0), 0.104 * 10.0, 1e-12);
  EXPECT_NEAR(motor.step(-1e300, 0.0, 0.0), -0.104 * 10.0, 1e-12);
}

TEST(Motor, BackEmfTakesTheCurrentAway) {
  Motor motor(kMotor);
  motor.set_period(1.0);
  motor.step(10.0, 0.0, 440.0);
  EXPECT_NEAR(motor.current(), (48.0 - 0.104 * 440.0) / 0.5, 1e-9);
  motor.step(-10.0, 0.0, 440.0);
  EXPECT_NEAR(motor.current(), -10.0, 1e-9);
}

TEST(Motor, RipplesThirtyTimesATurn) {
  Motor motor(kMotor);
  motor.set_period(1.0);
  EXPECT_NEAR(motor.step(0.0, 3.141592653589793 / 60.0, 0.0), 0.002 * 0.104 * 10.0, 1e-12);
}

TEST(Motor, RefusesImpossibleParameters) {
  auto parameters = kMotor;
  parameters.torque_constant_Nm_A = 0.0;
  EXPECT_THROW(Motor{parameters}, Error);
  parameters = kMotor;
  parameters.resistance_Ohm = -1.0;
  EXPECT_THROW(Motor{parameters}, Error);
}

}  // namespace
}  // namespace torsio

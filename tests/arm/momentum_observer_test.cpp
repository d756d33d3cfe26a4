#include "torsio/arm/momentum_observer.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstddef>
#include <limits>

#include "support/arm6.hpp"
#include "support/error_message.hpp"

namespace torsio {
namespace {

constexpr double kObserverRate_Hz = 1000.0;

/// A rigid arm that falls and is pushed, with small steps between those of the observer.
struct FallingArm {
  ArmDynamics dynamics = ArmDynamics(test::arm6());
  test::Arm6Joints angle_rad = {0.1, 0.3, -0.5, 0.2, 0.4, 0.1};
  test::Arm6Joints speed_rad_s = {};
  test::Arm6Joints torque_Nm = {};

  void step(const test::Arm6Joints& external_Nm) {
    constexpr int kSmall = 20;
    dynamics.gravity_torque(angle_rad, torque_Nm);
    for (std::size_t j = 0; j < test::kArm6Joints; ++j)
      torque_Nm[j] = 0.9 * torque_Nm[j] - 0.2 * speed_rad_s[j];
    for (int i = 0; i < kSmall; ++i) {
      test::Arm6Joints all_Nm = torque_Nm;
      for (std::size_t j = 0; j < test::kArm6Joints; ++j) all_Nm[j] += external_Nm[j];
      test::Arm6Joints acceleration;
      dynamics.forward(angle_rad, speed_rad_s, all_Nm, acceleration);
      for (std::size_t j = 0; j < test::kArm6Joints; ++j) {
        speed_rad_s[j] += acceleration[j] / (kObserverRate_Hz * kSmall);
        angle_rad[j] += speed_rad_s[j] / (kObserverRate_Hz * kSmall);
      }
    }
  }
};

TEST(MomentumObserver, FollowsAnExternalTorqueOfAMovingArm) {
  FallingArm arm;
  MomentumObserver observer(test::kArm6Joints, {.bandwidth_rad_s = 100.0}, kObserverRate_Hz);
  const test::Arm6Joints pushed = {3.0, -5.0, 2.0, 0.5, -0.3, 0.1};
  for (int tick = 0; tick < 400; ++tick) {
    ASSERT_EQ(observer.step(arm.dynamics, arm.angle_rad, arm.speed_rad_s, arm.torque_Nm),
              Fault::none);
    if (tick > 50 && tick < 200) {
      for (std::size_t j = 0; j < test::kArm6Joints; ++j)
        EXPECT_NEAR(observer.external_torque_Nm()[j], 0.0, 0.15) << tick << " " << j;
    }
    if (tick == 203) {  // two poles: K² t exp(−K t) is small after 3 ms
      EXPECT_LT(std::abs(observer.external_torque_Nm()[1]), 0.5 * std::abs(pushed[1]));
    }
    if (tick > 300) {
      for (std::size_t j = 0; j < test::kArm6Joints; ++j)
        EXPECT_NEAR(observer.external_torque_Nm()[j], pushed[j], 0.15) << tick << " " << j;
    }
    arm.step(tick < 200 ? test::Arm6Joints{} : pushed);
  }
}

TEST(MomentumObserver, HoldsItsValuesOverWhatIsNotFinite) {
  FallingArm arm;
  MomentumObserver observer(test::kArm6Joints, {}, kObserverRate_Hz);
  const test::Arm6Joints pushed = {3.0, -5.0, 2.0, 0.5, -0.3, 0.1};
  for (int tick = 0; tick < 200; ++tick) {
    arm.step(pushed);
    test::Arm6Joints angle_rad = arm.angle_rad;
    const double last_Nm = observer.external_torque_Nm()[1];
    if (tick == 150) angle_rad[3] = std::numeric_limits<double>::quiet_NaN();
    const Fault fault = observer.step(arm.dynamics, angle_rad, arm.speed_rad_s, arm.torque_Nm);
    EXPECT_EQ(fault, tick == 150 ? Fault::input_not_finite : Fault::none);
    if (tick == 150) {
      EXPECT_EQ(observer.external_torque_Nm()[1], last_Nm);
    } else if (tick > 150) {
      EXPECT_NEAR(observer.external_torque_Nm()[1], pushed[1], 0.3);
    }
  }
}

TEST(MomentumObserver, RefusesSettingsThatCannotWork) {
  const auto message = [](std::size_t joints, double bandwidth_rad_s) {
    return test::error_message([&] {
      const MomentumObserver observer(joints, {.bandwidth_rad_s = bandwidth_rad_s},
                                      kObserverRate_Hz);
    });
  };
  EXPECT_THAT(message(0, 100.0), testing::HasSubstr("1 to 8 joints"));
  EXPECT_THAT(message(6, 0.0), testing::HasSubstr("bandwidth"));
  EXPECT_THAT(message(6, 300.0), testing::HasSubstr("a fifth of the sample rate"));
}

}  // namespace
}  // namespace torsio

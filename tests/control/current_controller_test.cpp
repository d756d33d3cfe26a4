#include "control/current_controller.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <string>

#include "support/error_message.hpp"
#include "support/numbers.hpp"

namespace torsio {
namespace {

using test::kNaN;

constexpr double kPwm_Hz = 30e3;
constexpr double kSupply_V = 48.0;

CurrentController::Settings settings() {
  return {.windings = {.resistance_Ohm = 0.4,
                       .inductance_H = 0.5e-3,
                       .torque_constant_Nm_A = 0.104,
                       .pole_pairs = 5},
          .bandwidth_rad_s = 2000.0,
          .peak_current_A = 10.0,
          .trip_current_A = 20.0};
}

CurrentController::Measurement measurement(const DirectQuadrature& current_A, double angle_rad,
                                           double speed_rad_s) {
  return {.phases_A = phases_of(current_A, ElectricalAngle::of(angle_rad)),
          .angle_rad = angle_rad,
          .speed_rad_s = speed_rad_s,
          .supply_V = kSupply_V};
}

/// The voltage that three duties make, in axes at this angle.
DirectQuadrature voltage(const ThreePhase& duties, double angle_rad) {
  const ThreePhase phases_V{kSupply_V * duties.a, kSupply_V * duties.b, kSupply_V * duties.c};
  return rotor_axes(phases_V, ElectricalAngle::of(angle_rad));
}

TEST(ThreePhase, AxesKeepTheAmplitudeAndComeBack) {
  for (double angle_rad = -4.0; angle_rad < 4.0; angle_rad += 0.37) {
    const ElectricalAngle angle = ElectricalAngle::of(angle_rad);
    const ThreePhase phases{3.0 * std::cos(angle_rad + 0.5),
                            3.0 * std::cos(angle_rad + 0.5 - 2.0 * std::numbers::pi / 3.0),
                            3.0 * std::cos(angle_rad + 0.5 + 2.0 * std::numbers::pi / 3.0)};
    const DirectQuadrature axes = rotor_axes(phases, angle);
    EXPECT_NEAR(axes.d, 3.0 * std::cos(0.5), 1e-12);
    EXPECT_NEAR(axes.q, 3.0 * std::sin(0.5), 1e-12);
    const ThreePhase again = phases_of(axes, angle);
    EXPECT_NEAR(again.a, phases.a, 1e-12);
    EXPECT_NEAR(again.b, phases.b, 1e-12);
    EXPECT_NEAR(again.c, phases.c, 1e-12);
  }
}

TEST(ThreePhase, AnAngleTurnsByAnother) {
  for (const double by_rad : {-2.0, -0.31, -0.29, -1e-3, 0.0, 0.1, 0.299, 0.301, 3.0}) {
    const ElectricalAngle turned = ElectricalAngle::of(0.7).turned_by(by_rad);
    EXPECT_NEAR(turned.sine, std::sin(0.7 + by_rad), 1e-10) << by_rad;
    EXPECT_NEAR(turned.cosine, std::cos(0.7 + by_rad), 1e-10) << by_rad;
  }
}

TEST(Windings, HaveTheCopperLossOfTheDrive) {
  const Drive drive{.torque_constant_Nm_A = 0.104, .resistance_Ohm = 0.6};
  const Windings windings = windings_of(drive, 0.5e-3, 5);
  EXPECT_DOUBLE_EQ(1.5 * windings.resistance_Ohm, drive.resistance_Ohm);
  EXPECT_DOUBLE_EQ(1.5 * windings.pole_pairs * windings.flux_Vs(), drive.torque_constant_Nm_A);
}

TEST(CurrentController, AppliesItsVoltageWhereTheRotorWillBe) {
  CurrentController controller(settings(), kPwm_Hz);
  const double speed_rad_s = 1500.0;
  const auto output = controller.step({0.0, 1.0}, measurement({0.1, 0.8}, 2.0, speed_rad_s));
  ASSERT_TRUE(output.is_on);
  EXPECT_FALSE(output.is_limited);
  const DirectQuadrature applied = voltage(output.duties, 2.0 + 1.5 * speed_rad_s / kPwm_Hz);
  EXPECT_NEAR(applied.d, output.voltage_V.d, 1e-9);
  EXPECT_NEAR(applied.q, output.voltage_V.q, 1e-9);
  // Proportional part and decoupling; the integrals are still 0.
  EXPECT_NEAR(output.voltage_V.d, 1.0 * -0.1 - speed_rad_s * 0.5e-3 * 0.8, 1e-9);
  EXPECT_NEAR(output.voltage_V.q, 1.0 * 0.2 + speed_rad_s * (0.5e-3 * 0.1 + 0.104 / 7.5), 1e-9);
}

TEST(CurrentController, UsesTheWholeSupplyAndNoMore) {
  CurrentController controller(settings(), kPwm_Hz);
  double largest_V = 0.0;
  for (double angle_rad = 0.0; angle_rad < 6.3; angle_rad += 0.01) {
    controller.reset();
    const auto output = controller.step({0.0, 10.0}, measurement({0.0, -10.0}, angle_rad, 3000.0));
    for (const double duty : {output.duties.a, output.duties.b, output.duties.c}) {
      EXPECT_GE(duty, -1e-12);
      EXPECT_LE(duty, 1.0 + 1e-12);
    }
    EXPECT_TRUE(output.is_limited);
    largest_V = std::max(largest_V, std::hypot(output.voltage_V.d, output.voltage_V.q));
    const DirectQuadrature applied = voltage(output.duties, angle_rad + 1.5 * 3000.0 / kPwm_Hz);
    EXPECT_NEAR(applied.q, output.voltage_V.q, 1e-9);
  }
  EXPECT_NEAR(largest_V, kSupply_V / std::numbers::sqrt3, 1e-9);
}

TEST(CurrentController, HoldsItsVoltageForAFewPeriodsWithoutMeasurements) {
  CurrentController controller(settings(), kPwm_Hz);
  const auto before = controller.step({0.0, 2.0}, measurement({0.0, 1.0}, 0.3, 100.0));
  for (int n = 0; n < CurrentController::kHeldPeriods; ++n) {
    const auto held = controller.step({0.0, 2.0}, measurement({0.0, kNaN}, 0.3, 100.0));
    EXPECT_TRUE(held.is_on);
    EXPECT_EQ(held.fault, Fault::input_not_finite);
    EXPECT_DOUBLE_EQ(held.voltage_V.q, before.voltage_V.q);
    const double angle_rad = 0.3 + (1.5 + n + 1.0) * 100.0 / kPwm_Hz;
    EXPECT_NEAR(voltage(held.duties, angle_rad).q, before.voltage_V.q, 1e-9);
  }
  const auto off = controller.step({0.0, 2.0}, measurement({0.0, kNaN}, 0.3, 100.0));
  EXPECT_FALSE(off.is_on);
  EXPECT_EQ(off.fault, Fault::input_not_finite);
  const auto again = controller.step({0.0, 2.0}, measurement({0.0, 1.0}, 0.3, 100.0));
  EXPECT_TRUE(again.is_on);
  EXPECT_EQ(again.fault, Fault::none);
}

TEST(CurrentController, OpensTheSwitchesWithoutAnyMeasurement) {
  CurrentController controller(settings(), kPwm_Hz);
  EXPECT_FALSE(controller.step({0.0, 2.0}, measurement({0.0, 0.0}, kNaN, 0.0)).is_on);
  auto no_supply = measurement({0.0, 0.0}, 0.0, 0.0);
  no_supply.supply_V = 0.0;
  EXPECT_FALSE(controller.step({0.0, 2.0}, no_supply).is_on);
}

TEST(CurrentController, AbsurdMeasurementsLeaveNoTrace) {
  CurrentController controller(settings(), kPwm_Hz);
  CurrentController sound(settings(), kPwm_Hz);
  (void)controller.step({0.0, 2.0}, measurement({0.0, 1.0}, 0.3, 100.0));
  (void)sound.step({0.0, 2.0}, measurement({0.0, 1.0}, 0.3, 100.0));
  const auto absurd = controller.step({0.0, 2.0}, measurement({0.0, 1.0}, 0.3, 1e308));
  for (const double duty : {absurd.duties.a, absurd.duties.b, absurd.duties.c})
    EXPECT_TRUE(duty >= 0.0 && duty <= 1.0);
  double difference_V = 0.0;
  for (int n = 0; n < 3000; ++n)
    difference_V = controller.step({0.0, 2.0}, measurement({0.0, 1.99}, 0.3, 100.0)).voltage_V.q -
                   sound.step({0.0, 2.0}, measurement({0.0, 1.99}, 0.3, 100.0)).voltage_V.q;
  EXPECT_LT(std::abs(difference_V), 1.0);
}

TEST(CurrentController, KeepsTheLastReferenceThatIsFinite) {
  CurrentController controller(settings(), kPwm_Hz);
  const auto at = measurement({0.0, 2.0}, 0.0, 0.0);
  (void)controller.step({0.0, 2.0}, at);
  const auto output = controller.step({0.0, kNaN}, at);
  EXPECT_TRUE(output.is_on);
  EXPECT_EQ(output.fault, Fault::input_not_finite);
  EXPECT_NEAR(output.voltage_V.q, 0.0, 1e-12);
}

TEST(CurrentController, TripsAboveTheLimitUntilItIsReset) {
  CurrentController controller(settings(), kPwm_Hz);
  const auto tripped = controller.step({0.0, 2.0}, measurement({0.0, 20.1}, 0.0, 0.0));
  EXPECT_TRUE(tripped.is_tripped);
  EXPECT_FALSE(tripped.is_on);
  EXPECT_FALSE(controller.step({0.0, 2.0}, measurement({0.0, 0.0}, 0.0, 0.0)).is_on);
  controller.reset();
  EXPECT_TRUE(controller.step({0.0, 2.0}, measurement({0.0, 0.0}, 0.0, 0.0)).is_on);
}

TEST(CurrentController, RefusesImpossibleSettings) {
  const auto refusal = [](auto change, double pwm_Hz = kPwm_Hz) {
    CurrentController::Settings changed = settings();
    change(changed);
    return test::error_message([&] { CurrentController(changed, pwm_Hz); });
  };
  EXPECT_EQ(refusal([](auto&) {}), "");
  EXPECT_NE(refusal([](auto& s) { s.windings.inductance_H = 0.0; }).find("inductance_H"),
            std::string::npos);
  EXPECT_NE(refusal([](auto& s) { s.windings.pole_pairs = 0; }).find("pole_pairs"),
            std::string::npos);
  EXPECT_NE(refusal([](auto& s) { s.trip_current_A = 5.0; }).find("trip current above"),
            std::string::npos);
  EXPECT_NE(refusal([](auto&) {}, 3000.0).find("phase margin of 45 degrees"), std::string::npos);
  EXPECT_NE(refusal([](auto&) {}, kNaN).find("pwm_Hz"), std::string::npos);
}

}  // namespace
}  // namespace torsio

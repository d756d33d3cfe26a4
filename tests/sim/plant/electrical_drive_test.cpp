#include "sim/plant/electrical_drive.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace torsio {
namespace {

constexpr double kPwm_Hz = 30e3;
constexpr double kPeriod_s = 1.0 / kPwm_Hz;

ElectricalDrive::Parameters parameters() {
  return {.control = {.windings = {.resistance_Ohm = 0.4,
                                   .inductance_H = 0.5e-3,
                                   .torque_constant_Nm_A = 0.104,
                                   .pole_pairs = 5},
                      .bandwidth_rad_s = 2000.0,
                      .peak_current_A = 10.0,
                      .trip_current_A = 20.0},
          .pwm_Hz = kPwm_Hz,
          .supply_V = 48.0,
          .thermal = {.copper_J_K = 30.0,
                      .stator_J_K = 200.0,
                      .copper_stator_K_W = 0.5,
                      .stator_ambient_K_W = 1.5},
          .derating_begins_K = 400.0,
          .derating_ends_K = 420.0};
}

CurrentController::Output duties(double a, double b, double c) {
  return {.duties = {a, b, c}, .is_on = true};
}

TEST(MotorWindings, OneStepIsAsManySmallOnes) {
  MotorWindings whole(parameters().control.windings);
  MotorWindings divided(parameters().control.windings);
  constexpr int kParts = 2000;
  constexpr double kDt_s = 1e-3;
  const double speed_rad_s = 900.0;
  const auto command = duties(0.8, 0.3, 0.45);
  const MotorWindings::Step step = whole.step(command, 48.0, 0.7, speed_rad_s, kDt_s);
  double impulse = 0.0;
  double electrical_J = 0.0;
  double copper_J = 0.0;
  for (int n = 0; n < kParts; ++n) {
    const double part_s = kDt_s / kParts;
    const double angle_rad = 0.7 + speed_rad_s * part_s * n;
    const DirectQuadrature before = divided.current(angle_rad);
    const MotorWindings::Step part = divided.step(command, 48.0, angle_rad, speed_rad_s, part_s);
    const DirectQuadrature after = divided.current(angle_rad + speed_rad_s * part_s);
    impulse += part.torque_Nm * part_s;
    electrical_J += part.electrical_J;
    // Independent of the balance from which the step computes it.
    const double squares =
        0.5 * (before.d * before.d + before.q * before.q + after.d * after.d + after.q * after.q);
    copper_J += 1.5 * 0.4 * squares * part_s;
  }
  EXPECT_NEAR(step.torque_Nm * kDt_s, impulse, 1e-12);
  EXPECT_NEAR(step.electrical_J, electrical_J, 1e-10);
  EXPECT_NEAR(step.copper_J, copper_J, 1e-5 * copper_J);
  EXPECT_NEAR(whole.current(0.0).q, divided.current(0.0).q, 1e-9);
}

TEST(MotorWindings, AVoltageDrivesItsCurrentAtRest) {
  MotorWindings windings(parameters().control.windings);
  const auto command = duties(0.6, 0.45, 0.45);
  for (int n = 0; n < 300; ++n) (void)windings.step(command, 48.0, 0.0, 0.0, kPeriod_s);
  const double voltage_V = 48.0 * (2.0 / 3.0) * 0.15;
  const double reached = -std::expm1(-300.0 * kPeriod_s * 0.4 / 0.5e-3);
  EXPECT_NEAR(windings.current(0.0).d, reached * voltage_V / 0.4, 1e-9);
  EXPECT_NEAR(windings.current(0.0).q, 0.0, 1e-12);
}

/// The current of one step of the reference, at constant speed.
class StepResponse {
 public:
  explicit StepResponse(double rotor_speed_rad_s,
                        const ElectricalDrive::Parameters& of = parameters())
      : drive_(of), speed_rad_s_(rotor_speed_rad_s) {}
  double advance(double wanted_A, double dt_s) {
    const double torque_Nm = drive_.step(wanted_A, angle_rad_, speed_rad_s_, dt_s);
    angle_rad_ += speed_rad_s_ * dt_s;
    return torque_Nm;
  }
  void settle(double wanted_A, double duration_s) {
    for (double t_s = 0.0; t_s < duration_s; t_s += 1e-4) advance(wanted_A, 1e-4);
  }
  ElectricalDrive& drive() { return drive_; }

 private:
  ElectricalDrive drive_;
  double speed_rad_s_;
  double angle_rad_ = 0.0;
};

TEST(ElectricalDrive, FollowsAStepWithTheLagOfTheDefaultMotor) {
  for (const double rotor_speed_rad_s : {0.0, 100.0, -250.0}) {
    StepResponse response(rotor_speed_rad_s);
    response.settle(1.0, 0.05);
    double largest_A = 0.0;
    for (int n = 1; n <= 150; ++n) {
      response.advance(3.0, kPeriod_s);
      // 1 / 2000 rad/s is the 0.5 ms of the default motor; the voltage comes one period late.
      const double lag_A = 3.0 - 2.0 * std::exp(-2000.0 * std::max(0, n - 1) * kPeriod_s);
      EXPECT_NEAR(response.drive().current(), lag_A, 0.09) << rotor_speed_rad_s << ' ' << n;
      largest_A = std::max(largest_A, response.drive().current());
    }
    EXPECT_NEAR(response.drive().current(), 3.0, 0.01);
    EXPECT_LT(largest_A, 3.03);
  }
}

TEST(ElectricalDrive, TheEnergyOfTheSupplyIsAccountedFor) {
  StepResponse response(150.0);
  for (int n = 0; n < 2000; ++n) response.advance(5.0 * std::sin(0.01 * n), 1e-4);
  const ElectricalDrive::Energy& energy = response.drive().energy();
  const double balance_J = energy.electrical_J - energy.mechanical_J - energy.copper_J;
  EXPECT_GT(energy.copper_J, 0.1);
  EXPECT_NEAR(balance_J, response.drive().stored_J(), 1e-3 * energy.copper_J);
}

TEST(ElectricalDrive, ReachesTheSpeedThatTheSupplyAllowsAndRecoversWithoutWindup) {
  ElectricalDrive drive(parameters());
  // Back-EMF p ω ψ above U / √3.
  const double too_fast_rad_s = 1.1 * 48.0 / std::numbers::sqrt3 / (0.104 / 1.5);
  double angle_rad = 0.0;
  for (int n = 0; n < 3000; ++n) {
    (void)drive.step(5.0, angle_rad, too_fast_rad_s, 1e-4);
    angle_rad += too_fast_rad_s * 1e-4;
  }
  EXPECT_LT(drive.current(), 1.0);
  EXPECT_TRUE(drive.command().is_limited);
  double largest_A = 0.0;
  for (int n = 0; n < 200; ++n) {
    (void)drive.step(5.0, angle_rad, 100.0, 1e-4);
    angle_rad += 100.0 * 1e-4;
    largest_A = std::max(largest_A, drive.current());
  }
  EXPECT_NEAR(drive.current(), 5.0, 0.05);
  EXPECT_LT(largest_A, 6.0);
}

TEST(ElectricalDrive, AnErrorOfTheCommutationAngleCostsItsCosine) {
  for (const double error_rad : {0.1, 0.5, 1.0}) {
    auto of = parameters();
    of.commutation_error_rad = error_rad;
    StepResponse response(50.0, of);
    response.settle(4.0, 0.1);
    EXPECT_NEAR(response.advance(4.0, 1e-4), 4.0 * 0.104 * std::cos(error_rad), 0.01 * 0.416);
  }
}

TEST(ElectricalDrive, AnOffsetOfACurrentSensorMakesATorqueRippleOncePerElectricalTurn) {
  auto of = parameters();
  of.sensors.offset_a_A = 0.2;
  StepResponse response(20.0, of);
  response.settle(2.0, 0.1);
  double lowest_Nm = std::numeric_limits<double>::infinity();
  double highest_Nm = -lowest_Nm;
  for (int n = 0; n < 1000; ++n) {
    const double torque_Nm = response.advance(2.0, 1e-4);
    lowest_Nm = std::min(lowest_Nm, torque_Nm);
    highest_Nm = std::max(highest_Nm, torque_Nm);
  }
  // With c = −a − b, an offset of a alone has the amplitude 2/√3 of itself in the axes.
  EXPECT_NEAR(0.5 * (highest_Nm - lowest_Nm), 0.104 * 0.2 * 2.0 / std::numbers::sqrt3, 1e-3);
}

TEST(ElectricalDrive, WarmsUpToItsSteadyState) {
  StepResponse response(0.0);
  response.settle(5.0, 0.02);
  const double loss_W = 1.5 * 0.4 * 25.0;
  auto of = parameters();
  of.thermal = {
      .copper_J_K = 0.03, .stator_J_K = 0.2, .copper_stator_K_W = 0.5, .stator_ambient_K_W = 1.5};
  StepResponse fast(0.0, of);
  fast.settle(5.0, 5.0);
  const double rise_K = fast.drive().copper_K() - 293.15;
  // The resistance rises with the temperature.
  const double expected_K = loss_W * 2.0 / (1.0 - 0.00393 * loss_W * 2.0);
  EXPECT_NEAR(rise_K, expected_K, 0.01 * expected_K);
  EXPECT_NEAR((fast.drive().stator_K() - 293.15) / rise_K, 0.75, 0.01);
}

TEST(ElectricalDrive, StaysFiniteWhateverItIsGiven) {
  ElectricalDrive drive(parameters());
  for (const double wanted_A : {std::numeric_limits<double>::quiet_NaN(), 1e300, -1e300, 2.0}) {
    for (int n = 0; n < 50; ++n)
      EXPECT_TRUE(std::isfinite(drive.step(wanted_A, 0.01 * n, 50.0, 1e-4)));
    EXPECT_LE(std::abs(drive.current()), 11.0);
  }
}

}  // namespace
}  // namespace torsio

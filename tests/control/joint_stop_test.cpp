#include "torsio/control/joint_stop.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <string>

#include "sim/plant/plant.hpp"
#include "support/error_message.hpp"
#include "support/numbers.hpp"
#include "torsio/actuator/joint_parameters.hpp"
#include "torsio/control/joint_controller.hpp"
#include "torsio/core/random.hpp"

namespace torsio {
namespace {

using test::kNaN;
using test::kRate_Hz;
using Phase = JointStop::Phase;

constexpr const char* kActuators[] = {"dfki-28", "dfki-50", "dfki-120", "dfki-300"};

JointStop::Settings stop_settings(const DataSheet& sheet, double load_Nm) {
  const Drive drive = drive_of(sheet);
  const Brake::Parameters brake = brake_parameters(sheet);
  return {.drive = drive,
          .speed_rad_s = sheet.rating.speed_rad_s.value,
          .deceleration_rad_s2 = 5.0,
          .longest_ramp_s = 1.5,
          .brake_static_Nm = brake.static_Nm * drive.ratio,
          .brake_sliding_Nm = brake.sliding_Nm * drive.ratio,
          .brake_engage_s = brake.engage_s,
          .brake_release_s = brake.release_s,
          .load_Nm = load_Nm};
}

JointControllerCore::Settings controller_settings(const DataSheet& sheet) {
  const SeriesElasticJoint joint = series_elastic_joint(sheet);
  const double rated_Nm = joint.drive.rated_current_A * joint.drive.torque_per_current();
  return {
      .torque = {.deflection = {.joint = joint}, .largest_torque_Nm = sheet.rating.torque_Nm.value},
      .limits = {.speed_rad_s = 0.9 * sheet.rating.speed_rad_s.value,
                 .max_unmeasured_load_Nm = 0.05 * rated_Nm,
                 .max_measured_load_Nm = 0.6 * rated_Nm}};
}

/// An angle as an encoder of 19 bits on this shaft measures it.
double encoded(double angle_rad) {
  constexpr double kStep_rad = 2.0 * std::numbers::pi / (1 << 19);
  return kStep_rad * std::round(angle_rad / kStep_rad);
}

enum class Lost { nothing, motor, gear, joint };

/// A simulated joint with a lever, its encoders, its controller, the stop and the brake.
class Rig {
 public:
  Rig(const DataSheet& sheet, double gravity_share, bool is_electrical = false)
      : drive_(drive_of(sheet)),
        stiffness_Nm_rad_(series_elastic_joint(sheet).stiffness_Nm_rad),
        load_(lever(gravity_share * sheet.rating.torque_Nm.value / (9.81 * 0.5), 0.5)),
        plant_(plant_parameters(sheet)),
        controller_(LinearInverse(series_elastic_joint(sheet).stiffness_Nm_rad),
                    controller_settings(sheet), kRate_Hz),
        stop_(stop_settings(sheet, load_.gravity_Nm), kRate_Hz),
        speed_(kRate_Hz, 120.0),
        coil_V_(brake_parameters(sheet).activation_V) {
    if (is_electrical) plant_.use(electrical_parameters(sheet, 1));
    plant_.use(brake_parameters(sheet));
    plant_.set_brake(false);
    EXPECT_EQ(plant_.reset(1.2, load_), Fault::none);
  }

  JointStop::Output tick(const JointReference& wanted, Lost lost = Lost::nothing) {
    const PlantState& state = plant_.state();
    const auto measure = [&](double angle_rad, Lost sensor) {
      return lost == sensor ? kNaN : encoded(angle_rad);
    };
    const JointSample sample = {.motor_angle_rad = measure(state.rotor_angle_rad, Lost::motor),
                                .gear_angle_rad = measure(state.middle_angle_rad, Lost::gear),
                                .joint_angle_rad = measure(state.joint_angle_rad, Lost::joint)};
    const double angle_rad = sample.motor_angle_rad / drive_.ratio;
    JointState measured = {.angle_rad = angle_rad,
                           .torque_Nm = stiffness_Nm_rad_ * sample.spring_deflection_rad()};
    if (lost == Lost::motor)
      speed_.skip();
    else
      measured.speed_rad_s = speed_.step(angle_rad);
    const auto wanted_A = controller_.step(stop_.reference(wanted, measured), sample);
    const JointStop::Output output = stop_.step(wanted_A.current_A, measured, wanted_A.fault);
    if (output.is_current_cut) controller_.track(output.current_A);
    const double before_rad = state.joint_angle_rad;
    EXPECT_EQ(plant_.step({.current_A = output.current_A,
                           .is_powered = output.is_powered,
                           .brake_V = output.is_brake_open ? coil_V_ : 0.0},
                          load_, 1.0 / kRate_Hz),
              Fault::none);
    external_J_ += load_.external_torque_Nm * (plant_.state().joint_angle_rad - before_rad);
    return output;
  }
  void push(double torque_Nm) { load_.external_torque_Nm = torque_Nm; }

  [[nodiscard]] double energy_J() const { return plant_.stored_energy(load_).all_J; }
  /// Energy of rotor, link and springs, without the potential energy of the load.
  [[nodiscard]] double moving_J() const {
    return energy_J() - load_.gravity_Nm * (1.0 - std::cos(plant_.state().joint_angle_rad));
  }
  [[nodiscard]] double external_J() const { return external_J_; }
  [[nodiscard]] const Plant& plant() const { return plant_; }
  JointStop& stop() { return stop_; }
  [[nodiscard]] double drive_speed_rad_s() const {
    return plant_.state().rotor_speed_rad_s / drive_.ratio;
  }

 private:
  Drive drive_;
  double stiffness_Nm_rad_;
  Load load_;
  Plant plant_;
  JointController<LinearInverse> controller_;
  JointStop stop_;
  Differentiator speed_;
  double coil_V_;
  double external_J_ = 0.0;
};

/// In motion for half a second: upwards, downwards, or while its torque is controlled.
void move(Rig& rig, const JointReference& reference) {
  for (int n = 0; n < 500; ++n) (void)rig.tick(reference);
}

const JointReference kMotions[] = {
    {.mode = JointMode::velocity, .velocity_rad_s = 0.5},
    {.mode = JointMode::velocity, .velocity_rad_s = -0.5},
    {.mode = JointMode::torque, .torque_Nm = 0.0},
    {.mode = JointMode::current, .current_A = 2.0},
};

std::string name_of(const char* actuator, const JointReference& motion) {
  return fmt::format("{} {} {} rad/s", actuator, name(motion.mode), motion.velocity_rad_s);
}

TEST(JointStop, NeverAddsEnergyWithThePowerOff) {
  for (const char* actuator : kActuators)
    for (const bool is_electrical : {false, true})
      for (const JointReference& motion : kMotions) {
        Rig rig(data_sheet(actuator), 0.3, is_electrical);
        move(rig, motion);
        rig.stop().trigger(StopCategory::power_off);
        const double first_J = rig.energy_J();
        const double moving_J = rig.moving_J();
        double last_J = first_J;
        for (int n = 0; n < 2000; ++n) {
          const auto output = rig.tick(motion);
          ASSERT_EQ(output.phase, Phase::off);
          ASSERT_FALSE(output.is_powered);
          ASSERT_FALSE(output.is_brake_open);
          // What the integration of the plant creates in a tick.
          ASSERT_LE(rig.energy_J(), last_J + 1e-3 * moving_J) << name_of(actuator, motion);
          ASSERT_LE(rig.energy_J(), first_J + 1e-3 * moving_J) << name_of(actuator, motion);
          last_J = rig.energy_J();
        }
        EXPECT_TRUE(rig.plant().brake()->is_closed());
        EXPECT_LT(std::abs(rig.drive_speed_rad_s()), 0.01) << name_of(actuator, motion);
      }
}

TEST(JointStop, StopsUnderPowerWithoutAddingEnergy) {
  for (const char* actuator : kActuators)
    for (const StopCategory category : {StopCategory::ramp_and_brake, StopCategory::ramp_and_hold})
      for (const JointReference& motion : kMotions)
        for (const double push_share : {0.0, 0.2, -0.2}) {
          const DataSheet sheet = data_sheet(actuator);
          Rig rig(sheet, 0.3);
          move(rig, motion);
          rig.stop().trigger(category);
          rig.push(push_share * sheet.rating.torque_Nm.value);
          const double first_J = rig.energy_J() - rig.external_J();
          const double moving_J = rig.moving_J();
          double max_J = first_J;
          JointStop::Output output;
          for (int n = 0; n < 3000; ++n) {
            output = rig.tick(motion);
            max_J = std::max(max_J, rig.energy_J() - rig.external_J());
          }
          const std::string run =
              fmt::format("{} {} {}", name_of(actuator, motion), name(category), push_share);
          EXPECT_LE(max_J - first_J, 0.01 * moving_J) << run;
          EXPECT_LE(output.motor_work_J, 0.01 * moving_J) << run;
          EXPECT_TRUE(output.is_drive_at_rest) << run;
          EXPECT_FALSE(output.has_escalated) << run;
          EXPECT_LT(std::abs(rig.drive_speed_rad_s()), 0.01) << run;
          const bool holds = category == StopCategory::ramp_and_hold;
          EXPECT_EQ(output.phase, holds ? Phase::holding : Phase::off) << run;
          EXPECT_EQ(output.is_powered, holds) << run;
          EXPECT_EQ(rig.plant().brake()->is_closed(), !holds) << run;
        }
}

// Motions, loads, categories, pushes and losses of sensors at random.
TEST(JointStop, DoesNoWorkInRandomStops) {
  double worst_share = 0.0;
  std::string worst;
  for (std::uint64_t seed = 1; seed <= 300; ++seed) {
    Random random(seed);
    const auto between = [&](double low, double high) {
      return low + (high - low) * random.uniform();
    };
    const char* actuator = kActuators[static_cast<std::size_t>(between(0.0, 3.999))];
    const DataSheet sheet = data_sheet(actuator);
    Rig rig(sheet, between(0.0, 0.4), random.uniform() < 0.3);
    JointReference motion = kMotions[static_cast<std::size_t>(between(0.0, 3.999))];
    motion.velocity_rad_s *= between(0.2, 2.0);
    const int moving = static_cast<int>(between(20.0, 700.0));
    for (int n = 0; n < moving; ++n) (void)rig.tick(motion);
    rig.stop().trigger(static_cast<StopCategory>(between(0.0, 2.999)));
    const double moving_J = rig.moving_J();
    int lost = 0;
    Lost sensor = Lost::nothing;
    for (int n = 0; n < 1500; ++n) {
      if (random.uniform() < 0.002) rig.push(between(-0.4, 0.4) * sheet.rating.torque_Nm.value);
      if (random.uniform() < 0.001)
        rig.stop().trigger(static_cast<StopCategory>(between(0.0, 2.999)));
      if (lost == 0 && random.uniform() < 0.001) {
        lost = static_cast<int>(between(1.0, 40.0));
        sensor = static_cast<Lost>(between(1.0, 3.999));
      }
      const auto output = rig.tick(motion, lost > 0 ? sensor : Lost::nothing);
      if (lost > 0) --lost;
      if (output.motor_work_J <= worst_share * moving_J) continue;
      worst_share = output.motor_work_J / moving_J;
      worst = fmt::format("{} seed {} tick {} {}: {:.3g} J of {:.3g} J", actuator, seed, n,
                          name(output.phase), output.motor_work_J, moving_J);
    }
  }
  EXPECT_LT(worst_share, 0.02) << worst;
}

// docs/simulation/faults.md 22: what is reported is what was measured.
TEST(JointStop, ReportsTheMeasuredStateAndNotTheWantedOne) {
  Rig rig(data_sheet("dfki-120"), 0.3);
  move(rig, kMotions[0]);
  rig.stop().trigger(StopCategory::power_off);
  auto output = rig.tick({});
  EXPECT_EQ(output.phase, Phase::off);
  EXPECT_FALSE(output.is_drive_at_rest) << "the power is off, and the joint still moves";
  EXPECT_NEAR(output.speed_rad_s, 0.5, 0.05);
  for (int n = 0; n < 2000; ++n) output = rig.tick({});
  EXPECT_TRUE(output.is_drive_at_rest);
  EXPECT_NEAR(output.since_s, 2.0, 0.01);
}

// The controller needs all three angles, the stop itself only that of the rotor.
TEST(JointStop, RemovesThePowerInEveryPhaseWhenAnAngleIsLost) {
  for (const Lost lost : {Lost::motor, Lost::gear, Lost::joint})
    for (const int ticks : {1, 1000}) {
      Rig rig(data_sheet("dfki-50"), 0.2);
      move(rig, kMotions[1]);
      rig.stop().trigger(StopCategory::ramp_and_hold);
      JointStop::Output output;
      for (int n = 0; n < ticks; ++n) output = rig.tick({});
      ASSERT_EQ(output.phase, ticks == 1 ? Phase::ramping : Phase::holding);
      output = rig.tick({}, lost);
      EXPECT_EQ(output.phase, Phase::off);
      EXPECT_FALSE(output.is_powered);
      EXPECT_FALSE(output.is_brake_open);
      EXPECT_TRUE(output.has_escalated);
    }
  Rig releasing(data_sheet("dfki-50"), 0.2);
  releasing.stop().trigger(StopCategory::power_off);
  for (int n = 0; n < 500; ++n) (void)releasing.tick({});
  ASSERT_TRUE(releasing.stop().release());
  EXPECT_EQ(releasing.tick({}).phase, Phase::releasing);
  EXPECT_EQ(releasing.tick({}, Lost::joint).phase, Phase::off);
}

TEST(JointStop, RemovesThePowerWhenTheDriveLeavesThePositionThatItHolds) {
  const DataSheet sheet = data_sheet("dfki-50");
  Rig rig(sheet, 0.2);
  rig.stop().trigger(StopCategory::ramp_and_hold);
  for (int n = 0; n < 500; ++n) (void)rig.tick({});
  ASSERT_EQ(rig.stop().phase(), Phase::holding);
  rig.push(1.5 * sheet.rating.torque_Nm.value);  // beyond what the current can hold for long
  JointStop::Output output;
  for (int n = 0; n < 60'000 && output.phase != Phase::off; ++n) output = rig.tick({});
  EXPECT_EQ(output.phase, Phase::off);
  EXPECT_TRUE(output.has_escalated);
}

TEST(JointStop, FollowsItsRampAlsoFromAControlledTorque) {
  Rig rig(data_sheet("dfki-50"), 0.0);
  for (int n = 0; n < 400; ++n) (void)rig.tick({.mode = JointMode::current, .current_A = 1.2});
  rig.stop().trigger(StopCategory::ramp_and_hold);
  const double start_rad_s = rig.tick({}).speed_rad_s;
  ASSERT_GT(start_rad_s, 0.3);
  for (int n = 2; n * 5e-3 < start_rad_s; ++n)
    ASSERT_LE(rig.tick({}).speed_rad_s, start_rad_s - 5e-3 * n + 0.15) << n;
}

TEST(JointStop, RemovesThePowerWhenTheRampTakesTooLong) {
  const DataSheet sheet = data_sheet("dfki-50");
  JointStop::Settings settings = stop_settings(sheet, 0.0);
  settings.speed_rad_s = 0.4;
  settings.longest_ramp_s = 0.1;
  JointStop stop(settings, kRate_Hz);
  stop.trigger(StopCategory::ramp_and_brake);
  JointStop::Output output;
  for (int n = 0; n < 200; ++n) {
    const JointState moving = {.angle_rad = 1e-3 * n, .speed_rad_s = 1.0};
    (void)stop.reference({}, moving);
    output = stop.step(0.0, moving);
  }
  EXPECT_EQ(output.phase, Phase::off);
  EXPECT_TRUE(output.has_escalated);
}

TEST(JointStop, IsLatchedAndReplacedOnlyByALowerCategory) {
  Rig rig(data_sheet("dfki-50"), 0.2);
  EXPECT_FALSE(rig.stop().release()) << "it runs";
  rig.stop().trigger(StopCategory::ramp_and_hold);
  for (int n = 0; n < 1000; ++n) (void)rig.tick(kMotions[0]);
  EXPECT_EQ(rig.stop().phase(), Phase::holding) << "no reference ends it";
  rig.stop().trigger(StopCategory::ramp_and_brake);
  for (int n = 0; n < 100; ++n) (void)rig.tick(kMotions[0]);
  EXPECT_EQ(rig.stop().phase(), Phase::off);
  EXPECT_TRUE(rig.plant().brake()->is_closed());
  rig.stop().trigger(StopCategory::ramp_and_hold);
  (void)rig.tick(kMotions[0]);
  EXPECT_EQ(rig.stop().phase(), Phase::off);
  const double angle_rad = rig.plant().state().joint_angle_rad;
  EXPECT_TRUE(rig.stop().release());
  auto output = rig.tick(kMotions[0]);
  EXPECT_EQ(output.phase, Phase::releasing);
  EXPECT_TRUE(output.is_powered);
  EXPECT_FALSE(output.is_brake_open) << "the motor takes over the load first";
  double lowest_rad = angle_rad;
  for (int n = 0; n < 560; ++n) {
    output = rig.tick(kMotions[0]);
    lowest_rad = std::min(lowest_rad, rig.plant().state().joint_angle_rad);
  }
  EXPECT_FALSE(rig.plant().brake()->is_closed());
  EXPECT_EQ(output.phase, Phase::releasing);
  EXPECT_GT(lowest_rad, angle_rad - 0.005) << "the motor holds the load";
  move(rig, kMotions[0]);
  EXPECT_EQ(rig.stop().phase(), Phase::running);
  EXPECT_GT(rig.plant().state().joint_angle_rad, angle_rad + 0.05);
}

TEST(JointStop, RefusesABrakeThatIsWeakerThanTheLoad) {
  const auto refusal = [](auto change) {
    JointStop::Settings settings = stop_settings(data_sheet("dfki-50"), 20.0);
    change(settings);
    return test::error_message([&] { return JointStop(settings, kRate_Hz); });
  };
  EXPECT_EQ(refusal([](auto&) {}), "");
  const std::string weak = refusal([](auto& s) { s.load_Nm = 81.0; });
  EXPECT_NE(weak.find("the brake is weaker than the load"), std::string::npos) << weak;
  EXPECT_NE(weak.find("80 Nm"), std::string::npos) << weak;
  EXPECT_NE(refusal([](auto& s) { s.brake_static_Nm = 70.0; }).find("static torque"),
            std::string::npos);
  EXPECT_NE(refusal([](auto& s) { s.deceleration_rad_s2 = 0.0; }), "");
  EXPECT_NE(refusal([](auto& s) { s.longest_ramp_s = kNaN; }), "");
  EXPECT_NE(refusal([](auto& s) { s.deceleration_rad_s2 = 0.5; }).find("ends within"),
            std::string::npos);
  EXPECT_NE(refusal([](auto& s) { s.deceleration_rad_s2 = 100.0; }).find("rated current makes"),
            std::string::npos);
}

}  // namespace
}  // namespace torsio

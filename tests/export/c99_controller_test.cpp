// What an exported controller commands, against JointController and JointStop, in a loop with a simulated joint.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numbers>
#include <optional>
#include <string>
#include <vector>

#include "control/spring_joint.hpp"
#include "export/exported_controller.hpp"
#include "model/hysteresis/operator_sum.hpp"
#include "support/every_family.hpp"
#include "support/example_model_file.hpp"
#include "support/example_models.hpp"
#include "support/grey_box_examples.hpp"
#include "support/temporary_folder.hpp"
#include "torsio/actuator/joint_parameters.hpp"
#include "torsio/control/model_inverse.hpp"
#include "torsio/core/random.hpp"
#include "torsio/export/c99.hpp"
#include "torsio/export/c_cost.hpp"
#include "torsio/model/any_model.hpp"
#include "torsio/signal/differentiator.hpp"

namespace torsio::test {
namespace {

constexpr double kNoNumber = std::numeric_limits<double>::quiet_NaN();
constexpr double kRate = 1000.0;
constexpr double kTurn = 2.0 * std::numbers::pi;

using Actuation = DeflectionController::Actuation;

ControllerFile controller(Actuation actuation = Actuation::current) {
  const DataSheet sheet = data_sheet("dfki-50");
  const SeriesElasticJoint joint = series_elastic_joint(sheet);
  const double rated_Nm = joint.drive.rated_current_A * joint.drive.torque_per_current();
  ControllerFile file{
      .actuator = "dfki-50",
      .sample_rate_Hz = kRate,
      .settings = {.torque = {.deflection = {.joint = joint, .actuation = actuation},
                              .largest_torque_Nm = 0.5 * rated_Nm},
                   .limits = {.lowest_rad = -0.4,
                              .highest_rad = 0.4,
                              .speed_rad_s = speed_limit_of(sheet),
                              .max_unmeasured_load_Nm = 0.05 * rated_Nm,
                              .max_measured_load_Nm = 0.6 * rated_Nm}},
      .stop = joint_stop_settings(sheet)};
  if (actuation == Actuation::velocity) file.settings.torque.deflection.bandwidth_rad_s = 25.0;
  return file;
}

/// A model of the torque of this actuator's spring, or of the deflection.
ModelFile around(const AnyModel& model, double stiffness_Nm_rad) {
  ModelFile file = example_model_file(model);
  file.settings.features.inputs = {"spring_deflection_rad", "lowpass(rate(joint_angle_rad), 50Hz)"};
  file.settings.ranges = {.lowest = {-0.08, -3.0}, .highest = {0.08, 3.0}, .margin = 0.05};
  file.settings.disturbances = {
      .largest_step = {0.05, 0.05}, .largest_travel = 0.01, .warm_up_s = 0.05};
  file.settings.fallback = {
      .intercept = 0.1, .slope = {stiffness_Nm_rad, 0.2}, .residual_std = 0.02 * stiffness_Nm_rad};
  return file;
}

/// What the joint is asked for: every mode, with numbers that are none, limits that are reached, and gains of zero.
JointReference wanted_at(std::size_t tick) {
  const double t = 1e-3 * static_cast<double>(tick);
  const double wave = std::sin(8.0 * t);
  JointReference wanted;
  switch (tick / 700 % 7) {
    case 0: wanted = {.mode = JointMode::torque, .torque_Nm = 12.0 * wave}; break;
    case 1:
      wanted = {.mode = JointMode::impedance,
                .position_rad = 0.2 * wave,
                .velocity_rad_s = 0.1,
                .torque_Nm = 1.0,
                .stiffness_Nm_rad = tick % 700 < 300 ? 40.0 : 70.0,
                .damping_Nms_rad = 1.0};
      break;
    case 2: wanted = {.mode = JointMode::deflection, .deflection_rad = 0.03 * wave}; break;
    case 3:
      wanted = {.mode = JointMode::position,
                .position_rad = 0.9 * wave,
                .velocity_rad_s = 0.1,
                .acceleration_rad_s2 = 0.2,
                .torque_Nm = 0.5,
                .current_A = 0.1};
      break;
    case 4: wanted = {.mode = JointMode::velocity, .velocity_rad_s = 2.0 * wave}; break;
    case 5:
      wanted = {.mode = JointMode::torque, .torque_Nm = 500.0 * wave, .current_A = 0.2};
      break;
    default: wanted = {.mode = JointMode::current, .current_A = 30.0 * wave}; break;
  }
  if (tick % 977 == 400) wanted.torque_Nm = kNoNumber;
  if (tick % 977 == 600) wanted.stiffness_Nm_rad = -1.0;
  return wanted;
}

struct Worst {
  double current_A = 0.0;
  double largest_A = 0.0;
  double deflection_rad = 0.0;
  std::size_t other = 0;  ///< ticks in which a flag, a limit, a fault or a phase differs
  std::size_t inverted = 0;
  std::size_t cut = 0;
};

double rounded_counts(double angle_rad, double counts) {
  return std::round(angle_rad / kTurn * counts);
}

/// Both in every tick, with the joint in the loop of ours.
Worst compared(const ModelFile& model, const C99Options& options, std::size_t ticks = 9800) {
  const TemporaryFolder folder;
  const ControllerFile& file = *options.controller;
  ExportedController exported(folder, model, options);
  AnyInverse inverse = AnyInverse::of(model.settings, model.parameters);
  for (const std::string& channel : model.settings.zeroed_channels) inverse.set_zero(channel, 0.0);
  JointController<AnyInverse> own(inverse, file.settings, kRate);
  JointStop stop(*file.stop, kRate);
  Differentiator speed(kRate, file.settings.speed_cutoff_Hz);
  SpringJoint joint(file.settings.torque.deflection.joint, JointOutput::free);
  const double ratio = file.settings.torque.deflection.joint.drive.ratio;
  Random random(5);
  Worst worst;
  double applied_A = 0.0;
  for (std::size_t n = 0; n < ticks; ++n) {
    joint.step(applied_A, 1.0 / kRate, 2.0 * std::sin(0.003 * static_cast<double>(n)));
    JointSample sample{.motor_angle_rad = ratio * joint.angle_rad(),
                       .gear_angle_rad = joint.angle_rad() + 1e-6 * random.normal(),
                       .joint_angle_rad = joint.joint_rad(),
                       .motor_current_A = applied_A};
    const bool is_lost = n % 1300 == 900 || (n % 2600 >= 1000 && n % 2600 < 1030);
    JointSample given = sample;
    for (const CCounts& counts : options.counts) {
      const auto take = [&](double& own_rad, double& theirs) {
        theirs = rounded_counts(own_rad, counts.counts_per_turn);
        own_rad = theirs / counts.counts_per_turn * kTurn;
      };
      if (counts.channel == "motor_angle_rad") take(sample.motor_angle_rad, given.motor_angle_rad);
      if (counts.channel == "gear_angle_rad") take(sample.gear_angle_rad, given.gear_angle_rad);
      if (counts.channel == "joint_angle_rad") take(sample.joint_angle_rad, given.joint_angle_rad);
    }
    if (is_lost) sample = given = {};
    if (n == 3500 || n == 5600) {
      stop.trigger(StopCategory::ramp_and_brake);
      exported.trigger(StopCategory::ramp_and_brake);
    }
    if (n == 7000) {
      stop.trigger(StopCategory::power_off);
      exported.trigger(StopCategory::power_off);
    }
    if (n % 2100 == 2000) {
      EXPECT_EQ(stop.release(), exported.release());
    }
    if (n == 2200) {
      EXPECT_EQ(own.set_limits(-0.3, 0.3, 1.0, 10.0), exported.set_limits(-0.3, 0.3, 1.0, 10.0));
    }
    if (n == 4000) {
      JointCascade::Gains gains =
          JointCascade::gains_for(file.settings.torque.deflection.joint.drive, 40.0);
      EXPECT_EQ(own.set_gains(gains), exported.set_gains(gains));
      gains.velocity.integral = -1.0;
      EXPECT_EQ(own.set_gains(gains), exported.set_gains(gains));
    }
    if (n == 9000) {
      own.reset();
      exported.reset();
    }
    const JointReference wanted = wanted_at(n);
    JointState state;
    const double angle_rad = sample.motor_angle_rad / ratio;
    if (std::isfinite(angle_rad + sample.spring_deflection_rad()))
      state = {.angle_rad = angle_rad,
               .torque_Nm = file.settings.torque.deflection.joint.stiffness_Nm_rad *
                            sample.spring_deflection_rad()};
    if (n == 9000) speed.reset();
    if (std::isfinite(state.angle_rad))
      state.speed_rad_s = speed.step(angle_rad);
    else
      speed.skip();
    const auto output = own.step(stop.reference(wanted, state), sample);
    const JointStop::Output stopped = stop.step(output.current_A, state, output.fault);
    if (stopped.is_current_cut) own.track(stopped.current_A);
    applied_A = stopped.current_A;
    const ExportedController::Output theirs = exported.step(wanted, given);
    worst.current_A = std::max(worst.current_A, std::abs(theirs.current_A - applied_A));
    worst.largest_A = std::max(worst.largest_A, std::abs(applied_A));
    worst.deflection_rad = std::max(worst.deflection_rad, std::abs(theirs.wanted_deflection_rad -
                                                                   output.spring_deflection_rad));
    const bool is_same = theirs.limit == output.limit && theirs.is_limited == output.is_limited &&
                         theirs.is_reference_refused == output.is_reference_refused &&
                         theirs.inverse == output.torque.inverse && theirs.fault == output.fault &&
                         theirs.phase == stopped.phase && theirs.is_powered == stopped.is_powered &&
                         theirs.is_brake_open == stopped.is_brake_open &&
                         theirs.is_drive_at_rest == stopped.is_drive_at_rest &&
                         theirs.has_escalated == stopped.has_escalated;
    if (!is_same) ++worst.other;
    if (output.limit != JointCascade::Limit::none) ++worst.cut;
    const bool is_spring = wanted.mode >= JointMode::torque && output.torque.inverse == Fault::none;
    if (is_spring && stopped.phase == JointStop::Phase::running) ++worst.inverted;
  }
  return worst;
}

void expect_same_commands(const ModelFile& model, const C99Options& options, double tolerance,
                          std::size_t max_other) {
  const Worst worst = compared(model, options);
  EXPECT_LT(worst.current_A, tolerance * worst.largest_A);
  EXPECT_LE(worst.other, max_other);
  EXPECT_GT(worst.cut, 100U);
  EXPECT_GT(worst.inverted, 1000U);
  EXPECT_GT(worst.largest_A, 1.0);
}

/// The example of a family, scaled so that it is about as stiff as the spring.
template <class Family>
AnyModel inverted_example() {
  return AnyModel(AnyModel::Parameters(example<Family>().parameters()));
}

template <class Family>
class C99Controller : public testing::Test {};
using Inverted = testing::Types<Linear, LinearCoulomb, Polynomial, MaxwellSlipModel,
                                PrandtlIshlinskii, GreyBox, GreyBoxWithBanks, GreyBoxWithMlp,
                                GreyBoxWithProducts, GreyBoxWithGp, Viscoelastic>;
struct InvertedName {
  template <class M>
  static std::string GetName(int index) {
    return std::to_string(index) + "_" + std::string(M::kFamily);
  }
};
TYPED_TEST_SUITE(C99Controller, Inverted, InvertedName);

TYPED_TEST(C99Controller, InDoubleIsTheJointController) {
  expect_same_commands(around(inverted_example<TypeParam>(), 100.0),
                       {.name = "joint", .real = CReal::twofold, .controller = controller()}, 1e-6,
                       0);
}

TYPED_TEST(C99Controller, WithCountsInFloatIsNearlyTheJointController) {
  const C99Options options{.name = "joint",
                           .real = CReal::single,
                           .counts = {{"motor_angle_rad", 16384.0},
                                      {"gear_angle_rad", 524288.0},
                                      {"joint_angle_rad", -524288.0}},
                           .controller = controller()};
  expect_same_commands(around(inverted_example<TypeParam>(), 100.0), options, 2e-3, 40);
}

TEST(C99ControllerTest, ActsOnTheVelocity) {
  expect_same_commands(
      around(inverted_example<Linear>(), 100.0),
      {.name = "joint", .real = CReal::twofold, .controller = controller(Actuation::velocity)},
      1e-6, 0);
}

TEST(C99ControllerTest, HasObserverFrictionAndFeedForwardOfTheRate) {
  ControllerFile file = controller();
  file.settings.torque.observer_cutoff_Hz = 3.0;
  file.settings.torque.friction = FrictionCompensation{};
  file.settings.torque.feeds_rate_forward = true;
  file.settings.limits.current_rate_A_s = 1e5;
  expect_same_commands(around(inverted_example<Linear>(), 100.0),
                       {.name = "joint", .real = CReal::twofold, .controller = file}, 1e-6, 0);
}

TEST(C99ControllerTest, TakesAModelOfTheDeflection) {
  ModelFile model = around(inverted_example<Mlp>(), 0.01);
  model.settings.target = "spring_deflection_rad";
  model.settings.features = {.inputs = {"torque_Nm", "lowpass(rate(joint_angle_rad), 50Hz)"},
                             .definitions = {}};
  model.settings.zeroed_channels = {};
  model.settings.ranges = {.lowest = {-50.0, -3.0}, .highest = {50.0, 3.0}, .margin = 0.05};
  model.settings.disturbances.largest_step = {1000.0, 0.05};
  expect_same_commands(model, {.name = "joint", .real = CReal::twofold, .controller = controller()},
                       1e-6, 0);
}

TEST(C99ControllerTest, TheCostOfAControlStepIsThatOfTheStepAndMore) {
  const ModelFile model = around(inverted_example<GreyBoxWithMlp>(), 100.0);
  const CTarget& target = find_c_target("cortex-m4f");
  const auto cost = [&](const std::optional<ControllerFile>& file) {
    return c_cost(c99_program(model, {.controller = file}, "x"), target, CReal::single);
  };
  ControllerFile bare = controller();
  bare.stop.reset();
  const CCost alone = cost(std::nullopt);
  const CCost without_stop = cost(bare);
  const CCost whole = cost(controller());
  EXPECT_FALSE(alone.control.has_value());
  ASSERT_TRUE(without_stop.control.has_value());
  ASSERT_TRUE(whole.control.has_value());
  EXPECT_EQ(whole.step.instructions, alone.step.instructions);
  EXPECT_GT(without_stop.control->instructions, 1.5 * alone.step.instructions);
  EXPECT_GT(whole.control->instructions, without_stop.control->instructions);
  EXPECT_GT(whole.control->stack, alone.step.stack);
  EXPECT_GT(whole.flash, without_stop.flash);
  EXPECT_GT(without_stop.flash, alone.flash);
  EXPECT_GT(whole.ram, alone.ram);
}

}  // namespace
}  // namespace torsio::test

#include "torsio/control/torque_controller.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "model/grey_box/grey_box.hpp"
#include "spring_joint.hpp"
#include "support/any_number.hpp"
#include "support/error_message.hpp"
#include "support/example_settings.hpp"
#include "support/examples/linear.hpp"
#include "support/examples/mixture.hpp"
#include "support/examples/network.hpp"
#include "support/numbers.hpp"
#include "torsio/actuator/joint_parameters.hpp"
#include "torsio/control/joint_cascade.hpp"
#include "torsio/control/model_inverse.hpp"
#include "torsio/core/random.hpp"
#include "torsio/estimate/torque_estimator.hpp"

namespace torsio {
namespace {

using test::any_random;
using test::kInfinity;
using test::kNaN;
using test::kRate_Hz;
using test::SpringJoint;

TorqueLoopCore::Settings torque_settings(const char* actuator) {
  const DataSheet sheet = data_sheet(actuator);
  return {.deflection = {.joint = series_elastic_joint(sheet)},
          .largest_torque_Nm = sheet.rating.torque_Nm.value};
}

/// Runs a loop on the linear joint for so long; the last output.
template <class Controller>
TorqueLoopCore::Output run(Controller& controller, SpringJoint& joint, const Drive& drive,
                           double wanted_Nm, int ticks, double drive_Nm = 0.0) {
  TorqueLoopCore::Output output;
  for (int n = 0; n < ticks; ++n) {
    output = controller.step(wanted_Nm, sample_of(joint, drive));
    joint.step(output.current_A, 1.0 / kRate_Hz, 0.0, drive_Nm);
  }
  return output;
}

// ------------------------------------------------------------------------------------- inverses

EstimatorSettings deflection_and_rate(double margin = 0.1) {
  EstimatorSettings settings = test::example_settings();
  settings.zeroed_channels.clear();
  settings.ranges = {.lowest = {-0.1, -1.0}, .highest = {0.1, 1.0}, .margin = margin};
  settings.fallback = {.intercept = 0.5, .slope = {600.0, 0.0}, .residual_std = 2.0};
  return settings;
}

JointSample wound(double deflection_rad) {
  JointSample sample;
  sample.gear_angle_rad = 0.2 + deflection_rad;
  sample.joint_angle_rad = 0.2;
  return sample;
}

template <class I>
Estimate settled(I& inverse, double torque_Nm, const JointSample& sample) {
  for (int n = 0; n < 100; ++n) (void)inverse.step(torque_Nm, sample);
  return inverse.step(torque_Nm, sample);
}

TEST(ModelInverse, OfALinearModelIsItsLinearInverse) {
  ModelInverse inverse(deflection_and_rate(), test::example<Linear>());
  const Estimate found = settled(inverse, 12.5, wound(0.01));
  EXPECT_EQ(found.fault, Fault::none);
  EXPECT_NEAR(found.value, (12.5 - 0.5) / 600.0, 1e-12);
  EXPECT_NEAR(LinearInverse(600.0, 0.5).step(12.5, {}).value, found.value, 1e-12);
}

TEST(ModelInverse, ReturnsTheLinearFallbackUntilItsFiltersHaveSettled) {
  ModelInverse inverse(deflection_and_rate(), test::example<Dgmm>());
  const Estimate first = inverse.step(12.5, wound(0.01));
  EXPECT_EQ(first.fault, Fault::warming_up);
  EXPECT_NEAR(first.value, 0.02, 1e-12);
}

TEST(ModelInverse, LeavesTheLineOnlySoFar) {
  for (const double most : {0.0, 0.5, 1e6}) {
    ModelInverse inverse(deflection_and_rate(), test::example<Dgmm>(), most);
    for (int n = -8; n <= 8; ++n) {
      const double torque_Nm = 2.5 * n;
      const Estimate found = settled(inverse, torque_Nm, wound(0.01));
      EXPECT_LE(std::abs(found.value - (torque_Nm - 0.5) / 600.0), most * 2.0 / 600.0 + 1e-12);
    }
  }
}

TEST(ModelInverse, HandsOverToTheLineOutsideWhatItWasTrainedOn) {
  ModelInverse inverse(deflection_and_rate(), test::example<Linear>());
  const Estimate beyond = settled(inverse, 200.0, wound(0.0));
  EXPECT_EQ(beyond.fault, Fault::outside_training_range);
  EXPECT_NEAR(beyond.value, 199.5 / 600.0, 1e-12);
}

TEST(ModelInverse, CountsInTheZerosOfItsChannels) {
  EstimatorSettings settings = deflection_and_rate();
  settings.zeroed_channels = {"joint_angle_rad"};
  ModelInverse inverse(settings, test::example<Linear>());
  EXPECT_EQ(inverse.step(12.5, wound(0.01)).fault, Fault::zero_not_set) << "while it warms up";
  EXPECT_EQ(settled(inverse, 12.5, wound(0.01)).fault, Fault::zero_not_set);
  inverse.set_zero("joint_angle_rad", -0.03);
  const Estimate found = settled(inverse, 12.5, wound(-0.02));
  EXPECT_EQ(found.fault, Fault::none);
  // Relative to its zero the joint is at +0.23: a spring wound by 20 mrad reads -10 mrad.
  EXPECT_NEAR(found.value, 0.02 + 0.03, 1e-9);
}

/// 600 Nm/rad and a branch of 100 that relaxes within 5 s.
ModelInverse relaxing_inverse() {
  EstimatorSettings settings = deflection_and_rate();
  settings.features = {.inputs = {"spring_deflection_rad"}, .definitions = {}};
  settings.ranges = {.lowest = {-0.1}, .highest = {0.1}, .margin = 0.1};
  settings.fallback = {.intercept = 0.0, .slope = {600.0}, .residual_std = 2.0};
  GreyBox::Parameters parameters;
  parameters.terms = {.curve_knots = {-0.1, 0.1},
                      .thresholds = {},
                      .friction_knots = {0.0},
                      .time_constants_s = {5.0},
                      .rate_scales = {0.0},
                      .sample_period_s = 1e-3};
  parameters.coefficients.values = Matrix(1, parameters.terms.columns());
  const auto coefficients = parameters.coefficients.values.row(0);
  coefficients[0] = -60.0;
  coefficients[1] = 60.0;
  coefficients[2] = 100.0;
  return ModelInverse(settings, GreyBox(parameters));
}

// A reference that only the limit of the deflection cuts, not one of the torque: the spring was
// never at the deflection that the inverse requested.
TEST(TorqueController, UpdatesTheInverseWithTheRequestedDeflectionAndNotWithTheWantedOne) {
  auto settings = torque_settings("dfki-50");
  settings.largest_torque_Nm = kInfinity;
  settings.deflection.largest_deflection_rad = 0.05;
  const auto asked_rad = [&](double reference_Nm) {
    TorqueController controller(relaxing_inverse(), settings, kRate_Hz);
    TorqueLoopCore::Output output;
    for (int n = 0; n < 2000; ++n) output = controller.step(6.0, wound(0.01));
    EXPECT_NEAR(output.wanted_deflection_rad, 0.01, 1e-3);
    for (int n = 0; n < 1000; ++n) output = controller.step(reference_Nm, wound(0.01));
    EXPECT_EQ(output.wanted_deflection_rad, 0.05);
    return controller.step(6.0, wound(0.01)).wanted_deflection_rad;
  };
  // The branch has come towards 0.05 rad by a fifth at most: 100 / 700 of that.
  EXPECT_LT(asked_rad(300.0), 0.0112);
  EXPECT_EQ(asked_rad(300.0), asked_rad(3000.0));
  EXPECT_EQ(asked_rad(300.0), asked_rad(40.0));
}

TEST(ModelInverse, GoesOnWithoutItsMemoryWhereThatIsNoLongerFinite) {
  ModelInverse inverse = relaxing_inverse();
  const double sound_rad = settled(inverse, 6.0, wound(0.01)).value;
  inverse.follow(kInfinity);
  for (int n = 0; n < 3; ++n) (void)inverse.step(6.0, wound(0.01));
  const Estimate found = inverse.step(6.0, wound(0.01));
  EXPECT_EQ(found.fault, Fault::none);
  EXPECT_NEAR(found.value, sound_rad, 2e-3);
}

TEST(ModelInverse, HoldsItsOutputWhereAnInputIsMissing) {
  ModelInverse inverse(deflection_and_rate(), test::example<Linear>());
  const double last_rad = settled(inverse, 12.5, wound(0.01)).value;
  for (const double bad : {kNaN, kInfinity}) {
    EXPECT_EQ(inverse.step(bad, wound(0.01)).value, last_rad);
    EXPECT_EQ(inverse.step(bad, wound(0.01)).fault, Fault::input_not_finite);
    EXPECT_EQ(inverse.step(9.0, wound(bad)).value, last_rad);
    EXPECT_EQ(inverse.step(9.0, wound(bad)).fault, Fault::input_not_finite);
  }
}

TEST(ModelInverse, RefusesModelsThatCannotBeRunBackwards) {
  const auto refusal = [](auto change, const AnyModel& model) {
    EstimatorSettings settings = deflection_and_rate();
    change(settings);
    return test::error_message([&] { ModelInverse(settings, model); });
  };
  const AnyModel line = test::example<Linear>();
  EXPECT_EQ(refusal([](auto&) {}, line), "");
  EXPECT_NE(
      refusal([](auto&) {}, test::example<Mlp>()).find("a family with an inverse, found 'mlp'"),
      std::string::npos);
  EXPECT_NE(refusal([](auto& s) { std::swap(s.features.inputs[0], s.features.inputs[1]); }, line)
                .find("spring_deflection_rad as the first input"),
            std::string::npos);
  EXPECT_NE(refusal([](auto& s) { s.fallback.slope[0] = 0.0; }, line).find("rises"),
            std::string::npos);
  EXPECT_NE(refusal([](auto& s) { s.features.inputs[1] = "winding_temperature_K"; }, line)
                .find("winding_temperature_K"),
            std::string::npos);
  EXPECT_NE(refusal([](auto& s) { s.target = "motor_current_A"; }, line).find("a torque in Nm"),
            std::string::npos);
}

EstimatorSettings torque_to_deflection() {
  EstimatorSettings settings = deflection_and_rate();
  settings.features = {.inputs = {"torque_Nm", "lowpass(rate(joint_angle_rad), 50Hz)"},
                       .definitions = {}};
  settings.target = "spring_deflection_rad";
  settings.ranges = {.lowest = {-50.0, -1.0}, .highest = {50.0, 1.0}};
  settings.fallback = {.slope = {1.0 / 600.0, 0.0}};
  return settings;
}

Linear line_of(std::vector<double> coefficients) {
  Linear::Parameters parameters;
  parameters.coefficients.values = Matrix(1, coefficients.size());
  parameters.coefficients.values.values = std::move(coefficients);
  return Linear(parameters);
}

TEST(TrainedInverse, TakesTheWantedTorqueForTheMeasuredOne) {
  AnyInverse inverse = AnyInverse::of(torque_to_deflection(),
                                      AnyModel(line_of({0.001, 1.0 / 500.0, 0.0})).parameters());
  const Estimate found = settled(inverse, 10.0, wound(0.0));
  EXPECT_EQ(found.fault, Fault::none);
  EXPECT_NEAR(found.value, 0.021, 1e-12);
}

TEST(TrainedInverse, RefusesAnotherTargetAndOtherInputs) {
  const auto refusal = [](auto change) {
    EstimatorSettings settings = torque_to_deflection();
    change(settings);
    return test::error_message([&] {
      TrainedInverse(Estimator(settings, line_of({0.0, 0.002, 0.0})));
    });
  };
  EXPECT_EQ(refusal([](auto&) {}), "");
  EXPECT_NE(refusal([](auto& s) { s.target = "torque_Nm"; }), "");
  EXPECT_NE(refusal([](auto& s) { s.features.inputs[0] = "motor_current_A"; }).find("torque_Nm"),
            std::string::npos);
  EXPECT_NE(
      refusal([](auto& s) { s.zeroed_channels = {"joint_angle_rad"}; }).find("zero of joint_angle"),
      std::string::npos);
  EXPECT_NE(refusal([](auto& s) { s.features.inputs[1] = "load_cell_V"; }).find("load_cell_V"),
            std::string::npos);
}

// ------------------------------------------------------------------------------------ controller

TEST(TorqueController, ReachesTheWantedTorqueAgainstALockedOutput) {
  for (const char* actuator : {"dfki-28", "dfki-50", "dfki-120", "dfki-300"}) {
    const auto settings = torque_settings(actuator);
    const SeriesElasticJoint& parts = settings.deflection.joint;
    TorqueController controller(LinearInverse(parts.stiffness_Nm_rad), settings, kRate_Hz);
    SpringJoint joint(parts, JointOutput::locked);
    const double wanted_Nm = 0.4 * settings.largest_torque_Nm;
    const auto output = run(controller, joint, parts.drive, wanted_Nm, 3000);
    EXPECT_NEAR(joint.torque_Nm(), wanted_Nm, 1e-4 * wanted_Nm) << actuator;
    EXPECT_NEAR(output.current_A,
                output.proportional_A + output.integral_A + output.derivative_A +
                    output.feed_forward_A + output.rate_feed_forward_A + output.friction_A +
                    output.observer_A + output.transfer_A,
                1e-12);
  }
}

TEST(TorqueController, CutsTheReferenceToTheRating) {
  const auto settings = torque_settings("dfki-50");
  TorqueController controller(LinearInverse(573.0), settings, kRate_Hz);
  EXPECT_EQ(controller.step(1e9, wound(0.0)).wanted_torque_Nm, settings.largest_torque_Nm);
}

TEST(TorqueController, ObservesADisturbanceThatNoIntegralMakesUpFor) {
  auto settings = torque_settings("dfki-50");
  settings.deflection.integral_1_s = 0.0;
  const SeriesElasticJoint& parts = settings.deflection.joint;
  const auto error_Nm = [&] {
    TorqueController controller(LinearInverse(parts.stiffness_Nm_rad), settings, kRate_Hz);
    SpringJoint joint(parts, JointOutput::locked);
    run(controller, joint, parts.drive, 10.0, 3000, -6.0);
    return std::abs(joint.torque_Nm() - 10.0);
  };
  const double without_Nm = error_Nm();
  settings.observer_cutoff_Hz = 5.0;
  EXPECT_GT(without_Nm, 1.0);
  EXPECT_LT(error_Nm(), 1e-3 * without_Nm);
}

TEST(TorqueController, CompensatesFrictionWhereTheSpringIsToBeWound) {
  auto settings = torque_settings("dfki-50");
  settings.friction = FrictionCompensation{.share = 0.5, .speed_rad_s = 1e-6};
  TorqueController controller(LinearInverse(573.0), settings, kRate_Hz);
  TorqueLoopCore::Output output;
  for (int n = 0; n < 200; ++n) output = controller.step(0.02 * n, wound(3.5e-5 * n));
  const Drive& drive = settings.deflection.joint.drive;
  const double rate_rad_s = 0.02 * kRate_Hz / settings.deflection.joint.stiffness_Nm_rad;
  EXPECT_NEAR(
      output.friction_A,
      0.5 * (drive.coulomb_Nm + drive.viscous_Nms_rad * rate_rad_s) / drive.torque_per_current(),
      1e-6);
}

// For a torque that rises steadily the plain loop has a lag of 2 ζ / ω, whatever the slope.
TEST(TorqueController, FollowsARampWithoutLagWhereItsRateIsFedForward) {
  auto settings = torque_settings("dfki-50");
  settings.deflection.integral_1_s = 0.0;
  settings.deflection.joint.drive.viscous_Nms_rad = 0.0;
  const SeriesElasticJoint& parts = settings.deflection.joint;
  constexpr double kSlope_Nm_s = 20.0;
  const auto lag_s = [&] {
    TorqueController controller(LinearInverse(parts.stiffness_Nm_rad), settings, kRate_Hz);
    SpringJoint joint(parts, JointOutput::locked);
    double wanted_Nm = 0.0;
    for (int n = 0; n < 1000; ++n) {
      wanted_Nm = kSlope_Nm_s * n / kRate_Hz;
      joint.step(controller.step(wanted_Nm, sample_of(joint, parts.drive)).current_A,
                 1.0 / kRate_Hz);
    }
    return (wanted_Nm - joint.torque_Nm()) / kSlope_Nm_s;
  };
  EXPECT_NEAR(lag_s(), 2.0 * settings.deflection.damping / settings.deflection.bandwidth_rad_s,
              2e-3);
  settings.feeds_rate_forward = true;
  EXPECT_NEAR(lag_s(), 0.0, 2e-3);
}

TEST(TorqueController, ReportsTheFaultAndTheCurrentFades) {
  auto settings = torque_settings("dfki-50");
  settings.observer_cutoff_Hz = 5.0;
  const SeriesElasticJoint& parts = settings.deflection.joint;
  TorqueController controller(LinearInverse(parts.stiffness_Nm_rad), settings, kRate_Hz);
  SpringJoint joint(parts, JointOutput::locked);
  double last_A = run(controller, joint, parts.drive, 10.0, 500, -6.0).current_A;
  const auto refused = controller.step(kNaN, sample_of(joint, parts.drive));
  EXPECT_EQ(refused.fault, Fault::input_not_finite);
  EXPECT_EQ(refused.wanted_torque_Nm, 10.0);
  EXPECT_NEAR(refused.current_A, last_A, 0.01);
  ASSERT_GT(refused.observer_A, 0.01);
  last_A = refused.current_A;
  for (int n = 0; n < 10; ++n) {
    JointSample lost = sample_of(joint, parts.drive);
    (n % 2 == 0 ? lost.motor_angle_rad : lost.gear_angle_rad) = kNaN;
    const auto faded = controller.step(10.0, lost);
    EXPECT_EQ(faded.fault, Fault::input_not_finite);
    EXPECT_NEAR(faded.current_A, last_A * std::exp(-1e-3 / settings.deflection.fault_decay_s),
                1e-12);
    last_A = faded.current_A;
  }
}

/// Loses the measurement for so many ticks under a load and a ramp; the largest change of the current
/// in a tick, within 20 ticks of its return.
double change_after_a_loss_A(const TorqueLoopCore::Settings& settings, int lost_ticks) {
  const SeriesElasticJoint& parts = settings.deflection.joint;
  TorqueController controller(LinearInverse(parts.stiffness_Nm_rad), settings, kRate_Hz);
  SpringJoint joint(parts, JointOutput::locked);
  double last_A = 0.0;
  int ticks = 0;
  const auto change_A = [&](bool is_lost) {
    JointSample sample = sample_of(joint, parts.drive);
    if (is_lost) sample.gear_angle_rad = kNaN;
    const auto output = controller.step(10.0 + 2e-3 * ++ticks, sample);
    joint.step(output.current_A, 1.0 / kRate_Hz, 0.0, -6.0);
    return output.current_A - std::exchange(last_A, output.current_A);
  };
  for (int n = 0; n < 2000; ++n) change_A(false);
  EXPECT_GT(last_A, 1.0);
  for (int n = 0; n < lost_ticks; ++n) {
    const double before_A = last_A;
    EXPECT_NEAR(change_A(true), before_A * std::expm1(-0.05), 1e-9);
  }
  EXPECT_NEAR(change_A(false), 0.0, 1e-9);
  double largest_A = 0.0;
  for (int n = 0; n < 20; ++n) largest_A = std::max(largest_A, std::abs(change_A(false)));
  return largest_A;
}

// The whole current is tested: the terms added to the deflection controller's neither vanish with
// the measurement nor return with it at once, nor after the ticks that the observer waits for.
TEST(TorqueController, LosesAndFindsItsMeasurementWithoutAJumpOfTheCurrent) {
  for (const int lost_ticks : {1, 5, 300}) {
    auto settings = torque_settings("dfki-50");
    // The joint has moved: its deflection is damped in either case.
    const double plain_A = change_after_a_loss_A(settings, lost_ticks);
    settings.observer_cutoff_Hz = 5.0;
    settings.friction = FrictionCompensation{};
    settings.feeds_rate_forward = true;
    EXPECT_LT(change_after_a_loss_A(settings, lost_ticks), plain_A + 0.1) << lost_ticks;
  }
}

TEST(TorqueController, RefusesWhatItCannotDo) {
  const auto refusal = [](auto change) {
    TorqueLoopCore::Settings settings = torque_settings("dfki-50");
    change(settings);
    return test::error_message([&] { TorqueController(LinearInverse(573.0), settings, kRate_Hz); });
  };
  EXPECT_EQ(refusal([](auto&) {}), "");
  EXPECT_EQ(refusal([](auto& s) { s.observer_cutoff_Hz = 5.0; }), "");
  const std::string fast = refusal([](auto& s) { s.observer_cutoff_Hz = 250.0; });
  EXPECT_NE(fast.find("unstable with its output"), std::string::npos) << fast;
  EXPECT_NE(fast.find("degrees at"), std::string::npos) << fast;
  EXPECT_NE(refusal([](auto& s) { s.observer_cutoff_Hz = 600.0; }), "");
  EXPECT_NE(refusal([](auto& s) { s.largest_torque_Nm = kNaN; }), "");
  EXPECT_NE(refusal([](auto& s) { s.friction = FrictionCompensation{.share = 1.5}; }), "");
  const auto acts_on_speed = [](TorqueLoopCore::Settings& s) {
    s.deflection.actuation = DeflectionController::Actuation::velocity;
    s.deflection.bandwidth_rad_s = 25.0;
    s.deflection.speed_loop = JointCascade::gains_for(s.deflection.joint.drive, 100.0).velocity;
  };
  EXPECT_EQ(refusal(acts_on_speed), "");
  EXPECT_NE(refusal([&](auto& s) {
              acts_on_speed(s), s.observer_cutoff_Hz = 5.0;
            }).find("acts on the speed"),
            std::string::npos);
  EXPECT_NE(refusal([&](auto& s) {
              acts_on_speed(s), s.feeds_rate_forward = true;
            }).find("acts on the speed"),
            std::string::npos);
  EXPECT_NE(test::error_message([] { return LinearInverse(0.0); }), "");
}

// 100 cases of 10^4 ticks on a free joint: any references, NaN among them, then none; the energy
// stays within what the peak current can supply in that time, and decreases again.
RC_GTEST_PROP(TorqueController, BoundsTheEnergyForAnyReferenceAndReleasesIt, ()) {
  auto settings = torque_settings(*rc::gen::element("dfki-28", "dfki-50", "dfki-120", "dfki-300"));
  if (*rc::gen::arbitrary<bool>()) settings.observer_cutoff_Hz = 3.0;
  if (*rc::gen::arbitrary<bool>()) settings.friction = FrictionCompensation{};
  settings.feeds_rate_forward = *rc::gen::arbitrary<bool>();
  SeriesElasticJoint parts = settings.deflection.joint;
  parts.joint_viscous_Nms_rad = 1.0;
  settings.deflection.joint = parts;
  Random random = any_random();
  TorqueController controller(LinearInverse(parts.stiffness_Nm_rad), settings, kRate_Hz);
  SpringJoint joint(parts, JointOutput::free);
  const double max_Nm = parts.drive.peak_current_A * parts.drive.torque_per_current();
  const double max_rad_s = max_Nm / parts.drive.viscous_Nms_rad;
  const double max_J =
      0.5 * (parts.drive.inertia() + parts.joint_inertia_kg_m2) * max_rad_s * max_rad_s +
      2.0 * max_Nm * max_Nm / parts.stiffness_Nm_rad;
  double wanted_Nm = 0.0;
  double largest_J = 0.0;
  for (int n = 0; n < 10'000; ++n) {
    if (random.uniform() < 0.01) wanted_Nm = 2.0 * settings.largest_torque_Nm * random.normal();
    if (n >= 7000) wanted_Nm = 0.0;
    const double spoiled = random.uniform();
    const double asked_Nm = spoiled < 0.01 ? kNaN : wanted_Nm;
    const auto output = controller.step(asked_Nm, sample_of(joint, parts.drive));
    RC_ASSERT(std::abs(output.current_A) <= parts.drive.peak_current_A);
    RC_ASSERT((output.fault != Fault::none) == std::isnan(asked_Nm));
    joint.step(output.current_A, 1.0 / kRate_Hz);
    RC_ASSERT(joint.energy_J() <= max_J);
    if (n < 7000) largest_J = std::max(largest_J, joint.spring_J());
  }
  // The spring is released; the joint itself may still turn.
  RC_ASSERT(joint.spring_J() <= 0.01 * largest_J);
}

// 100 cases of 10^4 ticks.
RC_GTEST_PROP(TorqueController, GivesAFiniteCurrentForAnyNumbers, ()) {
  auto settings = torque_settings("dfki-50");
  settings.observer_cutoff_Hz = 5.0;
  settings.friction = FrictionCompensation{};
  settings.feeds_rate_forward = true;
  Random random = any_random();
  TorqueController controller(ModelInverse(deflection_and_rate(), test::example<Dgmm>()), settings,
                              kRate_Hz);
  for (int n = 0; n < 10'000; ++n) {
    const auto spoil = [&](double value) {
      const double draw = random.uniform();
      return draw < 0.05 ? kNaN : draw < 0.08 ? -kInfinity : draw < 0.1 ? 1e308 : value;
    };
    JointSample sample;
    sample.motor_angle_rad = spoil(random.normal());
    sample.gear_angle_rad = spoil(0.01 * random.normal());
    sample.joint_angle_rad = spoil(0.01 * random.normal());
    const double wanted_Nm = spoil(10.0 * random.normal());
    const auto output = controller.step(wanted_Nm, sample);
    RC_ASSERT(std::abs(output.current_A) <= settings.deflection.joint.drive.peak_current_A);
    if (!std::isfinite(wanted_Nm) || !std::isfinite(sample.motor_angle_rad) ||
        !std::isfinite(sample.spring_deflection_rad()))
      RC_ASSERT(output.fault == Fault::input_not_finite);
  }
}

}  // namespace
}  // namespace torsio

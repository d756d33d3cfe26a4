#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <string>
#include <thread>
#include <tuple>
#include <vector>

#include "mujoco/simulated_spring.hpp"
#include "support/error_message.hpp"
#include "support/grey_box_examples.hpp"

namespace torsio::test {
namespace {

using testing::HasSubstr;

Estimator estimator_with_zero(Estimator estimator) {
  for (const std::string& channel : std::vector<std::string>(estimator.unset_zeros()))
    estimator.set_zero(channel, 0.0);
  return estimator;
}

/// The largest difference between the torque on the simulated joint and that of the estimator on the logged angles.
struct Comparison {
  double largest_Nm = 0.0;
  double range_Nm = 0.0;
  int without_fault = 0;
};

Comparison compare_with_estimator(const Estimator& estimator, const std::string& integrator) {
  const SimulatedSpring joint(estimator, {.integrator = integrator});
  Estimator alone = estimator_with_zero(estimator);
  Comparison found;
  for (int tick = 0; tick < 3000; ++tick) {
    const auto angles = joint.step(driving_torque(joint.data()->time));
    const Estimate expected = alone.step(angles);
    const Estimate estimate = joint.springs.estimate(*joint.data(), 0);
    EXPECT_EQ(estimate.fault, expected.fault) << tick;
    found.largest_Nm = std::max(found.largest_Nm, std::abs(estimate.value - expected.value));
    if (integrator != "RK4")  // after it the forces are those of the last of its four evaluations
      found.largest_Nm =
          std::max(found.largest_Nm, std::abs(joint.data()->actuator_force[0] - expected.value));
    found.range_Nm = std::max(found.range_Nm, std::abs(expected.value));
    found.without_fault += expected.fault == Fault::none ? 1 : 0;
  }
  return found;
}

template <class Family>
void expect_the_estimator(const char* family) {
  for (const char* integrator : {"Euler", "RK4", "implicit"}) {
    SCOPED_TRACE(std::string(family) + ", " + integrator);
    const Comparison found = compare_with_estimator(simulated_estimator<Family>(), integrator);
    EXPECT_LT(found.largest_Nm, 1e-9);
    EXPECT_GT(found.range_Nm, 0.1);
    EXPECT_GT(found.without_fault, 1000);
  }
}

TEST(MujocoSprings, HaveTheTorqueOfTheEstimatorOnTheLoggedAngles) {
  expect_the_estimator<GreyBox>("grey_box");
  expect_the_estimator<MaxwellSlipModel>("maxwell_slip");
  expect_the_estimator<Viscoelastic>("viscoelastic");
  expect_the_estimator<Lstm>("lstm");
  expect_the_estimator<Gru>("gru");
}

TEST(MujocoSprings, TurnTheGearSideBackAndTheJointForward) {
  for (const char* gear : {"-1", "1", "2"}) {
    SCOPED_TRACE(gear);
    const SimulatedSpring joint(
        simulated_estimator<GreyBox>(),
        {.actuator =
             fmt::format(R"(gear="{}" gaintype="fixed" gainprm="0" biastype="user")", gear)});
    joint.data()->qpos[0] = 0.05;
    joint.springs.settle(*joint.data());
    mj_forward(joint.model(), joint.data());
    const double torque_Nm = joint.springs.estimate(*joint.data(), 0).value;
    EXPECT_GT(torque_Nm, 10.0);
    EXPECT_NEAR(joint.data()->qfrc_actuator[0], -torque_Nm, 1e-12);
    EXPECT_NEAR(joint.data()->qfrc_actuator[1], torque_Nm, 1e-12);
  }
}

/// The largest kinetic energy [J] in each half cycle of the deflection, in a free motion from a wound spring.
std::vector<double> energies_of_half_cycles(const SimulatedSpring& joint) {
  joint.data()->qpos[0] = 0.02;
  joint.springs.settle(*joint.data());
  std::vector<double> energies{0.0};
  double last_speed = 0.0;
  for (int step = 0; step < 2000; ++step) {
    (void)joint.step();
    const double speed = joint.data()->qvel[0] - joint.data()->qvel[1];
    if (speed * last_speed < 0.0) energies.push_back(0.0);
    energies.back() = std::max(energies.back(), 0.25 * speed * speed);
    last_speed = speed;
  }
  return energies;
}

/// A spring of 600 Nm/rad with inner friction, creep and friction of its rate, for speeds up to 10 rad/s.
Estimator estimator_of_decay() {
  GreyBox::Parameters parameters = example<GreyBox>().parameters();
  parameters.coefficients.values.values = {-72.0, 0.0,  72.0, 0.1,  0.1,  0.1,
                                           0.1,   20.0, 0.05, 0.05, 0.05, 0.05};
  EstimatorSettings settings = simulated_settings();
  settings.ranges = {.lowest = {-0.1, -10.0}, .highest = {0.1, 10.0}};
  return Estimator(settings, AnyModel(GreyBox(parameters)));
}

TEST(MujocoSprings, LoseEnergyInEachCycleOfAFreeMotion) {
  for (const char* integrator : {"Euler", "RK4"}) {
    SCOPED_TRACE(integrator);
    const SimulatedSpring joint(estimator_of_decay(), {.integrator = integrator});
    const std::vector<double> energies = energies_of_half_cycles(joint);
    ASSERT_GT(energies.size(), 10U);
    for (std::size_t i = 1; i < 10; ++i) EXPECT_LT(energies[i], 0.99 * energies[i - 1]) << i;
    EXPECT_EQ(joint.springs.estimate(*joint.data(), 0).fault, Fault::none);
  }
}

/// slope times its only input
AnyModel linear_model(double slope) {
  Linear::Parameters parameters;
  parameters.coefficients.values = Matrix(1, 2);
  parameters.coefficients.values.values = {0.0, slope};
  return AnyModel(Linear(parameters));
}

/// Total energy after two seconds over that at the beginning, of a linear spring without friction or rate.
double kept_energy(const SpringXml& xml) {
  EstimatorSettings settings = simulated_settings();
  settings.features.inputs = {"gear_angle_rad - joint_angle_rad"};
  settings.ranges.lowest = {-1.0};
  settings.ranges.highest = {1.0};
  settings.fallback = {.intercept = 0.0, .slope = {600.0}, .residual_std = 1.0};
  const SimulatedSpring joint(Estimator(settings, linear_model(600.0)), xml);
  joint.data()->qpos[0] = 0.02;
  const auto energy = [&] {
    const double deflection = joint.data()->qpos[0] - joint.data()->qpos[1];
    const mjtNum* const speed = joint.data()->qvel;
    return 300.0 * deflection * deflection + 0.5 * (speed[0] * speed[0] + speed[1] * speed[1]);
  };
  const double begin = energy();
  double mean = 0.0;
  const int steps = static_cast<int>(2.0 / xml.timestep_s);
  for (int step = 0; step < steps; ++step) {
    (void)joint.step();
    if (step >= steps - 200) mean += energy() / 200.0;
  }
  return mean / begin;
}

TEST(MujocoSprings, NeitherGainNorLoseEnergyOfALinearSpring) {
  EXPECT_NEAR(kept_energy({.integrator = "Euler"}), 1.0, 0.02);
  EXPECT_NEAR(kept_energy({.integrator = "RK4"}), 1.0, 1e-4);
  // Four steps per tick.
  EXPECT_NEAR(kept_energy({.integrator = "Euler", .timestep_s = 0.00025}), 1.0, 0.005);
  EXPECT_NEAR(kept_energy({.integrator = "RK4", .timestep_s = 0.00025}), 1.0, 1e-4);
}

TEST(MujocoSprings, TickOnceInSeveralSteps) {
  const Estimator estimator = simulated_estimator<GreyBox>();
  const SimulatedSpring joint(estimator, {.timestep_s = 0.00025});
  Estimator alone = estimator_with_zero(estimator);
  for (int step = 0; step < 8000; ++step) {
    const auto angles = joint.step(driving_torque(joint.data()->time));
    if (step % 4 != 0) continue;
    const Estimate expected = alone.step(angles);
    const Estimate found = joint.springs.estimate(*joint.data(), 0);
    ASSERT_NEAR(found.value, expected.value, 1e-9) << step;
    ASSERT_EQ(found.fault, expected.fault) << step;
  }
}

TEST(MujocoSprings, ContinueInACopyWithTheSameBits) {
  for (const char* integrator : {"Euler", "RK4"}) {
    SCOPED_TRACE(integrator);
    const SimulatedSpring joint(simulated_estimator<Lstm>(), {.integrator = integrator});
    for (int tick = 0; tick < 300; ++tick) (void)joint.step(driving_torque(joint.data()->time));
    mjData* const branch = mj_copyData(nullptr, joint.model(), joint.data());
    const auto end_of = [&](mjData* data) {
      for (int tick = 0; tick < 500; ++tick)
        (void)SimulatedSpring::step(joint.springs, joint.model(), data, driving_torque(data->time));
      return numbers_of(joint, data);
    };
    const std::vector<double> first = end_of(joint.data());
    EXPECT_EQ(end_of(branch), first);
    mj_deleteData(branch);
  }
}

TEST(MujocoSprings, AreNotChangedByRepeatedEvaluations) {
  const Estimator estimator = simulated_estimator<GreyBox>();
  const SimulatedSpring once(estimator);
  const SimulatedSpring often(estimator);
  for (int tick = 0; tick < 1000; ++tick) {
    (void)once.step(driving_torque(once.data()->time));
    mj_forward(often.model(), often.data());
    mj_forward(often.model(), often.data());
    often.data()->qfrc_applied[0] = driving_torque(often.data()->time);
    often.data()->qfrc_applied[2] = -0.5 * driving_torque(often.data()->time);
    mj_step(often.model(), often.data());
    mj_forward(often.model(),
               often.data());  // also before the commit, with the time of the next tick
    often.springs.commit(*often.data());
    often.springs.commit(*often.data());
    ASSERT_EQ(numbers_of(once, once.data()), numbers_of(often, often.data())) << tick;
  }
}

TEST(MujocoSprings, StartAgainWithTheDataReset) {
  const SimulatedSpring joint(simulated_estimator<GreyBox>());
  const auto run = [&] {
    for (int tick = 0; tick < 400; ++tick) (void)joint.step(driving_torque(joint.data()->time));
    return numbers_of(joint, joint.data());
  };
  const std::vector<double> first = run();
  mj_resetData(joint.model(), joint.data());
  EXPECT_EQ(run(), first);
}

TEST(MujocoSprings, BeginSettledOnRequest) {
  const SimulatedSpring joint(simulated_estimator<Lstm>());
  (void)joint.step();
  EXPECT_EQ(joint.springs.estimate(*joint.data(), 0).fault, Fault::warming_up);
  mj_resetData(joint.model(), joint.data());
  joint.springs.settle(*joint.data());
  for (int tick = 0; tick < 10; ++tick) {
    (void)joint.step();
    EXPECT_EQ(joint.springs.estimate(*joint.data(), 0).fault, Fault::none);
    EXPECT_EQ(joint.springs.estimate(*joint.data(), 1).fault, Fault::none);
  }
}

TEST(MujocoSprings, ReportAStepThatWasNotCommitted) {
  const SimulatedSpring joint(simulated_estimator<GreyBox>());
  joint.springs.settle(*joint.data());
  for (int tick = 0; tick < 4; ++tick) mj_step(joint.model(), joint.data());
  EXPECT_EQ(joint.springs.estimate(*joint.data(), 0).fault, Fault::wrong_rate);
  // The ticks without a commit are a gap, after which the model is in use again.
  joint.springs.commit(*joint.data());
  for (int tick = 0; tick < 500; ++tick) (void)joint.step();
  EXPECT_EQ(joint.springs.estimate(*joint.data(), 0).fault, Fault::none);
}

TEST(MujocoSprings, ReportFaultsWithFiniteTorques) {
  const SimulatedSpring joint(simulated_estimator<GreyBox>());
  joint.springs.settle(*joint.data());
  (void)joint.step();
  EXPECT_TRUE(std::isfinite(joint.springs.estimate(*joint.data(), 0).std_dev));
  joint.data()->qpos[0] = 3.0;
  mj_forward(joint.model(), joint.data());
  EXPECT_EQ(joint.springs.estimate(*joint.data(), 0).fault, Fault::outside_training_range);
  EXPECT_TRUE(std::isfinite(joint.data()->actuator_force[0]));
  joint.data()->qpos[0] = std::nan("");
  mj_fwdPosition(joint.model(), joint.data());
  mj_fwdActuation(joint.model(), joint.data());
  EXPECT_EQ(joint.springs.estimate(*joint.data(), 0).fault, Fault::input_not_finite);
  EXPECT_TRUE(std::isfinite(joint.data()->actuator_force[0]));
}

TEST(MujocoSprings, OfOtherModelsAndCopiesOfAModelAreApart) {
  const Estimator grey_box = simulated_estimator<GreyBox>();
  const SimulatedSpring alone(grey_box);
  const SimulatedSpring joint(grey_box);
  const SimulatedSpring other(simulated_estimator<MaxwellSlipModel>());
  mjModel* const copy = mj_copyModel(nullptr, joint.model());
  mjData* const copy_data = mj_makeData(copy);
  for (int tick = 0; tick < 300; ++tick) {
    const double torque_Nm = driving_torque(alone.data()->time);
    (void)alone.step(torque_Nm);
    (void)other.step(torque_Nm);
    (void)joint.step(torque_Nm);
    (void)SimulatedSpring::step(joint.springs, copy, copy_data, torque_Nm);
  }
  EXPECT_EQ(numbers_of(joint, joint.data()), numbers_of(alone, alone.data()));
  EXPECT_EQ(numbers_of(joint, copy_data), numbers_of(alone, alone.data()));
  EXPECT_NE(numbers_of(other, other.data()), numbers_of(alone, alone.data()));
  mj_deleteData(copy_data);
  mj_deleteModel(copy);
}

TEST(MujocoSprings, OfThreadsThatShareAModelAreThoseOfOne) {
  const Estimator estimator = simulated_estimator<Lstm>();
  for (const std::size_t copies : {std::size_t{1}, std::size_t{4}}) {
    const SimulatedSpring joint(estimator, {}, {.threads = copies});
    const auto end_of = [&](double scale) {
      mjData* const data = mj_makeData(joint.model());
      for (int tick = 0; tick < 500; ++tick)
        (void)SimulatedSpring::step(joint.springs, joint.model(), data,
                                    scale * driving_torque(data->time));
      const std::vector<double> numbers = numbers_of(joint, data);
      mj_deleteData(data);
      return numbers;
    };
    std::vector<std::vector<double>> expected;
    for (int i = 0; i < 4; ++i) expected.push_back(end_of(0.5 + 0.1 * i));
    std::vector<std::vector<double>> found(4);
    std::vector<std::thread> threads;
    for (int i = 0; i < 4; ++i)
      threads.emplace_back([&, i] { found[static_cast<std::size_t>(i)] = end_of(0.5 + 0.1 * i); });
    for (std::thread& each : threads) each.join();
    EXPECT_EQ(found, expected);
  }
}

TEST(MujocoSprings, GiveNoTorqueWithoutTheirAdapter) {
  const MujocoModel mujoco(spring_xml());
  mujoco.data->qpos[0] = 0.05;
  {
    MujocoSprings first(*mujoco.model,
                        {{.actuator = "spring", .estimator = simulated_estimator<GreyBox>()}});
    MujocoSprings springs = std::move(first);
    mj_forward(mujoco.model.get(), mujoco.data.get());
    EXPECT_NE(mujoco.data->actuator_force[0], 0.0);
    EXPECT_EQ(mujoco.data->actuator_force[1], 0.0);  // an actuator of another user
  }
  mj_forward(mujoco.model.get(), mujoco.data.get());
  EXPECT_EQ(mujoco.data->actuator_force[0], 0.0);
}

mjtNum seventeen(const mjModel* /*model*/, const mjData* /*data*/, int /*actuator*/) {
  return 17.0;
}

TEST(MujocoSprings, LeaveOtherActuatorsToTheCallbackBefore) {
  const mjfAct of_torsio = mjcb_act_bias;
  mjcb_act_bias = seventeen;
  const MujocoModel mujoco(spring_xml());
  const MujocoSprings springs(
      *mujoco.model, {{.actuator = "spring", .estimator = simulated_estimator<GreyBox>()}});
  mj_forward(mujoco.model.get(), mujoco.data.get());
  EXPECT_NE(mujoco.data->actuator_force[0], 17.0);
  EXPECT_EQ(mujoco.data->actuator_force[1], 17.0);
  mjcb_act_bias = of_torsio;
}

std::string refusal_of_spring(const SpringXml& xml, const MujocoSpring& spring,
                              MujocoOptions options = {}) {
  const MujocoModel mujoco(spring_xml(xml));
  return error_message([&] { const MujocoSprings refused(*mujoco.model, {spring}, options); });
}

TEST(MujocoSprings, RefuseAnotherRate) {
  const MujocoSpring spring{.actuator = "spring", .estimator = simulated_estimator<GreyBox>()};
  const std::string message = refusal_of_spring({.timestep_s = 0.002}, spring);
  EXPECT_THAT(message, HasSubstr("a model at 500 Hz, 1 / timestep"));
  EXPECT_THAT(message, HasSubstr("a model at 1000 Hz with timestep=\"0.002\""));
  EXPECT_NE(refusal_of_spring({.timestep_s = 0.0007}, spring), "");
  EXPECT_EQ(refusal_of_spring({.timestep_s = 0.0005}, spring), "");
}

TEST(MujocoSprings, RefuseTooFewUserdata) {
  const std::vector<MujocoSpring> springs(
      1, {.actuator = "spring", .estimator = simulated_estimator<GreyBox>()});
  const std::size_t needed = MujocoSprings::userdata_size(springs);
  EXPECT_THAT(refusal_of_spring({.userdata = needed - 1}, springs[0]),
              HasSubstr(fmt::format("<size nuserdata=\"{}\"/>", needed)));
  EXPECT_EQ(refusal_of_spring({.userdata = needed}, springs[0]), "");
  EXPECT_THAT(refusal_of_spring({.userdata = needed}, springs[0], {.first_userdata = 1}),
              HasSubstr(fmt::format("<size nuserdata=\"{}\"/>", needed + 1)));
}

TEST(MujocoSprings, RefuseOtherActuators) {
  const MujocoSpring spring{.actuator = "spring", .estimator = simulated_estimator<GreyBox>()};
  MujocoSpring unknown = spring;
  unknown.actuator = "elbow";
  EXPECT_THAT(refusal_of_spring({}, unknown), HasSubstr("one of spring, b_spring, drive"));
  unknown.actuator = "drive";
  EXPECT_THAT(refusal_of_spring({}, unknown), HasSubstr("biastype=\"user\""));
  EXPECT_THAT(refusal_of_spring({.actuator = R"(gainprm="1" biastype="user")"}, spring),
              HasSubstr("gainprm=\"0\""));
  EXPECT_THAT(refusal_of_spring({.tendon = R"(stiffness="3")"}, spring),
              HasSubstr("stiffness=\"3\""));
  EXPECT_THAT(refusal_of_spring({.coefficients = R"("1" "-2")"}, spring),
              HasSubstr("coefficients 1 and -2"));
  EXPECT_THAT(refusal_of_spring({.joint_type = "slide"}, spring),
              HasSubstr("a hinge as the joint"));
  const MujocoModel mujoco(spring_xml());
  EXPECT_THAT(error_message([&] {
                const MujocoSprings twice(*mujoco.model, {spring, spring});
              }),
              HasSubstr("a second one"));
}

/// A linear model of these channels.
MujocoSpring spring_of(const std::string& input, const std::string& target = "torque_Nm") {
  EstimatorSettings settings = simulated_settings();
  settings.features = {.inputs = {input}, .definitions = {}};
  settings.zeroed_channels.clear();
  settings.target = target;
  settings.ranges.lowest = {-10.0};
  settings.ranges.highest = {10.0};
  settings.fallback.slope = {1.0};
  return {.actuator = "spring", .estimator = Estimator(settings, linear_model(2.0))};
}

TEST(MujocoSprings, RefuseChannelsThatMujocoDoesNotHave) {
  EXPECT_THAT(refusal_of_spring({}, spring_of("motor_current_A")),
              HasSubstr("the channel motor_current_A"));
  EXPECT_THAT(refusal_of_spring({}, spring_of("housing_temperature_K")),
              HasSubstr("the channel housing_temperature_K"));
  EXPECT_THAT(refusal_of_spring({}, spring_of("motor_angle_rad")),
              HasSubstr("MujocoSpring::gear_ratio"));
  EXPECT_THAT(refusal_of_spring({}, spring_of("gear_angle_rad", "joint_angle_rad")),
              HasSubstr("a torque in Nm"));
  MujocoSpring mapped = spring_of("motor_current_A");
  mapped.channels = {{.channel = "motor_current_A", .joint = "b_gear"}};
  EXPECT_THAT(refusal_of_spring({}, mapped), HasSubstr("in rad or rad_s"));
  mapped = spring_of("third_angle_rad");
  mapped.channels = {{.channel = "third_angle_rad", .joint = "b_ger"}};
  EXPECT_THAT(refusal_of_spring({}, mapped), HasSubstr("gear, joint, b_gear, b_joint"));
}

TEST(MujocoSprings, ReadAnglesAndSpeedsOfHinges) {
  const auto torque_of = [](MujocoSpring spring) {
    const MujocoModel mujoco(spring_xml());
    const MujocoSprings springs(*mujoco.model, {std::move(spring)});
    const std::array angles{0.3, 0.2, 0.7, 0.0};
    const std::array speeds{1.5, -0.5, 0.25, 0.0};
    std::ranges::copy(angles, mujoco.data->qpos);
    std::ranges::copy(speeds, mujoco.data->qvel);
    springs.settle(*mujoco.data);
    mj_forward(mujoco.model.get(), mujoco.data.get());
    return springs.estimate(*mujoco.data, 0).value;
  };
  EXPECT_NEAR(torque_of(spring_of("gear_angle_rad")), 0.6, 1e-12);
  EXPECT_NEAR(torque_of(spring_of("joint_angle_rad")), 0.4, 1e-12);
  EXPECT_NEAR(torque_of(spring_of("spring_deflection_rad")), 0.2, 1e-12);
  EXPECT_NEAR(torque_of(spring_of("gear_speed_rad_s")), 3.0, 1e-12);
  EXPECT_NEAR(torque_of(spring_of("joint_speed_rad_s")), -1.0, 1e-12);
  EXPECT_NEAR(torque_of(spring_of("spring_deflection_rate_rad_s")), 4.0, 1e-12);
  MujocoSpring motor = spring_of("motor_angle_rad");
  motor.gear_ratio = 10.0;
  EXPECT_NEAR(torque_of(motor), 6.0, 1e-12);
  motor = spring_of("motor_speed_rad_s");
  motor.gear_ratio = -2.0;
  EXPECT_NEAR(torque_of(motor), -6.0, 1e-12);
  MujocoSpring mapped = spring_of("third_angle_rad");
  mapped.channels = {{.channel = "third_angle_rad", .joint = "b_gear", .factor = 3.0}};
  EXPECT_NEAR(torque_of(mapped), 4.2, 1e-12);
  mapped = spring_of("third_speed_rad_s");
  mapped.channels = {{.channel = "third_speed_rad_s", .joint = "b_gear"}};
  EXPECT_NEAR(torque_of(mapped), 0.5, 1e-12);
}

}  // namespace
}  // namespace torsio::test

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <limits>
#include <utility>
#include <vector>

#include "sim/arm/arm_bench.hpp"
#include "support/allocation_counter.hpp"
#include "support/monitored_joint.hpp"
#include "torsio/arm/flange_wrench.hpp"
#include "torsio/sim/arm/arm_run.hpp"

namespace torsio {
namespace {

/// Joints 1 to 3 have monitors, joints 4 and 5 estimators, joint 6 its linear spring.
ArmController controller() {
  ArmController::Settings settings = arm_controller_settings(
      arm6_setup(), CartesianImpedance::Settings{.stiffness = {800, 800, 800, 40, 40, 40}});
  settings.contacts.emplace();
  settings.contacts->joints.assign(
      settings.joints.size(), {.error = {.coefficients = {0.01, 0.1, 0.001, 0.01}}, .factor = 4.0});
  for (std::size_t j = 0; j < 3; ++j)
    settings.joints[j].monitored.emplace(test::torque_sources(test::joint_sources()),
                                         test::joint_redundancy(), test::tolerant_monitor());
  for (std::size_t j = 3; j < 5; ++j)
    settings.joints[j].estimator.emplace(
        test::proportional_source("gear_angle_rad - joint_angle_rad", 320.0));
  return {std::move(settings), kBenchRate_Hz};
}

TEST(ArmController, NeverUsesTheHeapInAnyMode) {
  const ArmSetup setup = arm6_setup();
  const std::vector<double> start_rad = arm6_program().start_rad;
  ArmBench bench(setup, FirstStageForm::rigid, {}, 1, start_rad);
  ArmController arm = controller();
  std::vector<ArmBench::Command> commands(setup.joints.size());
  ArmReference reference;
  std::ranges::copy(start_rad, reference.position_rad.begin());
  reference.flange = arm.dynamics().flange(start_rad);
  reference.stiffness_Nm_rad.fill(50.0);
  reference.damping_Nms_rad.fill(5.0);
  bool is_released = false;
  bool is_stopped = false;
  std::size_t calls = 0;
  for (const ArmMode mode : {ArmMode::position, ArmMode::guiding, ArmMode::cartesian,
                             ArmMode::impedance, ArmMode::joints, ArmMode::position}) {
    reference.mode = mode;
    bool is_ready = false;
    for (int n = 0; n < 900; ++n) {
      bench.sense();
      std::vector<JointSample> samples(bench.samples().begin(), bench.samples().end());
      if (mode == ArmMode::joints && n == 500)
        samples[1].joint_angle_rad = std::numeric_limits<double>::quiet_NaN();
      const ArmController::Output* output = nullptr;
      calls += test::heap_calls_during([&] {
        output = &arm.step(reference, samples);
        if (!is_released) is_released = arm.release();
        if (mode == ArmMode::joints && n == 600) arm.stop(StopCategory::ramp_and_brake);
        arm.set_payload(setup.arm.payload);
      });
      for (std::size_t j = 0; j < commands.size(); ++j)
        commands[j] = {output->joints[j].current_A, output->joints[j].is_powered,
                       output->joints[j].is_brake_open};
      bench.act(commands, {});
      is_ready = is_ready || output->is_ready;
    }
    EXPECT_EQ(is_ready, !is_stopped) << name(mode);
    is_stopped = is_stopped || mode == ArmMode::joints;
  }
  EXPECT_TRUE(is_released);
  EXPECT_EQ(calls, 0U);
}

TEST(ArmController, NeverUsesTheHeapInAReaction) {
  const ArmSetup setup = arm6_setup();
  const std::vector<double> start_rad = arm6_program().start_rad;
  ArmBench bench(setup, FirstStageForm::rigid, {}, 1, start_rad);
  ArmController arm = controller();
  std::vector<ArmBench::Command> commands(setup.joints.size());
  ArmReference reference;
  std::ranges::copy(start_rad, reference.position_rad.begin());
  bool is_released = false;
  std::size_t calls = 0;
  std::size_t reactions = 0;
  for (int n = 0; n < 12'000; ++n) {
    bench.sense();
    const std::vector<JointSample> samples(bench.samples().begin(), bench.samples().end());
    const ArmController::Output* output = nullptr;
    calls += test::heap_calls_during([&] {
      if (n % 3000 == 1000)
        arm.set_reaction(std::array{ContactReaction::hold, ContactReaction::retract,
                                    ContactReaction::floating,
                                    ContactReaction::stop}[static_cast<std::size_t>(n / 3000)]);
      if (n % 3000 == 2900) arm.end_reaction();
      output = &arm.step(reference, samples);
      if (!is_released) is_released = arm.release();
      (void)flange_wrench(arm.dynamics(), start_rad, start_rad, start_rad);
    });
    if (output->contact.reaction != ContactReaction::none) ++reactions;
    for (std::size_t j = 0; j < commands.size(); ++j)
      commands[j] = {output->joints[j].current_A, output->joints[j].is_powered,
                     output->joints[j].is_brake_open};
    ArmLoad load;
    if (n % 3000 > 2000 && n % 3000 < 2200) load.force_N = {0.0, 0.0, 80.0};
    bench.act(commands, load);
  }
  EXPECT_TRUE(is_released);
  EXPECT_GT(reactions, 1000U);
  EXPECT_EQ(calls, 0U);
}

}  // namespace
}  // namespace torsio

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <utility>
#include <vector>

#include "rows.hpp"
#include "sim/arm/arm_bench.hpp"
#include "support/monitored_joint.hpp"
#include "torsio/core/error.hpp"
#include "torsio/fit/common/inputs.hpp"
#include "torsio/fit/train_model.hpp"
#include "torsio/sim/arm/arm_run.hpp"

namespace torsio::bench {
namespace {

constexpr double kRate_Hz = 1000.0;
constexpr std::size_t kTicks = 12'000;
constexpr double kGearStiffness_Nm_rad = 5e4;

/// One model for each joint, trained on the moves of the arm.
std::vector<ModelFile> models_of_joints(const char* family) {
  const ArmRun run = run_arm(arm6_setup(), {.program = arm6_program(), .has_gear_stage = false});
  std::vector<ModelFile> models;
  for (const Recording& joint : run.joints) {
    Dataset dataset;
    dataset.records.push_back({.recording = joint, .segments = {{0, joint.size(), Role::train}}});
    models.push_back(
        train_model(dataset, {.family = family, .features = resolve_inputs(dataset, {})}, 1).file);
  }
  return models;
}

/// Motor current and gear deflection beside the model of the spring. The gear of the simulated joint is rigid, and the
/// current is also that of friction: both have wide error bars.
MonitoredTorque monitored(const ModelFile& model, const Drive& drive) {
  constexpr double kCurrentStd_Nm = 100.0;
  constexpr double kGearStd_Nm = 1e4;
  std::vector<Estimator> sources;
  sources.push_back(test::proportional_source("motor_current_A", drive.torque_per_current(),
                                              kRate_Hz, "torque_Nm", kCurrentStd_Nm));
  sources.push_back(
      test::proportional_source(fmt::format("motor_angle_rad / {} - gear_angle_rad", drive.ratio),
                                kGearStiffness_Nm_rad, kRate_Hz, "torque_Nm", kGearStd_Nm));
  sources.push_back(make_estimator(model, kRate_Hz));
  return {test::torque_sources(std::move(sources)), test::joint_redundancy(),
          test::tolerant_monitor()};
}

ArmController controller(const std::vector<ModelFile>& models, bool is_monitored) {
  ArmController::Settings settings = arm_controller_settings(
      arm6_setup(), CartesianImpedance::Settings{.stiffness = {800, 800, 800, 40, 40, 40}});
  for (std::size_t j = 0; j < models.size(); ++j) {
    ArmController::Joint& joint = settings.joints[j];
    joint.inverse = AnyInverse::of(models[j].settings, models[j].parameters);
    if (is_monitored)
      joint.monitored.emplace(monitored(models[j], joint.control.torque.deflection.joint.drive));
    else
      joint.estimator.emplace(make_estimator(models[j], kRate_Hz));
  }
  return {std::move(settings), kRate_Hz};
}

struct Tick {
  std::vector<JointSample> samples;
  ArmReference reference = {};
  bool is_release = false;
};

/// What the controller gets while the arm holds, is moved by hand and follows a Cartesian impedance.
std::vector<Tick> ticks_of_a_run(const std::vector<ModelFile>& models) {
  const ArmSetup setup = arm6_setup();
  const std::vector<double> start_rad = arm6_program().start_rad;
  ArmBench bench(setup, FirstStageForm::rigid, {}, 1, start_rad);
  ArmController arm = controller(models, true);
  std::vector<ArmBench::Command> commands(setup.joints.size());
  std::vector<Tick> ticks;
  bool is_released = false;
  for (std::size_t n = 0; n < kTicks; ++n) {
    bench.sense();
    Tick tick{.samples = {bench.samples().begin(), bench.samples().end()}};
    std::ranges::copy(start_rad, tick.reference.position_rad.begin());
    tick.reference.mode = n < 4000   ? ArmMode::position
                          : n < 8000 ? ArmMode::guiding
                                     : ArmMode::cartesian;
    tick.reference.flange = arm.dynamics().flange(start_rad);
    const auto& output = arm.step(tick.reference, tick.samples);
    for (std::size_t j = 0; j < commands.size(); ++j)
      commands[j] = {output.joints[j].current_A, output.joints[j].is_powered,
                     output.joints[j].is_brake_open};
    if (!is_released) tick.is_release = is_released = arm.release();
    bench.act(commands, {});
    ticks.push_back(std::move(tick));
    if (n + 1 == kTicks && !output.is_ready)
      throw Error({.place = "bench of the arm's controller", .problem = "the arm was stopped"});
  }
  return ticks;
}

/// A share of the ticks takes at most this [us].
double quantile_us(const char* family, bool is_monitored, double share) {
  const std::vector<ModelFile> models = models_of_joints(family);
  const std::vector<Tick> ticks = ticks_of_a_run(models);
  ArmController arm = controller(models, is_monitored);
  std::vector<double> times_us;
  times_us.reserve(ticks.size());
  using Clock = std::chrono::steady_clock;
  for (const Tick& tick : ticks) {
    const auto begin = Clock::now();
    arm.step(tick.reference, tick.samples);
    times_us.push_back(std::chrono::duration<double, std::micro>(Clock::now() - begin).count());
    if (tick.is_release) static_cast<void>(arm.release());
  }
  const auto at = times_us.begin() +
                  static_cast<std::ptrdiff_t>(share * static_cast<double>(times_us.size() - 1));
  std::ranges::nth_element(times_us, at);
  return *at;
}

}  // namespace

/// Six cascades with inverse models, six monitors of three sources of which one is a grey box, dynamics and observer: the
/// median tick.
Row arm_control_step() { return {.value = quantile_us("grey_box", true, 0.5), .unit = "us"}; }
/// The same in the slowest of a thousand ticks.
Row arm_control_step_p999() {
  return {.value = quantile_us("grey_box", true, 0.999), .unit = "us"};
}
Row arm_control_step_dgmm() { return {.value = quantile_us("dgmm", true, 0.5), .unit = "us"}; }
/// Grey boxes as estimators and inverses, without monitors.
Row arm_control_step_unmonitored() {
  return {.value = quantile_us("grey_box", false, 0.5), .unit = "us"};
}

}  // namespace torsio::bench

#include "arm_identification.hpp"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <utility>

#include "arm_springs.hpp"
#include "numerics/shared_progress.hpp"
#include "torsio/core/error.hpp"
#include "torsio/data/dataset.hpp"
#include "torsio/estimate/torque_estimator.hpp"
#include "torsio/evaluate/estimate_recording.hpp"

namespace torsio {
namespace {

constexpr std::size_t kSettledSamples = 500;
constexpr double kBenchedPayload_kg = 8.0;
constexpr double kCycleRate_Hz = 1000.0;
constexpr double kCycle_s = 8.0;
constexpr double kCycleShare = 2.2;
constexpr int kCycles = 3;

std::vector<double> after_settling(const std::vector<double>& values) {
  return {values.begin() + kSettledSamples, values.end()};
}

std::vector<double> estimated(const ArmRun& run, std::size_t joint, const ModelFile& model) {
  const EstimatedRecording of = estimate_recording(make_estimator(model), run.joints[joint]);
  return of.channels.channel(estimate_channel("torque_Nm")).values;
}

}  // namespace

ModelFile spring_model(std::string_view family, std::vector<Recording> recordings,
                       std::uint64_t seed) {
  Dataset dataset;
  dataset.records.reserve(recordings.size());
  for (Recording& recording : recordings) {
    const std::size_t samples = recording.size();
    dataset.records.push_back({std::move(recording), whole_record(samples, Role::train)});
  }
  return spring_model(family, dataset, seed);
}

BenchedArm benched_arm(std::size_t number, std::uint64_t seed, const Progress& progress) {
  BenchedArm arm{.setup = arm_of_specimens(number, kBenchedPayload_kg)};
  arm.linear = bench_models(arm.setup, "linear", seed, share_of(progress, 0.0, 0.5));
  arm.learned = bench_models(arm.setup, "grey_box", seed, share_of(progress, 0.5, 1.0));
  return arm;
}

ArmRun excited_run(const ArmSetup& setup, ExcitationGoal goal, std::size_t moves,
                   std::uint64_t seed) {
  const ExcitingProgram planned =
      exciting_program(setup, {.goal = goal, .moves = moves, .seed = seed});
  ArmRun run = run_arm(setup, {.program = planned.program, .seed = seed, .with_truth = true});
  if (run.cause != ArmStopCause::none)
    throw Error({.place = setup.arm.name,
                 .problem = fmt::format("stopped at {:.2f} s in {}: {}", run.stopped_s,
                                        run.stopped_joint, name(run.cause))});
  return run;
}

ArmMotion motion_of_models(const ArmRun& run, const std::vector<ModelFile>& models) {
  ArmMotion motion{.name = run.record.name(), .sample_rate_Hz = run.record.sample_rate_Hz()};
  for (std::size_t j = 0; j < models.size(); ++j) {
    motion.angle_rad.push_back(after_settling(run.joints[j].channel("joint_angle_rad").values));
    motion.torque_Nm.push_back(after_settling(estimated(run, j, models[j])));
  }
  return motion;
}

double rmse_of_model(const ArmRun& run, std::size_t joint, const ModelFile& model) {
  const std::vector<double> values = estimated(run, joint, model);
  const std::vector<double>& truth = run.joints[joint].channel("truth_torque_Nm").values;
  double squares = 0.0;
  for (std::size_t n = kSettledSamples; n < values.size(); ++n)
    squares += (values[n] - truth[n]) * (values[n] - truth[n]);
  return std::sqrt(squares / static_cast<double>(values.size() - kSettledSamples));
}

ArmModel with_link_errors(ArmModel arm, Random& random, double share_std, double com_std_m) {
  for (ArmJoint& joint : arm.joints) {
    const double share = 1.0 + share_std * random.normal();
    joint.body.mass_kg *= share;
    for (double& moment : joint.body.inertia_kg_m2) moment *= share;
    for (double& com_m : joint.body.com_m) com_m += com_std_m * random.normal();
  }
  return arm;
}

double cycle_stiffness(const ModelFile& model, double linear_Nm_rad, double torque_Nm) {
  TorqueEstimator estimator(make_estimator(model, kCycleRate_Hz));
  const double amplitude_rad = kCycleShare * torque_Nm / linear_Nm_rad;
  const auto period = static_cast<std::size_t>(kCycle_s * kCycleRate_Hz);
  std::array<double, 2> passed_rad{kNotMeasured, kNotMeasured};  // rising, falling
  double last_Nm = 0.0;
  for (std::size_t n = 0; n < kCycles * period; ++n) {
    const double phase = static_cast<double>(n % period) / static_cast<double>(period);
    const double way = phase < 0.25   ? 4.0 * phase
                       : phase < 0.75 ? 2.0 - 4.0 * phase
                                      : 4.0 * phase - 4.0;
    const double deflection_rad = amplitude_rad * way;
    const double now_Nm = estimator
                              .step({.motor_angle_rad = 0.0,
                                     .gear_angle_rad = deflection_rad,
                                     .joint_angle_rad = 0.0,
                                     .motor_current_A = 0.0})
                              .value;
    if (last_Nm < torque_Nm && now_Nm >= torque_Nm) passed_rad[0] = deflection_rad;
    if (last_Nm >= torque_Nm && now_Nm < torque_Nm) passed_rad[1] = deflection_rad;
    last_Nm = now_Nm;
  }
  return 2.0 * torque_Nm / (passed_rad[0] + passed_rad[1]);
}

}  // namespace torsio

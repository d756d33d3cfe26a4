#include "arm_springs.hpp"

#include <fmt/format.h>

#include <array>
#include <string>
#include <utility>

#include "core/report_progress.hpp"
#include "sim/experiments/torque_references.hpp"
#include "sim/sensors/sensor_set.hpp"
#include "torsio/actuator/data_sheet.hpp"
#include "torsio/control/model_inverse.hpp"
#include "torsio/estimate/torque_estimator.hpp"
#include "torsio/fit/common/inputs.hpp"
#include "torsio/fit/train_model.hpp"
#include "torsio/sim/experiments/experiment.hpp"

namespace torsio {
namespace {

constexpr double kBench_s = 50.0;  // each recording
constexpr std::size_t kSerials = 99;
// Torques over the rating: weight of the lever, amplitude of the chirp, root mean square of the noise.
constexpr double kLeverShare = 0.5;
constexpr double kChirpShare = 0.8;
constexpr double kNoiseShare = 0.3;
constexpr double kFaintShare = 0.04;

Dataset bench_recordings(const std::string& actuator, std::uint64_t seed) {
  const DataSheet sheet = data_sheet(actuator);
  const double rated_Nm = sheet.rating.torque_Nm.value;
  // A sweep moves the joint: in a locked one every motion would be a jump of an encoder.
  const std::array specs{
      ExperimentSpec{.experiment = "sweep", .lever_m = lever_m(sheet, kLeverShare)},
      ExperimentSpec{.experiment = "chirp", .torque_amplitude_Nm = kChirpShare * rated_Nm},
      ExperimentSpec{.experiment = "random-walk", .torque_amplitude_Nm = kNoiseShare * rated_Nm},
      ExperimentSpec{.experiment = "random-walk", .torque_amplitude_Nm = kFaintShare * rated_Nm}};
  Dataset dataset;
  for (std::size_t k = 0; k < specs.size(); ++k) {
    ExperimentSpec spec = specs[k];
    spec.actuator = actuator;
    spec.seed = seed + k;
    spec.duration_s = kBench_s;
    Recording recording = simulate(spec);
    const std::size_t samples = recording.size();
    dataset.records.push_back({std::move(recording), whole_record(samples, Role::train)});
  }
  return dataset;
}

}  // namespace

ArmSetup arm_of_specimens(std::size_t arm, double payload_kg) {
  ArmSetup setup = arm6_setup();
  BodyInertia& payload = setup.arm.payload;
  const double scale = payload_kg / payload.mass_kg;
  payload.mass_kg = payload_kg;
  for (double& moment : payload.inertia_kg_m2) moment *= scale;
  const std::size_t count = setup.joints.size();
  for (std::size_t j = 0; j < count; ++j) {
    DataSheet& sheet = setup.joints[j].sheet;
    sheet = data_sheet(fmt::format("{}#{:02}", sheet.name, 1 + (arm * count + j) % kSerials));
  }
  return setup;
}

ModelFile spring_model(std::string_view family, const Dataset& dataset, std::uint64_t seed) {
  const std::vector<std::string> inputs{"spring_deflection_rad",
                                        "lowpass(spring_deflection_rate_rad_s, 10Hz)"};
  return train_model(dataset,
                     {.family = std::string(family), .features = resolve_inputs(dataset, inputs)},
                     seed)
      .file;
}

std::vector<ModelFile> bench_models(const ArmSetup& setup, std::string_view family,
                                    std::uint64_t seed, const Progress& progress) {
  std::vector<ModelFile> models;
  models.reserve(setup.joints.size());
  for (std::size_t j = 0; j < setup.joints.size(); ++j) {
    report_progress(progress, static_cast<double>(j) / static_cast<double>(setup.joints.size()),
                    fmt::format("the spring of joint {}", j + 1));
    const Dataset dataset = bench_recordings(full_name(setup.joints[j].sheet), seed + 10 * j);
    models.push_back(spring_model(family, dataset, seed));
  }
  return models;
}

ArmController::Settings settings_with(const ArmSetup& setup, const std::vector<ModelFile>& models) {
  ArmSetup nominal = arm6_setup();
  nominal.arm = setup.arm;
  ArmController::Settings settings = arm_controller_settings(nominal);
  for (std::size_t j = 0; j < settings.joints.size(); ++j) {
    ArmController::Joint& joint = settings.joints[j];
    joint.estimator.emplace(make_estimator(models[j], kBenchRate_Hz));
    joint.inverse = AnyInverse::of(models[j].settings, models[j].parameters);
  }
  return settings;
}

}  // namespace torsio

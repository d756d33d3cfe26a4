#pragma once

#include <cstddef>
#include <cstdint>
#include <string_view>
#include <vector>

#include "torsio/arm/arm_controller.hpp"
#include "torsio/core/progress.hpp"
#include "torsio/data/dataset.hpp"
#include "torsio/files/model_file.hpp"
#include "torsio/sim/arm/arm_setup.hpp"

namespace torsio {

/// `arm6_setup` of actuators with manufacturing tolerances, each with a serial number of its own.
/// @param arm which of the arms, from 0
/// @param payload_kg the payload of `arm6_setup` scaled to this mass
[[nodiscard]] ArmSetup arm_of_specimens(std::size_t arm, double payload_kg);

/// A model of a joint's torque with its deflection and the rate of it as inputs.
/// @param dataset recordings with a channel torque_Nm
[[nodiscard]] ModelFile spring_model(std::string_view family, const Dataset& dataset,
                                     std::uint64_t seed);

/// A model of the torque of each joint of that arm, fitted to recordings of its actuators on a bench with a load cell:
/// sweeps with a light and a heavy lever, a chirp and noise of up to the rated torque.
/// @param family linear or grey_box
[[nodiscard]] std::vector<ModelFile> bench_models(const ArmSetup& setup, std::string_view family,
                                                  std::uint64_t seed, const Progress& progress);

/// The controller with these models in place of the linear springs of the data sheets, as of models that the arm's file
/// names.
[[nodiscard]] ArmController::Settings settings_with(const ArmSetup& setup,
                                                    const std::vector<ModelFile>& models);

}  // namespace torsio

#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "torsio/arm/arm_model.hpp"
#include "torsio/core/progress.hpp"
#include "torsio/core/random.hpp"
#include "torsio/files/model_file.hpp"
#include "torsio/identify/exciting_program.hpp"
#include "torsio/identify/identification.hpp"
#include "torsio/sim/arm/arm_run.hpp"
#include "torsio/sim/arm/arm_setup.hpp"

namespace torsio {

/// The arm of paper 000 with specimens of its actuators, and models of their springs from the bench of each.
struct BenchedArm {
  ArmSetup setup;
  std::vector<ModelFile> linear = {};
  std::vector<ModelFile> learned = {};  ///< `grey_box`
};

/// @param number chooses the specimens, as of `arm_of_specimens`
[[nodiscard]] BenchedArm benched_arm(std::size_t number, std::uint64_t seed,
                                     const Progress& progress);

/// A model of this family with the inputs of `bench_models`. @param recordings with a channel torque_Nm
[[nodiscard]] ModelFile spring_model(std::string_view family, std::vector<Recording> recordings,
                                     std::uint64_t seed);

/// The arm moves through a program of `exciting_program`. @throws Error if it stops.
[[nodiscard]] ArmRun excited_run(const ArmSetup& setup, ExcitationGoal goal, std::size_t moves,
                                 std::uint64_t seed);

/// The motion of a run with the torques of these models, from 0.5 s on, when their filters have settled.
[[nodiscard]] ArmMotion motion_of_models(const ArmRun& run, const std::vector<ModelFile>& models);

/// RMSE of a model in a run from 0.5 s on, to the true torque on the link [Nm].
[[nodiscard]] double rmse_of_model(const ArmRun& run, std::size_t joint, const ModelFile& model);

/// Mass and inertia of each link differ by this share, and each coordinate of its centre by this distance: one standard
/// deviation.
[[nodiscard]] ArmModel with_link_errors(ArmModel arm, Random& random, double share_std,
                                        double com_std_m);

/// The stiffness of a model at a torque [Nm/rad]: torque over the mean of the deflections at which a slow cycle to
/// 2.2 times this torque passes it, under rising and falling load. NaN if it does not reach it.
[[nodiscard]] double cycle_stiffness(const ModelFile& model, double linear_Nm_rad,
                                     double torque_Nm);

}  // namespace torsio

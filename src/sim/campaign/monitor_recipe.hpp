#pragma once

#include <cstddef>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "torsio/actuator/data_sheet.hpp"
#include "torsio/core/progress.hpp"
#include "torsio/data/dataset.hpp"
#include "torsio/estimate/torque_sources.hpp"
#include "torsio/evaluate/monitor_calibration.hpp"
#include "torsio/files/model_file.hpp"
#include "torsio/signal/feature_pipeline.hpp"

namespace torsio {

/// How one estimate of an actuator's torque is made.
struct SourceRecipe {
  TorqueSource source;
  std::string family;
  std::map<std::string, std::string> options;
  FeatureSpec features;
  /// The name of a gear's twist among the definitions, and the angle of its input. The kinematic
  /// error over that angle is fitted first and added to the twist, so that its hysteresis is one of
  /// the twist that makes torque.
  std::string gear_twist = {};
  std::string gear_input = {};
  /// The number of a drive's last inputs, which are its friction; 0: none is separated.
  std::size_t friction_inputs = 0;
};

/// A fitted source, with its friction as a model of its own where the recipe separates it.
struct FittedSource {
  ModelFile torque;
  std::optional<ModelFile> friction;

  [[nodiscard]] SourceModel model() const;
};

/// The estimates of an actuator's torque that its sensors permit, and the signals to watch.
///
/// - current: N k_t i on the motor side, minus inertia and friction (presliding, load-dependent,
///   viscous) of what is between motor and load;
/// - gear: the twist of the gear's stiffness with its hysteresis, damping and kinematic error;
/// - spring: a learned model of the deflection (`grey_box`).
///
/// All have the same delay: every input passes a 100 Hz low-pass and the sample that two
/// differences cost. Each then estimates the torque on the load side of the elastic element.
struct MonitorRecipe {
  std::vector<SourceRecipe> sources;
  MonitorPlan plan;
};
[[nodiscard]] MonitorRecipe monitor_recipe(const DataSheet& sheet);

/// The same recording with the delay of the sources in `torque_Nm` and, where it has it,
/// `truth_torque_Nm`. Models that are trained on a torque without it compensate the delay with
/// rates of their inputs, each in its own way, and disagree while the torque changes fast.
[[nodiscard]] Recording with_source_delay(const Recording& recording);

/// @param dataset the torque of a load cell, in records with the role train; records with the role
/// validation give the error bar
/// @throws Error as `train_model`
[[nodiscard]] FittedSource fit_source(const SourceRecipe& recipe, const Dataset& dataset,
                                      const Progress& progress = {});

}  // namespace torsio

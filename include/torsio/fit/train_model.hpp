#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "torsio/core/progress.hpp"
#include "torsio/data/dataset.hpp"
#include "torsio/files/model_file.hpp"
#include "torsio/fit/common/family_info.hpp"
#include "torsio/fit/common/fit_context.hpp"
#include "torsio/fit/common/training_data.hpp"
#include "torsio/signal/feature_pipeline.hpp"

namespace torsio {

/// One model to train: a family, its settings, and the inputs it is given.
struct ModelChoice {
  std::string family;
  std::map<std::string, std::string> options = {};  ///< as in `--set name=value`
  std::string input_set = {};  ///< name of the dataset's input set, for tables; may be empty
  FeatureSpec features;        ///< from `resolve_inputs`

  /// "branch=true,schedule=support_m": the settings that differ from the defaults, as the user gave
  /// them.
  [[nodiscard]] std::string variant() const;
};

/// A fitted model with all that it needs to run (`make_estimator(file)`) and to be saved.
struct TrainedModel {
  ModelFile file;
  std::vector<std::string> notes;  ///< messages about the fit for the user
  std::vector<FittedParameter> table = {};
  double fit_seconds = 0.0;
  std::vector<TrainingEpoch> history = {};  ///< epochs of networks; after a resume only the rest
};

/// Recording -> features -> fitted model -> guards: the function of `torsio fit`. Only records with
/// the role train are used for training; guards take their error bars from the validation records,
/// if there are any. Deterministic for a seed.
/// @throws Error if the data are not sufficient or the training records disagree about which
/// channels are zeroed, UsageError for a wrong setting, Cancelled if `progress` asks to
/// stop.
[[nodiscard]] TrainedModel train_model(const Dataset& dataset, const ModelChoice& choice,
                                       std::uint64_t seed, const Progress& progress = {});

/// The training data of the models with one input set: the dataset after the feature pipeline.
struct LearningData {
  TrainingData training;
  std::optional<TrainingData> validation = {};  ///< if any record has that role
  std::optional<TrainingData> test = {};        ///< not used for a fit; for reports, if at hand

  /// Null if there are none.
  [[nodiscard]] const TrainingData* of(Role role) const noexcept;
};
/// The data of the roles training and validation.
/// @throws Error as `training_data`, if the training records disagree about which channels are
/// zeroed, if the target or every input is constant, or if values are too large to be squared.
[[nodiscard]] LearningData learning_data(const Dataset& dataset, const FeatureSpec& features);

/// `train_model` for several models that share their inputs.
/// @param data `learning_data(dataset, choice.features)`.
[[nodiscard]] TrainedModel train_model(const Dataset& dataset, const LearningData& data,
                                       const ModelChoice& choice, std::uint64_t seed,
                                       const Progress& progress = {});

/// `train_model` for a fit that can be stopped and resumed. The validation records of the dataset
/// are used for the context, unless it has its own.
/// @throws UsageError also if there is something to resume and the family keeps no checkpoints.
[[nodiscard]] TrainedModel train_model(const Dataset& dataset, const ModelChoice& choice,
                                       const FitContext& context);
[[nodiscard]] TrainedModel train_model(const Dataset& dataset, const LearningData& data,
                                       const ModelChoice& choice, const FitContext& context);

}  // namespace torsio

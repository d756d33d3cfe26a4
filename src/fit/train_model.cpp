#include "torsio/fit/train_model.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <iterator>
#include <set>
#include <string>
#include <utility>

#include "fit/common/guards.hpp"
#include "fit/common/held_out.hpp"
#include "fit/common/training_rules.hpp"
#include "numerics/reversals.hpp"
#include "torsio/core/error.hpp"
#include "torsio/fit/common/load_target.hpp"
#include "torsio/fit/common/options.hpp"
#include "torsio/fit/common/training_data.hpp"
#include "torsio/fit/families.hpp"

namespace torsio {
namespace {

/// The mapping that all training records were read with; none if they differ.
std::string training_mapping(const Dataset& dataset, std::vector<std::string>& notes) {
  std::set<std::string> mappings;
  for (const DatasetRecord& record : dataset.records)
    if (record.has_role(Role::train)) mappings.insert(record.recording.mapping);
  if (mappings.size() == 1) return *mappings.begin();
  notes.emplace_back(
      "the training recordings were read with different mappings, so the model file contains "
      "none: give --mapping with later recordings");
  return {};
}

void note_left_out(const TrainingData& data, std::vector<std::string>& notes) {
  for (const std::string& recording : unused_recordings(data))
    notes.push_back(recording + ": not used, for no sample of it can be used");
  for (const LeftOut& left_out : data.left_out)
    notes.push_back("not used, for it is far outside all other values of its channel: " +
                    left_out.text());
}

ModelCard card_for(const Dataset& dataset, const ModelChoice& choice, const Options& options,
                   std::uint64_t seed) {
  ModelCard card;
  card.fitted_as = choice.family;
  card.options = options.values();
  card.seed = seed;
  card.zeros = training_zeros(dataset);
  card.load_target = dataset.load_target;
  add_training_files(card, dataset);
  return card;
}

/// An inverse's target is compared with the measured deflection, and its estimator does not receive
/// these zeros.
void refuse_zeros_after_an_inverse(const TrainingData& data, const FeaturePipeline& pipeline,
                                   const std::vector<ZeroRule>& zeros) {
  if (data.target != "spring_deflection_rad" ||
      std::ranges::find(pipeline.raw_inputs(), "torque_Nm") == pipeline.raw_inputs().end())
    return;
  for (const ZeroRule& zero : zeros)
    if (zero.channel == "gear_angle_rad" || zero.channel == "joint_angle_rad" ||
        zero.channel == data.target)
      throw Error(
          {.place = data.target,
           .expected = "a target as it is measured, of an inverse that takes torque_Nm",
           .found = fmt::format("a zero: rule for {}", zero.channel),
           .advice = "Remove the rule, or train a model of the torque, which can be inverted."});
}

}  // namespace

std::string ModelChoice::variant() const {
  std::string text;
  for (const auto& [option, value] : options)
    text += fmt::format("{}{}={}", text.empty() ? "" : ",", option, value);
  return text;
}

const TrainingData* LearningData::of(Role role) const noexcept {
  if (role == Role::train) return &training;
  const std::optional<TrainingData>& held_out = role == Role::test ? test : validation;
  return held_out ? &*held_out : nullptr;
}

LearningData learning_data(const Dataset& dataset, const FeatureSpec& features) {
  (void)training_zeros(dataset);
  LearningData data{.training = training_data(dataset, features)};
  require_trainable(data.training);
  if (dataset.has_role(Role::validation))
    data.validation = training_data(dataset, features, Role::validation);
  return data;
}

namespace {

void refuse_wrong_choice(const ModelChoice& choice, const FitContext& context) {
  const FamilyInfo& family = find_family(choice.family);
  (void)Options(family.options, choice.options);
  if (context.resume != nullptr && !family.can_resume)
    throw UsageError(
        {.place = "--resume",
         .problem = choice.family + " is fitted within seconds and keeps no checkpoint",
         .advice = "Leave --resume away."});
}

/// Where what was held out is explained no better than by a constant.
void note_unexplained(const std::string& target, const HeldOutErrors& held_out,
                      std::vector<std::string>& notes) {
  if (!(held_out.rmse > held_out.constant_rmse)) return;
  notes.push_back(
      fmt::format("warning: the inputs do not determine {}: fitted to two thirds of each "
                  "recording, the model has "
                  "an RMSE of {:.4g} in the rest, and a constant one of {:.4g} in all",
                  target, held_out.rmse, held_out.constant_rmse));
}

/// Files of the training records, or recordings that are in memory only.
std::size_t recordings_of(const Dataset& dataset) {
  std::set<std::string> names;
  for (const DatasetRecord& record : dataset.records)
    if (record.has_role(Role::train))
      names.insert(record.recording.source.file.empty() ? record.recording.name()
                                                        : record.recording.source.file);
  return names.size();
}

/// What is known of the error in other recordings. Recordings, or fifths of one, that were held out one after the other
/// are better evidence than the ends of recordings, which contain another part of the motion; and few strokes have no
/// end that resembles the rest.
HeldOutErrors evidence_of(const FittedModel& fitted, const HeldOutErrors& held_out,
                          const TrainingData& training, std::size_t recordings,
                          std::size_t reversals) {
  const bool has_records = fitted.held_out_records >= kSeveralRecords;
  const bool has_better = reversals < kFewReversals || has_records || fitted.has_held_out_fifths;
  HeldOutErrors evidence{.rmse = has_better && std::isfinite(fitted.held_out_rmse)
                                     ? fitted.held_out_rmse
                                     : std::fmax(fitted.held_out_rmse, held_out.rmse),
                         .error_bar_factor = held_out.error_bar_factor,
                         .own_std_dev = held_out.own_std_dev,
                         .stroke_growth = fitted.stroke_growth,
                         .factor = other_recordings_factor(recordings, reversals)};
  if (reversals == 0) evidence.least_std_dev = target_std_dev(training);
  return evidence;
}

/// @param factor of the error bars where reversals are few; 1: they are those of a validation recording
std::string note_of_reversals(const TrainingData& training, std::size_t reversals, double factor) {
  std::string note = fmt::format(
      "warning: {} reverses fewer than {} times: how well the model repeats is not known",
      training.inputs.front().expression, kFewReversals);
  if (reversals == 0)
    note += ", and the error bars are the standard deviation of " + training.target;
  else if (factor != 1.0)
    note += fmt::format(
        ", and the error bars are {:g} times the held-out error, as public recordings of few "
        "strokes need",
        factor);
  return note;
}

/// Where few recordings are the reason for wider error bars.
std::string note_of_recordings(std::size_t recordings, double factor) {
  return fmt::format(
      "the error bars are {:g} times as wide as the training shows: {} not determine how "
      "much other recordings differ, and public ones of other days or loads need this factor; "
      "with three recordings or with --validation the error bars follow from them",
      factor, recordings == 1 ? "one recording does" : "two recordings do");
}

TrainedModel train(const Dataset& dataset, const LearningData& data, const ModelChoice& choice,
                   FitContext context) {
  const FamilyInfo& family = find_family(choice.family);
  const Options options(family.options, choice.options);
  ModelCard card = card_for(dataset, choice, options, context.seed);
  std::vector<std::string> notes;
  card.mapping = training_mapping(dataset, notes);
  if (dataset.load_target.is_used())
    std::ranges::move(load_target_notes(dataset.load_target), std::back_inserter(notes));
  std::ranges::move(uncertainty_notes(dataset), std::back_inserter(notes));
  note_left_out(data.training, notes);
  if (data.validation) note_left_out(*data.validation, notes);
  const FeaturePipeline pipeline(choice.features, data.training.sample_rate_Hz);
  refuse_zeros_after_an_inverse(data.training, pipeline, card.zeros);
  if (context.validation == nullptr && data.validation) context.validation = &*data.validation;

  if (family.is_spring && !family.takes_levels) require_motion(data.training);

  const auto start = std::chrono::steady_clock::now();
  std::vector<TrainingEpoch> history;
  FitContext recorded = context;
  recorded.note_epoch = [&](const TrainingEpoch& epoch) { history.push_back(epoch); };
  FittedModel fitted = family.fit(data.training, options, recorded);
  const std::chrono::duration<double> fit_time = std::chrono::steady_clock::now() - start;

  const HeldOutErrors held_out =
      family.can_resume || context.validation != nullptr
          ? HeldOutErrors{.rmse = fitted.held_out_rmse}
          : held_out_errors(data.training, [&](const TrainingData& rest) {
              FitContext again = context;
              again.progress = [&](double, std::string_view) {
                return !context.progress ||
                       context.progress(1.0, "fitting without what is held out");
              };
              return family.fit(rest, options, again);
            });
  const bool is_spring = fitted.model.traits().is_spring;
  const std::size_t reversals = is_spring ? reversals_of(data.training) : kFewReversals;
  const std::size_t recordings = recordings_of(dataset);
  const HeldOutErrors evidence =
      evidence_of(fitted, held_out, data.training, recordings, reversals);
  EstimatorSettings settings =
      guarded_settings(choice.features, data.training, fitted.model,
                       data.validation ? &*data.validation : nullptr, evidence);
  settings.target_uncertainty = training_uncertainty(dataset);
  const bool has_memory =
      !fitted.model.memory({settings.ranges.lowest, settings.ranges.highest}).is_empty();
  if (family.is_spring && has_memory && !held_out.has_return)
    refuse_motion_without_return(data.training);
  note_unexplained(data.training.target, held_out, notes);
  const double factor = data.validation ? 1.0 : evidence.factor;
  if (reversals < kFewReversals) {
    notes.push_back(note_of_reversals(data.training, reversals, factor));
  } else if (factor != 1.0) {
    notes.push_back(note_of_recordings(recordings, factor));
  }
  TrainedModel trained{.file = {.card = std::move(card),
                                .settings = std::move(settings),
                                .parameters = fitted.model.parameters()},
                       .notes = std::move(fitted.notes),
                       .table = std::move(fitted.table),
                       .fit_seconds = fit_time.count(),
                       .history = std::move(history)};
  trained.notes.insert(trained.notes.begin(), notes.begin(), notes.end());
  for (const ZeroRule& zero : trained.file.card.zeros)
    if (std::ranges::find(pipeline.raw_inputs(), zero.channel) != pipeline.raw_inputs().end())
      trained.file.settings.zeroed_channels.push_back(zero.channel);
  return trained;
}

}  // namespace

TrainedModel train_model(const Dataset& dataset, const LearningData& data,
                         const ModelChoice& choice, std::uint64_t seed, const Progress& progress) {
  return train(dataset, data, choice, {.seed = seed, .progress = progress});
}

TrainedModel train_model(const Dataset& dataset, const ModelChoice& choice, std::uint64_t seed,
                         const Progress& progress) {
  return train_model(dataset, choice, {.seed = seed, .progress = progress});
}

TrainedModel train_model(const Dataset& dataset, const ModelChoice& choice,
                         const FitContext& context) {
  refuse_wrong_choice(choice, context);  // before the data are run through the filters
  return train(dataset, learning_data(dataset, choice.features), choice, context);
}

TrainedModel train_model(const Dataset& dataset, const LearningData& data,
                         const ModelChoice& choice, const FitContext& context) {
  refuse_wrong_choice(choice, context);
  return train(dataset, data, choice, context);
}

}  // namespace torsio

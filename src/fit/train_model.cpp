#include "torsio/fit/train_model.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <chrono>
#include <set>
#include <utility>

#include "fit/common/guards.hpp"
#include "fit/common/usable_table.hpp"
#include "torsio/core/error.hpp"
#include "torsio/fit/common/options.hpp"
#include "torsio/fit/common/training_data.hpp"
#include "torsio/fit/families.hpp"

namespace torsio {
namespace {

std::set<std::string> zeroed_channels(const Recording& recording) {
  std::set<std::string> channels;
  for (const ZeroRule& zero : recording.zeros) channels.insert(zero.channel);
  return channels;
}

/// The zeros of the training records: a model expects a channel zeroed or not, never both.
std::vector<ZeroRule> training_zeros(const Dataset& dataset) {
  const Recording* first = nullptr;
  for (const DatasetRecord& record : dataset.records) {
    if (!record.has_role(Role::train)) continue;
    if (first == nullptr) first = &record.recording;
    const auto expected = zeroed_channels(*first);
    const auto found = zeroed_channels(record.recording);
    if (found == expected) continue;
    const auto list = [](const std::set<std::string>& channels) {
      return channels.empty() ? std::string("none") : fmt::format("{}", fmt::join(channels, ", "));
    };
    throw Error({.place = record.recording.name() + ": zero",
                 .problem = "the training recordings disagree about which channels are zeroed",
                 .expected = list(expected) + ", as in " + first->name(),
                 .found = list(found),
                 .advice = "Give all of them the same zero: rules."});
  }
  return first == nullptr ? std::vector<ZeroRule>{} : first->zeros;
}

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
  for (const DatasetRecord& record : dataset.records) {
    if (!record.has_role(Role::train)) continue;
    Source source = record.recording.source;
    if (source.file.empty()) source.file = record.recording.name();  // made in memory
    if (std::ranges::find(card.training_files, source) == card.training_files.end())
      card.training_files.push_back(std::move(source));
  }
  return card;
}

/// Nothing can be learned from a target that never changes, and every score of it would be 0 / 0.
void refuse_constant_target(const TrainingData& data) {
  const std::vector<double> target = usable_table(data).target;
  const auto [lowest, highest] = std::ranges::minmax(target);
  if (lowest < highest) return;
  throw Error({.place = data.target,
               .expected = "a target that changes",
               .found = fmt::format("{} in every training sample", lowest),
               .advice = "Is the sensor connected? torsio check reports details."});
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

LearningData learning_data(const Dataset& dataset, const FeatureSpec& features) {
  LearningData data{.training = training_data(dataset, features), .validation = {}};
  refuse_constant_target(data.training);
  if (dataset.has_role(Role::validation))
    data.validation = training_data(dataset, features, Role::validation);
  return data;
}

namespace {

TrainedModel train(const Dataset& dataset, const LearningData& data, const ModelChoice& choice,
                   FitContext context) {
  const FamilyInfo& family = find_family(choice.family);
  const Options options(family.options, choice.options);
  ModelCard card = card_for(dataset, choice, options, context.seed);
  std::vector<std::string> notes;
  card.mapping = training_mapping(dataset, notes);
  note_left_out(data.training, notes);
  if (data.validation) note_left_out(*data.validation, notes);
  const FeaturePipeline pipeline(choice.features, data.training.sample_rate_Hz);
  refuse_zeros_after_an_inverse(data.training, pipeline, card.zeros);
  if (context.validation == nullptr && data.validation) context.validation = &*data.validation;

  const auto start = std::chrono::steady_clock::now();
  FittedModel fitted = family.fit(data.training, options, context);
  const std::chrono::duration<double> fit_time = std::chrono::steady_clock::now() - start;

  TrainedModel trained{
      .file = {.card = std::move(card),
               .settings = guarded_settings(choice.features, data.training, fitted.model,
                                            data.validation ? &*data.validation : nullptr,
                                            fitted.held_out_rmse),
               .parameters = fitted.model.parameters()},
      .notes = std::move(fitted.notes),
      .table = std::move(fitted.table),
      .fit_seconds = fit_time.count()};
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
  // A wrong setting or records that disagree are reported before the data are run through the
  // filters.
  const FamilyInfo& family = find_family(choice.family);
  (void)Options(family.options, choice.options);
  (void)training_zeros(dataset);
  if (context.resume != nullptr && !family.can_resume)
    throw UsageError(
        {.place = "--resume",
         .problem = choice.family + " is fitted within seconds and keeps no checkpoint",
         .advice = "Leave --resume away."});
  return train(dataset, learning_data(dataset, choice.features), choice, context);
}

}  // namespace torsio

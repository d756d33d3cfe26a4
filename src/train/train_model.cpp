#include "torsio/train/train_model.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <optional>
#include <utility>

#include "torsio/train/families.hpp"
#include "torsio/train/guards.hpp"
#include "torsio/train/options.hpp"
#include "torsio/train/training_data.hpp"

namespace torsio {
namespace {

ModelCard card_for(const Dataset& dataset, const ModelChoice& choice, const Options& options,
                   std::uint64_t seed) {
  ModelCard card;
  card.fitted_as = choice.family;
  card.options = options.values();
  card.seed = seed;
  card.zeros = dataset.records.front().recording.zeros;
  for (const DatasetRecord& record : dataset.records) {
    bool is_trained_on = false;
    for (const Segment& segment : record.segments) is_trained_on |= segment.role == Role::train;
    const bool is_listed = std::ranges::find(card.training_files, record.recording.source) !=
                           card.training_files.end();
    if (is_trained_on && !is_listed) card.training_files.push_back(record.recording.source);
  }
  return card;
}

}  // namespace

std::string ModelChoice::variant() const {
  std::string text;
  for (const auto& [option, value] : options)
    text += fmt::format("{}{}={}", text.empty() ? "" : ",", option, value);
  return text;
}

TrainedModel train_model(const Dataset& dataset, const ModelChoice& choice, std::uint64_t seed,
                         const Progress& progress) {
  const FamilyInfo& family = find_family(choice.family);
  const Options options(family.options, choice.options);
  const TrainingData data = training_data(dataset, choice.features);
  std::optional<TrainingData> validation;
  if (dataset.has_role(Role::validation))
    validation = training_data(dataset, choice.features, Role::validation);

  const auto start = std::chrono::steady_clock::now();
  FittedModel fitted = family.fit(data, options, seed, progress);
  const std::chrono::duration<double> fit_time = std::chrono::steady_clock::now() - start;

  TrainedModel trained{.file = {.card = card_for(dataset, choice, options, seed),
                                .settings = guarded_settings(choice.features, data, fitted.model,
                                                             validation ? &*validation : nullptr),
                                .parameters = fitted.model.parameters()},
                       .notes = std::move(fitted.notes),
                       .fit_seconds = fit_time.count()};
  const FeaturePipeline pipeline(choice.features, data.sample_rate_Hz);
  for (const ZeroRule& zero : trained.file.card.zeros)
    if (std::ranges::find(pipeline.raw_inputs(), zero.channel) != pipeline.raw_inputs().end())
      trained.file.settings.zeroed_channels.push_back(zero.channel);
  return trained;
}

}  // namespace torsio

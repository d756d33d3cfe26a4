#include "torsio/evaluate/adaptation.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/report_progress.hpp"
#include "data/recording_rows.hpp"
#include "evaluate/fit_and_score.hpp"
#include "fit/common/guards.hpp"
#include "fit/common/option_fields.hpp"
#include "fit/common/reference_check.hpp"
#include "fit/common/training_rules.hpp"
#include "numerics/metrics_accumulator.hpp"
#include "torsio/core/error.hpp"
#include "torsio/estimate/adaptive_estimator.hpp"
#include "torsio/evaluate/comparison.hpp"
#include "torsio/fit/common/training_data.hpp"

namespace torsio {
namespace {

constexpr std::size_t kReportEvery = 64;
/// Largest ratio of the held-out errors: those of recordings of one motion differ as much.
constexpr double kLargestLoss = 1.1;

/// Errors before each update.
struct AdaptationTally {
  MetricsAccumulator frozen;
  MetricsAccumulator adapted;

  [[nodiscard]] AdaptationScore score(std::string recording) const {
    return {std::move(recording), frozen.metrics(), adapted.metrics()};
  }
};

bool is_lesson(const DatasetRecord& record, std::size_t sample) {
  return std::ranges::any_of(record.segments, [sample](const Segment& segment) {
    return segment.role == Role::train && segment.begin <= sample && sample < segment.end;
  });
}

/// One record through the adaptive estimator.
class Replay {
 public:
  Replay(AdaptiveEstimator& adaptive, const DatasetRecord& record, const std::string& target)
      : adaptive_(adaptive),
        record_(record),
        target_(record.recording.channel(target)),
        rows_(record.recording, adaptive.raw_inputs()) {}

  /// @param frozen the estimates of the frozen model for the same recording.
  void run(const Prediction& frozen, AdaptationTally& own, AdaptationTally& together,
           const Progress& progress) {
    const std::size_t samples = record_.recording.size();
    const DenormalsOff denormals_off;
    adaptive_.reset();
    double age_s = kNotMeasured;
    for (std::size_t n = 0; n < samples; ++n) {
      if (n % kReportEvery == 0)
        report_progress(progress, static_cast<double>(n) / static_cast<double>(samples),
                        record_.recording.name());
      age_s = target_.is_fresh(n) ? 0.0 : age_s + 1.0 / record_.recording.sample_rate_Hz();
      const Estimate output = adaptive_.step(rows_.at(n));
      if (!is_lesson(record_, n)) continue;
      if (output.fault == Fault::none && target_.is_fresh(n))
        for (AdaptationTally* tally : {&own, &together}) {
          tally->adapted.add(output.value, target_.values[n]);
          tally->frozen.add(frozen.estimates[n].value, target_.values[n]);
        }
      (void)adaptive_.learn({.value = target_.values[n], .age_s = age_s});
    }
  }

 private:
  AdaptiveEstimator& adaptive_;
  const DatasetRecord& record_;
  const Channel& target_;
  RecordingRows rows_;
};

void require_role(const Dataset& dataset, Role role, const char* what, const char* advice) {
  if (dataset.has_role(role)) return;
  throw UsageError(
      {.problem = fmt::format("nothing to {}: no recording has the role {}", what, name(role)),
       .advice = advice});
}

[[noreturn]] void refuse_unusable(const AdaptationCounts& counts, const std::string& target) {
  std::string reasons;
  for (std::size_t i = 0; i < kUpdateOutcomes; ++i)
    if (counts.outcomes[i] > 0)
      reasons += fmt::format("{}{} {}", reasons.empty() ? "" : ", ", counts.outcomes[i],
                             name(static_cast<UpdateOutcome>(i)));
  throw Error(
      {.problem = "no sample could be used for the adaptation",
       .expected = fmt::format(
           "samples with a measured {} after the model has warmed up, inside its range", target),
       .found = reasons.empty() ? "none at all" : reasons,
       .advice = "Give longer recordings, or a model that was trained on such ones."});
}

/// A reference of another unit or sign, or of a sensor that does not measure, is refused as a whole: the
/// guards of the adaptation examine one sample at a time. What they pass over, a sensor that is stuck or at
/// its limit for a while, is left to them.
void require_plausible(const DatasetRecord& record, const std::string& target,
                       const Prediction& frozen) {
  const Channel& channel = record.recording.channel(target);
  std::vector<double> estimated;
  std::vector<double> measured;
  for (std::size_t n = 0; n < channel.values.size(); ++n) {
    if (!is_lesson(record, n) || !channel.is_fresh(n) || !std::isfinite(channel.values[n]) ||
        frozen.estimates[n].fault != Fault::none)
      continue;
    if (!measured.empty() && channel.values[n] == measured.back()) continue;
    estimated.push_back(frozen.estimates[n].value);
    measured.push_back(channel.values[n]);
  }
  require_plausible_reference(record.recording.name() + ": " + target, {estimated, measured});
}

/// Both models on what nothing was learned from: each recording, then all of them.
std::vector<AdaptationScore> held_out_scores(const SplitScore& frozen, const SplitScore& adapted) {
  std::vector<AdaptationScore> scores;
  for (std::size_t i = 0; i < frozen.recordings.size(); ++i)
    scores.push_back({frozen.recordings[i].recording, frozen.recordings[i].score.metrics,
                      adapted.recordings[i].score.metrics});
  scores.push_back({"", frozen.together.metrics, adapted.together.metrics});
  return scores;
}

/// Learning that makes the model worse is of no use, whatever the reason.
void refuse_worse(const AdaptationScore& held_out) {
  if (!(held_out.adapted.rmse > kLargestLoss * held_out.frozen.rmse)) return;
  throw Error({.problem = "on the held-out samples the adapted model is worse than the frozen one",
               .expected = fmt::format("an RMSE of at most {:.4g}", held_out.frozen.rmse),
               .found = fmt::format("{:.4g}", held_out.adapted.rmse),
               .advice =
                   "Check the reference of both. If it is right, try a smaller step_size (rls: "
                   "initial_covariance, em: more component_samples), or comparison_s as long as "
                   "a cycle."});
}

void note_adaptation(ModelCard& card, const AdaptationSettings& settings,
                     const AdaptationCounts& counts, const Dataset& dataset) {
  const auto note = [&](const std::string& key, auto value) {
    card.options["adaptation." + key] = fmt::format("{}", value);
  };
  note("method", name(settings.rule));
  note("updates", counts.updates());
  note("roll_backs", counts.roll_backs);
  note("largest_change", settings.largest_change);
  if (settings.rule != AdaptationRule::nlms) note("forgetting", settings.forgetting);
  if (settings.rule == AdaptationRule::em) note("component_samples", settings.component_samples);
  if (settings.rule == AdaptationRule::rls) note("initial_covariance", settings.initial_covariance);
  if (settings.rule == AdaptationRule::nlms) {
    note("step_size", settings.step_size);
    note("leak", settings.leak);
  }
  add_training_files(card, dataset);
}

}  // namespace

std::span<const OptionInfo> adaptation_options() { return options_of<AdaptationSettings>(); }

AdaptationSettings adaptation_settings(const std::string& method,
                                       const std::map<std::string, std::string>& given) {
  const auto* const rule = std::ranges::find(kAdaptationRules, method);
  if (rule == kAdaptationRules.end())
    throw UsageError({.place = "adaptation method",
                      .expected = "auto, nlms, rls or em",
                      .found = '"' + method + '"'});
  auto settings = filled<AdaptationSettings>(Options(adaptation_options(), given));
  settings.rule = static_cast<AdaptationRule>(rule - kAdaptationRules.begin());
  return settings;
}

AdaptedModel adapt_model(const ModelFile& model, const Dataset& dataset,
                         const AdaptationSettings& settings, const Progress& progress) {
  dataset.check();
  refuse_seen_test_records(dataset);
  const Estimator frozen = make_estimator(model, dataset.sample_rate_Hz());
  AdaptiveEstimator adaptive(frozen.settings(),
                             model.parameters.at_sample_period(1.0 / dataset.sample_rate_Hz()),
                             settings);
  require_role(dataset, Role::train, "adapt to", "Name recordings to adapt to.");
  require_role(dataset, Role::test, "score on", "Name held-out recordings with --test.");
  for (const std::string& channel : frozen.settings().zeroed_channels)
    adaptive.set_zero(channel, 0.0);  // a loaded recording had its own subtracted already
  const TrainingData lessons = training_data(dataset, model.settings.features, Role::train);
  require_trainable(lessons);
  AdaptedModel adapted{.file = model};
  AdaptationTally together;
  const std::size_t parts = dataset.records.size() + 2;
  for (std::size_t i = 0; i < dataset.records.size(); ++i) {
    const DatasetRecord& record = dataset.records[i];
    if (!record.has_role(Role::train)) continue;
    AdaptationTally own;
    const Prediction output = predict(frozen, record.recording);
    require_plausible(record, dataset.target, output);
    Replay(adaptive, record, dataset.target)
        .run(output, own, together, part_of(progress, i, parts, "adapting"));
    adapted.as_it_ran.push_back(own.score(record.recording.name()));
  }
  adapted.as_it_ran.push_back(together.score(""));
  adapted.counts = adaptive.adapter().counts();
  if (adapted.counts.updates() == 0) refuse_unusable(adapted.counts, dataset.target);
  adapted.relative_change = adaptive.adapter().relative_change();
  adapted.file.parameters =
      adaptive.adapted().at_sample_period(1.0 / model.settings.sample_rate_Hz);
  note_adaptation(adapted.file.card, adaptive.adapter().settings(), adapted.counts, dataset);

  const SplitScore before =
      evaluate(frozen, dataset, Role::test, part_of(progress, parts - 2, parts, "frozen"));
  const SplitScore after = evaluate(make_estimator(adapted.file, dataset.sample_rate_Hz()), dataset,
                                    Role::test, part_of(progress, parts - 1, parts, "adapted"));
  if (after.together.metrics.samples == 0)
    throw Error({.problem = "no held-out sample could be scored",
                 .advice = "Hold out more: --test recordings, or a larger --held-out share."});
  adapted.held_out = held_out_scores(before, after);
  refuse_worse(adapted.held_out.back());
  // Errors on what was learned are too small for an error bar, and where nothing was learned those of
  // the frozen model remain.
  ResidualTable residuals = residual_table(AnyModel(adapted.file.parameters), lessons);
  if (!residuals.std_dev.empty()) {
    widen_to(residuals, after.together.metrics.rmse);
    adapted.file.settings.residuals = larger_of(model.settings.residuals, residuals);
  }
  SensorUncertainty& uncertainty = adapted.file.settings.target_uncertainty;
  uncertainty = larger_of(uncertainty, training_uncertainty(dataset));
  note_held_out_scores(adapted.file.card, {{.family = {}, .score = after.together}});
  return adapted;
}

void hold_out_ends(Dataset& dataset, double share, double embargo_s) {
  if (!(share > 0.0 && share < 1.0))
    throw UsageError({.place = "--held-out",
                      .expected = "a share between 0 and 1",
                      .found = fmt::format("{}", share)});
  for (DatasetRecord& record : dataset.records) {
    const Recording& recording = record.recording;
    if (record.segments != whole_record(recording.size(), Role::train))
      throw UsageError(
          {.place = recording.name(),
           .problem = "its manifest gives it roles, but not the role test",
           .advice = "Give recordings the role test there, or name them with --test."});
    const auto embargo =
        static_cast<std::size_t>(std::llround(embargo_s * recording.sample_rate_Hz()));
    try {
      record.segments = contiguous_blocks(recording.size(), 1.0 - share, embargo);
    } catch (const Error& error) {
      ErrorReport report = error.report();
      report.place = recording.name();
      report.advice = "Give longer recordings, or separate ones with --test.";
      throw Error(std::move(report));
    }
  }
}

}  // namespace torsio

#include "torsio/evaluate/comparison.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <limits>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "evaluate/common_samples.hpp"
#include "evaluate/constant_offset.hpp"
#include "evaluate/fit_and_score.hpp"
#include "evaluate/left_ranges.hpp"
#include "evaluate/model_entry.hpp"
#include "evaluate/model_label.hpp"
#include "torsio/core/error.hpp"
#include "torsio/fit/common/inputs.hpp"
#include "torsio/fit/families.hpp"

namespace torsio {
namespace {

constexpr auto kRoles = std::to_array<Role>({Role::train, Role::validation, Role::test});

struct FamilyChoice {
  std::string family;
  std::map<std::string, std::string> options;
  bool operator==(const FamilyChoice&) const = default;
};

/// "polynomial:degree=7:branch=true" -> family and settings.
FamilyChoice parse_choice(std::string_view text) {
  FamilyChoice choice;
  std::size_t begin = 0;
  while (begin <= text.size()) {
    const std::size_t end = std::min(text.find(':', begin), text.size());
    const std::string_view part = text.substr(begin, end - begin);
    if (begin == 0) {
      choice.family = find_family(part).name;
    } else {
      const std::size_t equals = part.find('=');
      if (equals == std::string_view::npos)
        throw UsageError({.place = "--models",
                          .expected = "option=value after a colon",
                          .found = std::string(part)});
      choice.options.emplace(part.substr(0, equals), part.substr(equals + 1));
    }
    begin = end + 1;
  }
  (void)Options(find_family(choice.family).options,
                choice.options);  // refuses unknown settings before any work is done
  return choice;
}

/// A condition among the inputs that takes more than one value in training: parameters may be
/// interpolated over it.
std::string schedulable_condition(const Dataset& dataset, const std::vector<std::string>& inputs) {
  for (const std::string& input : inputs) {
    std::set<double> values;
    for (const DatasetRecord& record : dataset.records) {
      const auto& conditions = record.recording.conditions();
      if (std::ranges::find(conditions, input) == conditions.end()) continue;
      if (record.has_role(Role::train))
        values.insert(record.recording.channel(input).values.front());
    }
    if (values.size() > 1) return input;
  }
  return {};
}

bool is_on_by_default(const FamilyInfo& family, std::string_view option) {
  return std::ranges::any_of(family.options, [&](const OptionInfo& known) {
    return known.name == option && known.default_value == "true";
  });
}

/// Every family with its default settings, without its branches by direction, and scheduled over a
/// condition if the data have one.
std::vector<FamilyChoice> all_choices(const Dataset& dataset,
                                      const std::vector<std::string>& inputs) {
  const std::string condition = schedulable_condition(dataset, inputs);
  std::vector<FamilyChoice> choices;
  for (const FamilyInfo& family : families()) {
    if (family.only_if_named) continue;
    const std::string family_name(family.name);
    choices.push_back({family_name, {}});
    if (is_on_by_default(family, "branch")) choices.push_back({family_name, {{"branch", "false"}}});
    if (!condition.empty() && has_option(family, "schedule"))
      choices.push_back({family_name, {{"schedule", condition}}});
  }
  return choices;
}

const ResultRow* whole_split(const std::vector<ResultRow>& rows, Role role) {
  for (const ResultRow& row : rows)
    if (row.split == role && !row.recording && row.status == "ok") return &row;
  return nullptr;
}

/// The first of the ranking, with a card that states its scores; none without a ranking.
std::optional<TrainedModel> best_of(std::vector<ScoredModel>& models, Role chosen_on) {
  const auto error_of = [chosen_on](const ScoredModel& model) {
    const ResultRow* row = whole_split(model.rows, chosen_on);
    return row == nullptr || row->score.common.samples == 0
               ? std::numeric_limits<double>::infinity()
               : row->score.common.rmse;
  };
  const auto best = std::ranges::min_element(models, {}, error_of);
  if (best == models.end() || !std::isfinite(error_of(*best))) return std::nullopt;
  ModelCard& card = best->trained->file.card;
  note_held_out_scores(card, best->rows);
  if (chosen_on == Role::test)
    card.held_out += fmt::format("; this score selected the model among {}", models.size());
  return std::move(best->trained);
}

}  // namespace

void check_model_entry(std::string_view entry) { static_cast<void>(parse_choice(entry)); }

std::vector<ModelChoice> model_choices(const Dataset& dataset, std::string_view models,
                                       const std::vector<std::string>& wanted_inputs) {
  auto input_sets = dataset.input_sets;
  if (!wanted_inputs.empty() || input_sets.empty()) input_sets = {{"", wanted_inputs}};
  if (models.empty())
    throw UsageError({.place = "--models",
                      .expected = "all, or families separated by commas",
                      .found = "nothing"});
  std::vector<ModelChoice> choices;
  for (const auto& [set_name, inputs] : input_sets) {
    const FeatureSpec features = resolve_inputs(dataset, inputs);
    std::vector<FamilyChoice> wanted;
    for (const std::string& model : split_inputs(models)) {
      const auto meant = model == "all" ? all_choices(dataset, features.inputs)
                                        : std::vector<FamilyChoice>{parse_choice(model)};
      for (const FamilyChoice& choice : meant)
        if (std::ranges::find(wanted, choice) == wanted.end()) wanted.push_back(choice);
    }
    for (FamilyChoice& choice : wanted)
      choices.push_back({std::move(choice.family), std::move(choice.options), set_name, features});
  }
  return choices;
}

namespace {

/// The notes of the fits that are warnings, each with the models that have it.
std::vector<std::string> warnings_of(const std::vector<ScoredModel>& models) {
  constexpr std::string_view kWarning = "warning: ";
  std::vector<std::pair<std::string, std::string>> found;  // text, models
  for (const ScoredModel& model : models) {
    if (!model.trained) continue;
    for (const std::string& note : model.trained->notes) {
      if (!note.starts_with(kWarning)) continue;
      const std::string text = note.substr(kWarning.size());
      const std::string label = model_label(model.rows.front());
      const auto known =
          std::ranges::find(found, text, &std::pair<std::string, std::string>::first);
      if (known == found.end())
        found.emplace_back(text, label);
      else
        known->second += ", " + label;
    }
  }
  std::vector<std::string> warnings;
  warnings.reserve(found.size());
  for (const auto& [text, labels] : found) warnings.push_back(fmt::format("{}: {}", labels, text));
  return warnings;
}

}  // namespace

void require_test_recordings(const Dataset& dataset) {
  if (!dataset.has_role(Role::test))
    throw UsageError(
        {.problem = "nothing to compare on: no recording has the role test",
         .advice =
             "Name held-out recordings with --test, or give them `role: test` in a manifest."});
}

Comparison compare(const Dataset& dataset, const std::vector<ModelChoice>& choices,
                   std::uint64_t seed, bool allow_leak, const Progress& progress) {
  dataset.check();
  refuse_seen_test_records(dataset);
  require_test_recordings(dataset);
  Comparison comparison{.results = empty_results(dataset), .models = {}, .best = {}};
  Results& results = comparison.results;
  InputSets input_sets(dataset, allow_leak);
  std::vector<ScoredModel> models;
  for (std::size_t i = 0; i < choices.size(); ++i) {
    const ModelChoice& choice = choices[i];
    note_inputs(results, choice);
    const Progress part = part_of(progress, i, choices.size(), choice.family);
    models.push_back(fit_and_score(dataset, input_sets, choice, seed, kRoles, part));
  }
  forget_only_set(results);
  for (const Role role : {Role::validation, Role::test})
    if (dataset.has_role(role))
      results.rankings.push_back(rank_on_common_samples(dataset, role, models));
  for (const ScoredModel& model : models)
    if (model.trained)
      comparison.models.push_back({model.rows.front().family, model.rows.front().variant,
                                   model.rows.front().input_set, model.trained->file});
  comparison.best =
      best_of(models, dataset.has_role(Role::validation) ? Role::validation : Role::test);
  results.warnings = warnings_of(models);
  for (ScoredModel& model : models) std::ranges::move(model.rows, std::back_inserter(results.rows));
  return comparison;
}

namespace {

Results results_of(const ModelFile& file, const Dataset& dataset, const Estimator& estimator,
                   const std::vector<SplitScore>& scores) {
  Results results = empty_results(dataset);
  results.inputs = file.settings.features.inputs;
  for (std::size_t i = 0; i < kRoles.size(); ++i) {
    if (!dataset.has_role(kRoles[i])) continue;
    std::ranges::move(rows_of(file, kRoles[i], scores[i]), std::back_inserter(results.rows));
    if (kRoles[i] != Role::train)
      std::ranges::move(offset_warnings(estimator, dataset, kRoles[i], scores[i]),
                        std::back_inserter(results.warnings));
  }
  std::ranges::move(left_range_warnings(estimator.settings(), estimator.model(), dataset,
                                        !results.warnings.empty()),
                    std::back_inserter(results.warnings));
  return results;
}

}  // namespace

Results evaluate_model(const ModelFile& file, const Dataset& dataset,
                       const std::vector<ScoredRun>& runs) {
  std::vector<SplitScore> scores;
  for (const Role role : kRoles)
    scores.push_back(dataset.has_role(role) ? evaluate(runs, role) : SplitScore{});
  return results_of(file, dataset, make_estimator(file, dataset.sample_rate_Hz()), scores);
}

Results evaluate_model(const ModelFile& file, const Dataset& dataset, const Progress& progress) {
  dataset.check();
  const Estimator estimator = make_estimator(file, dataset.sample_rate_Hz());
  return results_of(file, dataset, estimator, evaluate(estimator, dataset, kRoles, progress));
}

void mark_divergence_in_training(std::vector<ResultRow>& rows) {
  const auto trained = std::ranges::find(rows, Role::train, &ResultRow::split);
  if (trained == rows.end()) return;
  constexpr double kTwiceTheStdDev = -100.0;  // fit %
  std::string reason;
  if (trained->status == "diverged") {
    reason = trained->reason;
  } else if (trained->score.metrics.fit_percent < kTwiceTheStdDev) {
    reason = fmt::format("the error is {:.3g} times the standard deviation of the target",
                         1.0 - 0.01 * trained->score.metrics.fit_percent);
  } else {
    return;
  }
  for (ResultRow& row : rows) {
    row.status = "diverged";
    row.reason = "on its own training data: " + reason;
  }
}

void note_held_out_scores(ModelCard& card, const std::vector<ResultRow>& rows) {
  for (const Role role : {Role::test, Role::validation}) {
    const ResultRow* row = whole_split(rows, role);
    if (row == nullptr) continue;
    const Metrics& metrics = row->score.metrics;
    card.held_out = fmt::format("{} {} samples, free run", metrics.samples, name(role));
    card.metrics = {{"rmse", metrics.rmse},
                    {"mad", metrics.mad},
                    {"std_abs", metrics.std_abs},
                    {"max_abs", metrics.max_abs},
                    {"fit_percent", metrics.fit_percent}};
    return;
  }
}

}  // namespace torsio

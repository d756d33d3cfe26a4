#include "torsio/search/structure_study.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <mutex>
#include <nlohmann/json.hpp>
#include <set>
#include <utility>

#include "evaluate/fold_scores.hpp"
#include "evaluate/model_label.hpp"
#include "evaluate/role_samples.hpp"
#include "search/scored_model_text.hpp"
#include "torsio/core/error.hpp"
#include "torsio/fit/families.hpp"
#include "torsio/search/workers.hpp"

namespace torsio {
namespace {

using Json = nlohmann::json;

/// Shares of the training samples in the halving steps; a full fit is the last step.
constexpr auto kEfforts = std::to_array<double>({0.25, 0.5});
constexpr int kLastStep = static_cast<int>(kEfforts.size());

/// The option that limits how long a family's fit searches. Where there is one, a halving step cuts
/// it and not the samples, so that the fit is of all motions of the recordings.
struct EffortOption {
  std::string_view family;
  std::string_view option;
};
constexpr auto kEffortOptions = std::to_array<EffortOption>({{"hammerstein_wiener", "iterations"},
                                                             {"mlp", "epochs"},
                                                             {"narx_parametric_gp", "updates"},
                                                             {"parametric_gp", "updates"}});

/// The name of that option; empty: the family has none.
std::string_view effort_option_of(std::string_view family) {
  const auto* const found = std::ranges::find(kEffortOptions, family, &EffortOption::family);
  return found == kEffortOptions.end() ? std::string_view() : found->option;
}

/// A candidate whose search is cut to a share.
ModelChoice with_effort(ModelChoice choice, double effort) {
  const std::string option(effort_option_of(choice.family));
  const auto& options = find_family(choice.family).options;
  const auto known = std::ranges::find(options, option, &OptionInfo::name);
  const auto given = choice.options.find(option);
  const std::string full =
      given == choice.options.end() ? std::string(known->default_value) : given->second;
  const double cut = std::max(1.0, std::round(effort * std::stod(full)));
  choice.options[option] = fmt::format("{:.0f}", cut);
  return choice;
}

/// What a trial fits: a candidate on a fold.
struct FitTask {
  std::size_t candidate = 0;
  std::size_t fold = 0;
};

FitTask task_of(const std::string& spec) {
  try {
    const Json json = Json::parse(spec);
    return {.candidate = json.at("candidate"), .fold = json.at("fold")};
  } catch (const Json::exception&) {
    throw Error({.place = "store", .problem = "a trial of this search cannot be read"});
  }
}

std::string label_of(const ModelChoice& choice) {
  return model_label(
      {.family = choice.family, .variant = choice.variant(), .input_set = choice.input_set});
}

/// A record whose training samples are cut to a share, in blocks that are spread over them: a part of
/// each of its motions, long enough for a model with memory. Each block is a record of its own, since
/// a model is run through all samples of a record. The samples of other roles stay as they are.
void add_share_of(const DatasetRecord& record, double share, std::vector<DatasetRecord>& records) {
  constexpr double kLeastBlock_s = 10.0;
  constexpr std::size_t kMaxBlocks = 4;
  const auto least =
      static_cast<std::size_t>(std::ceil(kLeastBlock_s * record.recording.sample_rate_Hz()));
  DatasetRecord others{.recording = record.recording, .segments = {}};
  for (const Segment& segment : record.segments) {
    if (segment.role != Role::train) {
      others.segments.push_back(segment);
      continue;
    }
    const std::size_t samples = segment.end - segment.begin;
    const auto kept = static_cast<std::size_t>(std::ceil(share * static_cast<double>(samples)));
    const std::size_t blocks = std::clamp<std::size_t>(kept / least, 1, kMaxBlocks);
    for (std::size_t b = 0; b < blocks; ++b) {
      const std::size_t begin = segment.begin + b * samples / blocks;
      records.push_back({.recording = record.recording.part(begin, begin + kept / blocks),
                         .segments = whole_record(kept / blocks, Role::train)});
    }
  }
  if (!others.segments.empty()) records.push_back(std::move(others));
}

/// The recordings with the roles of a fold, for all threads.
struct FoldData {
  FoldData(Dataset own, InputSets& examined) : dataset(std::move(own)), inputs(dataset, examined) {}
  Dataset dataset;
  InputSets inputs;
};

}  // namespace

class StructureStudy::Plan {
 public:
  Plan(Dataset dataset, std::vector<ModelChoice> candidates, const SearchSettings& settings)
      : dataset_(std::move(dataset)),
        candidates_(std::move(candidates)),
        settings_(settings),
        folds_(dataset_, {.folds = settings.folds}, candidates_, settings.seed),
        inputs_(dataset_, settings.allow_leak) {
    // A wrong setting or a leak is found before any fit.
    for (const ModelChoice& choice : candidates_) (void)inputs_.leak_of(choice.features);
    samples_ = samples_with_role(dataset_, Role::train);
  }

  [[nodiscard]] std::vector<Trial> first_trials() const {
    std::map<std::string, std::vector<std::size_t>> groups;
    for (std::size_t i = 0; i < candidates_.size(); ++i) groups[group_of(i)].push_back(i);
    std::vector<Trial> trials;
    for (const auto& [group, members] : groups)
      std::ranges::move(trials_of(members, is_halved(members) ? 0 : kLastStep),
                        std::back_inserter(trials));
    return trials;
  }

  TrialResult run(const Claim& claim, const Progress& progress) {
    const FitTask task = task_of(claim.spec);
    const ModelChoice& full = candidates_.at(task.candidate);
    const bool cuts_search = claim.step < kLastStep && !effort_option_of(full.family).empty();
    const ModelChoice choice = cuts_search ? with_effort(full, effort_of(claim.step)) : full;
    const std::shared_ptr<FoldData> data = data_of(task.fold, cuts_search ? kLastStep : claim.step);
    ScoredModel scored =
        fit_and_score(data->dataset, data->inputs, choice, settings_.seed, kFoldRoles, progress);
    std::erase_if(scored.rows, [](const ResultRow& row) { return row.split == Role::train; });
    TrialResult result = trial_result(scored.rows);
    if (claim.step == kLastStep && !scored.estimates.empty())
      result.samples = pack_estimates(scored.estimates.front().recordings);
    return result;
  }

  [[nodiscard]] HalvingDecision decide(int step, std::span<const TrialRecord> trials) const {
    if (step >= kLastStep) return {};
    struct Entry {
      const TrialRecord* record;
      std::size_t candidate;
      double value;
    };
    std::vector<Entry> entries;
    entries.reserve(trials.size());
    for (const TrialRecord& record : trials)
      entries.push_back({&record, task_of(record.trial.spec).candidate,
                         std::isfinite(record.result.value)
                             ? record.result.value
                             : std::numeric_limits<double>::infinity()});
    std::ranges::sort(entries, [](const Entry& a, const Entry& b) {
      return std::pair(a.value, a.candidate) < std::pair(b.value, b.candidate);
    });
    // A fit that fails on a part of the samples may succeed on all of them: it continues.
    const auto fitted = static_cast<std::size_t>(std::ranges::count_if(
        entries, [](const Entry& entry) { return std::isfinite(entry.value); }));
    const std::size_t kept = (fitted + 1) / 2;
    HalvingDecision decision;
    std::vector<std::size_t> next;
    double seconds = 0.0;
    for (std::size_t i = 0; i < entries.size(); ++i) {
      const Entry& entry = entries[i];
      if (i < kept || i >= fitted) {
        next.push_back(entry.candidate);
        seconds = std::max(seconds, entry.record->result.seconds);
      } else {
        decision.pruned.push_back(
            {entry.record->id,
             fmt::format("halving step {}, one fold with {:.0f} % of the {}: RMSE {:.3g}, place {} "
                         "of {} (the last that continued: {:.3g})",
                         step + 1, 100.0 * effort_of(step), what_is_cut(entry.candidate),
                         entry.value, i + 1, fitted, entries[kept - 1].value)});
      }
    }
    const int next_step = step + 1 < kLastStep && next.size() > 2 ? step + 1 : kLastStep;
    decision.next = trials_of(next, next_step);
    // The measured times order the rest better than those of the table of families.
    const double full_s = seconds / kEfforts.at(static_cast<std::size_t>(step));
    for (Trial& trial : decision.next)
      if (seconds > 0.0) trial.priority = full_s * effort_of(next_step);
    return decision;
  }

  [[nodiscard]] std::string label(const Claim& claim) const {
    const FitTask task = task_of(claim.spec);
    std::string text = fmt::format("{}, {}", label_of(candidates_.at(task.candidate)),
                                   folds_.plan().folds.at(task.fold).name);
    if (claim.step < kLastStep) text += fmt::format(" (halving step {})", claim.step + 1);
    return text;
  }

  [[nodiscard]] StructureSearch result(StudyStore& store, std::int64_t study) {
    const std::size_t folds = folds_.plan().folds.size();
    std::vector<std::vector<const TrialRecord*>> fitted(
        folds, std::vector<const TrialRecord*>(candidates_.size(), nullptr));
    std::map<std::size_t, std::string> pruned;
    const std::vector<TrialRecord> records = store.trials(study);
    for (const TrialRecord& record : records) {
      const FitTask task = task_of(record.trial.spec);
      if (record.state == TrialState::waiting || record.state == TrialState::running)
        throw Error({.place = store.address().name(), .problem = "this study is not complete"});
      if (record.state == TrialState::pruned) pruned[task.candidate] = record.result.reason;
      if (record.trial.step == kLastStep) fitted.at(task.fold).at(task.candidate) = &record;
    }
    FoldScores scores(dataset_, {.folds = settings_.folds}, candidates_, settings_.seed);
    Dataset dataset = dataset_;
    for (std::size_t fold = 0; fold < folds; ++fold) {
      scores.cut(fold, dataset);
      std::vector<ScoredModel> models;
      for (std::size_t i = 0; i < candidates_.size(); ++i)
        models.push_back(stored_model(store, fitted[fold][i], candidates_[i]));
      scores.add(fold, dataset, std::move(models));
    }
    StructureSearch search{.winners = {}, .scores = std::move(scores).summary()};
    std::set<std::string> chosen;
    for (FoldSummary& summary : search.scores.ranking) {
      const std::size_t candidate = candidate_of(summary);
      if (const auto reason = pruned.find(candidate); reason != pruned.end()) {
        summary.status = "pruned";
        summary.reason = reason->second;
      }
      if (summary.failed_folds > 0 || summary.ranked_folds == 0) continue;
      if (chosen.insert(summary.family).second) search.winners.push_back(candidates_[candidate]);
    }
    return search;
  }

 private:
  [[nodiscard]] std::string group_of(std::size_t candidate) const {
    return settings_.halving == Halving::by_all ? "all" : candidates_[candidate].family;
  }

  [[nodiscard]] bool is_halved(const std::vector<std::size_t>& members) const {
    constexpr std::size_t kLeastSamples = 8000;  // a quarter of which is enough for most families
    if (settings_.halving == Halving::off || members.size() < 2 || samples_ < kLeastSamples)
      return false;
    return settings_.halving == Halving::by_all ||
           expected_s(members.front(), kLastStep) >= settings_.halve_from_s;
  }

  /// The expected time of a fit.
  [[nodiscard]] double expected_s(std::size_t candidate, int step) const {
    constexpr double kSamplesOfTypicalTime = 85'000.0;
    return find_family(candidates_[candidate].family).typical_fit_s * effort_of(step) *
           static_cast<double>(samples_) / kSamplesOfTypicalTime;
  }

  [[nodiscard]] std::string what_is_cut(std::size_t candidate) const {
    const std::string_view option = effort_option_of(candidates_[candidate].family);
    return option.empty() ? "training samples" : std::string(option);
  }

  [[nodiscard]] static double effort_of(int step) {
    return step < kLastStep ? kEfforts.at(static_cast<std::size_t>(step)) : 1.0;
  }

  [[nodiscard]] std::vector<Trial> trials_of(const std::vector<std::size_t>& members,
                                             int step) const {
    std::vector<Trial> trials;
    const std::size_t folds = step < kLastStep ? 1 : folds_.plan().folds.size();
    for (const std::size_t i : members)
      for (std::size_t fold = 0; fold < folds; ++fold)
        trials.push_back(
            {.key = fmt::format("{}|{}", label_of(candidates_[i]), folds_.plan().folds[fold].name),
             .spec = Json{{"candidate", i}, {"fold", fold}}.dump(),
             .group = group_of(i),
             .step = step,
             .priority = expected_s(i, step)});
    return trials;
  }

  std::shared_ptr<FoldData> data_of(std::size_t fold, int step) {
    const std::scoped_lock lock(guard_);
    std::shared_ptr<FoldData>& known = data_[{fold, step}];
    if (known) return known;
    Dataset dataset = dataset_;
    folds_.cut(fold, dataset);
    if (step < kLastStep) {
      std::vector<DatasetRecord> records;
      for (const DatasetRecord& record : dataset.records)
        add_share_of(record, effort_of(step), records);
      dataset.records = std::move(records);
    }
    known = std::make_shared<FoldData>(std::move(dataset), inputs_);
    return known;
  }

  static ScoredModel stored_model(StudyStore& store, const TrialRecord* record,
                                  const ModelChoice& choice) {
    ScoredModel model;
    if (record == nullptr) return model;  // pruned before
    if (record->result.result.empty()) {
      ResultRow& row = model.rows.emplace_back();
      row.status = "failed";
      row.reason = record->result.reason;
    } else {
      model.rows = rows_from_text(record->result.result);
    }
    if (const std::string bytes = store.samples(record->id); !bytes.empty())
      model.estimates.push_back({.role = Role::test, .recordings = unpack_estimates(bytes)});
    for (ResultRow& row : model.rows) {
      row.family = choice.family;
      row.variant = choice.variant();
      row.input_set = choice.input_set;
    }
    return model;
  }

  [[nodiscard]] std::size_t candidate_of(const FoldSummary& summary) const {
    const auto found = std::ranges::find_if(candidates_, [&](const ModelChoice& choice) {
      return choice.family == summary.family && choice.variant() == summary.variant &&
             choice.input_set == summary.input_set;
    });
    return static_cast<std::size_t>(found - candidates_.begin());
  }

  Dataset dataset_;
  std::vector<ModelChoice> candidates_;
  SearchSettings settings_;
  FoldScores folds_;
  InputSets inputs_;
  std::size_t samples_ = 0;
  std::mutex guard_;
  std::map<std::pair<std::size_t, int>, std::shared_ptr<FoldData>> data_;
};

StructureStudy::StructureStudy(Dataset dataset, std::vector<ModelChoice> candidates,
                               const SearchSettings& settings)
    : plan_(std::make_unique<Plan>(std::move(dataset), std::move(candidates), settings)) {}
StructureStudy::~StructureStudy() = default;

std::vector<Trial> StructureStudy::first_trials() const { return plan_->first_trials(); }
TrialResult StructureStudy::run(const Claim& claim, const Progress& progress) {
  return plan_->run(claim, progress);
}
HalvingDecision StructureStudy::decide(const std::string& /*group*/, int step,
                                       std::span<const TrialRecord> trials) {
  return plan_->decide(step, trials);
}
std::string StructureStudy::label(const Claim& claim) const { return plan_->label(claim); }
StructureSearch StructureStudy::result(StudyStore& store, std::int64_t study) {
  return plan_->result(store, study);
}

StructureSearch search_structures(Dataset dataset, const std::vector<ModelChoice>& candidates,
                                  const SearchSettings& settings, const Progress& progress,
                                  std::size_t threads) {
  StructureStudy kind(std::move(dataset), candidates, settings);
  StudyStore store({.kind = StoreAddress::Kind::memory, .target = {}});
  const StoredStudy study = store.create_or_resume(
      {.name = "search", .kind = std::string(kStructureStudy), .spec = {}, .torsio_version = {}},
      kind.first_trials());
  run_workers(store, study, kind, {.threads = threads}, progress);
  return kind.result(store, study.id);
}

}  // namespace torsio

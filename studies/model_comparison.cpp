#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "comparison_cases.hpp"
#include "core/running_mean.hpp"
#include "studies.hpp"
#include "study_models.hpp"
#include "study_rows.hpp"
#include "torsio/evaluate/comparison.hpp"
#include "torsio/fit/families.hpp"

namespace torsio {
namespace {

using Candidate = ComparedFamily;
constexpr const auto& kCandidates = kComparedFamilies;

constexpr std::string_view kSubject = "grey_box";

struct Choice {
  std::string label;
  ModelChoice model;
};

/// Those that are compared: of the quick study fewer.
std::vector<Candidate> comparison_candidates(bool is_quick) {
  std::vector<Candidate> chosen;
  std::ranges::copy_if(kCandidates, std::back_inserter(chosen),
                       [&](const Candidate& each) { return each.is_quick || !is_quick; });
  return chosen;
}

std::vector<Choice> choices_of(const ComparisonCase& of, std::span<const Candidate> candidates) {
  std::vector<Choice> choices;
  for (const Candidate& candidate : candidates) {
    std::string model(candidate.model);
    const std::string_view family = candidate.model.substr(0, candidate.model.find(':'));
    if (!of.schedule.empty() && has_option(find_family(family), "schedule"))
      model += ":schedule=" + of.schedule;
    choices.push_back(
        {std::string(candidate.label), model_choices(of.dataset, model, of.inputs).front()});
  }
  return choices;
}

/// The rows of one fit on the test records: of each condition, or of all together.
void add(StudyRows& rows, const ComparisonPlan& plan, const ComparisonCase& of,
         const std::string& model, const ResultRow& row) {
  if (of.conditions.empty()) {
    if (row.status == "failed") rows.failed(plan.name, model, row.reason);
    if (row.status != "failed" && row.split == Role::test && !row.recording)
      rows.add(plan.name, model, row, of.dataset);
    return;
  }
  for (const auto& [recording, condition] : of.conditions) {
    if (row.status == "failed") rows.failed(condition, model, row.reason);
    if (row.status != "failed" && row.split == Role::test && row.recording == recording)
      rows.add(condition, model, row, of.dataset);
  }
}

void run_case(StudyRows& rows, const ComparisonPlan& plan, const ComparisonCase& of,
              std::uint64_t seed, std::span<const Candidate> candidates, const Progress& progress) {
  const std::vector<Choice> choices = choices_of(of, candidates);
  std::vector<ModelChoice> models;
  std::ranges::transform(choices, std::back_inserter(models), &Choice::model);
  const Results results = compare(of.dataset, models, seed, false, progress).results;
  for (const ResultRow& row : results.rows) {
    const auto found = std::ranges::find_if(choices, [&](const Choice& choice) {
      return choice.model.family == row.family && choice.model.variant() == row.variant;
    });
    add(rows, plan, of, found->label, row);
  }
}

constexpr const char* kProtocol =
    "dfki: three sweeps, tested on a fourth lever in an inclined plane (new lever); torque chirps "
    "of 0.8 and 0.3 of "
    "the rating, output locked, tested on noise of 0.25 (random walk), both at the load cell's 125 "
    "Hz, its latency "
    "taken off. elastomer: triangles of 0.4 to 4 Hz. rubber-clutch: sines, tested on multisines. "
    "harmonic-drive: "
    "pushes of 10 and 20 Nm, high and zero impedance, tested on 15 Nm. Real ones: "
    "docs/results/model_comparison.md";

Study compared(const StudyOptions& options, std::span<const Candidate> candidates,
               const std::string& what, const Progress& progress) {
  Study study{.protocol = what + kProtocol, .unit = "Nm", .options = options};
  std::vector<ComparisonPlan> plans = simulated_plans(options.is_quick);
  if (!options.is_quick) std::ranges::move(recorded_plans(), std::back_inserter(plans));
  StudyRows rows;
  for (std::size_t p = 0; p < plans.size(); ++p) {
    const ComparisonPlan& plan = plans[p];
    const bool is_new =
        !plan.plant.empty() &&
        std::ranges::find(study.plants, plan.plant, &StudyPlant::name) == study.plants.end();
    if (is_new) study.plants.push_back(study_plant(plan.plant));
    const std::size_t repeats = plan.plant.empty() ? 1 : options.repeats;
    for (std::size_t k = 0; k < repeats; ++k) {
      const Progress part = nth_of(progress, p * repeats + k, plans.size() * repeats, plan.name);
      const std::uint64_t seed = repeat_seed(options, k);
      run_case(rows, plan, plan.make(seed, part), seed, candidates, part);
    }
  }
  study.table = ComparisonTable{.rows = rows.comparisons(), .subject = std::string(kSubject)};
  for (const Candidate& candidate : candidates)
    if (candidate.model != candidate.label)
      study.notes.push_back(fmt::format("model {}: {}", candidate.label, candidate.model));
  return study;
}

/// Shares of samples within one and two error bars.
struct Coverage {
  void add(const ComparisonRow& row) {
    const double one = 100.0 * row.within_std_dev;
    const double two = 100.0 * row.within_2_std_dev;
    one_.add(one);
    two_.add(two);
    least_one_ = std::min(least_one_, one);
    least_two_ = std::min(least_two_, two);
    ++rows_;
  }
  [[nodiscard]] std::string text(std::string_view name) const {
    return fmt::format(
        "{} rows of {}: {:.1f} % within one error bar and {:.1f} % within two on average, the "
        "lowest rows {:.1f} and "
        "{:.1f} %",
        rows_, name, one_.mean(), two_.mean(), least_one_, least_two_);
  }

 private:
  RunningMean one_, two_;
  double least_one_ = 100.0;
  double least_two_ = 100.0;
  std::size_t rows_ = 0;
};

/// Whether the test recording moves otherwise than the training, or was recorded at another preload.
bool is_other_motion(std::string_view condition) {
  return condition.ends_with("random walk") || condition.ends_with("slow cycles") ||
         condition.ends_with("other preloads");
}

}  // namespace

Study model_comparison(const StudyOptions& options, const Progress& progress) {
  return compared(options, comparison_candidates(options.is_quick),
                  "every family on every simulated actuator and on the real recordings with a "
                  "torque, in free run. ",
                  progress);
}

Study error_bars(const StudyOptions& options, const Progress& progress) {
  constexpr std::array kOne{Candidate{kSubject, kSubject, true}};
  Study study =
      compared(options, kOne,
               "the error bars of grey_box without validation recordings, in free run. ", progress);
  Coverage other;
  Coverage same;
  for (const ComparisonRow& row : std::get<ComparisonTable>(study.table).rows)
    (is_other_motion(row.condition) ? other : same).add(row);
  study.notes.push_back(other.text("another motion"));
  study.notes.push_back(same.text("the same motion"));
  return study;
}

}  // namespace torsio

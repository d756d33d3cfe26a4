#include <algorithm>
#include <iterator>
#include <set>
#include <string>
#include <utility>

#include "torsio/evaluate/comparison.hpp"
#include "torsio/fit/families.hpp"

namespace torsio {
std::vector<ModelChoice> search_candidates(const Dataset& dataset,
                                           const std::vector<std::string>& wanted_inputs) {
  std::vector<ModelChoice> candidates = model_choices(dataset, "all", wanted_inputs);
  for (const FamilyInfo& family : families())
    if (family.only_if_named && family.in_search)
      std::ranges::move(model_choices(dataset, family.name, wanted_inputs),
                        std::back_inserter(candidates));
  const std::size_t plain = candidates.size();
  for (std::size_t i = 0; i < plain; ++i)
    for (const OptionVariation& variation : find_family(candidates[i].family).variations) {
      const std::string option(variation.option);
      if (candidates[i].options.contains(option)) continue;
      ModelChoice varied = candidates[i];
      varied.options[option] = variation.value;
      candidates.push_back(std::move(varied));
    }
  return candidates;
}

StructureSearch search_structures(const Dataset& dataset,
                                  const std::vector<ModelChoice>& candidates, std::uint64_t seed,
                                  bool allow_leak, const Progress& progress) {
  StructureSearch search{.winners = {},
                         .scores = cross_validate(dataset, candidates, {.folds = kSearchFolds},
                                                  seed, allow_leak, progress)};
  std::set<std::string> chosen;
  for (const FoldSummary& summary : search.scores.ranking) {
    if (summary.failed_folds > 0 || summary.ranked_folds == 0) continue;
    if (!chosen.insert(summary.family).second) continue;
    search.winners.push_back(*std::ranges::find_if(candidates, [&](const ModelChoice& choice) {
      return choice.family == summary.family && choice.variant() == summary.variant &&
             choice.input_set == summary.input_set;
    }));
  }
  return search;
}

}  // namespace torsio

#include <algorithm>
#include <iterator>
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

}  // namespace torsio

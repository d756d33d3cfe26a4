#include "torsio/evaluate/structure_search.hpp"

#include <algorithm>
#include <array>
#include <set>
#include <string>
#include <utility>

#include "torsio/evaluate/comparison.hpp"
#include "torsio/fit/families.hpp"

namespace torsio {
namespace {

struct Variation {
  std::string_view family;
  std::string_view option;
  std::string_view value;
};

/// Orders, sizes and structures besides the defaults.
constexpr std::array kStructureGrid{
    Variation{"polynomial", "degree", "3"},
    Variation{"polynomial", "degree", "7"},
    Variation{"maxwell_slip", "thresholds", "4"},
    Variation{"maxwell_slip", "thresholds", "16"},
    Variation{"prandtl_ishlinskii", "thresholds", "4"},
    Variation{"prandtl_ishlinskii", "thresholds", "16"},
    Variation{"grey_box", "passive", "true"},
    Variation{"grey_box", "residual", "none"},
    Variation{"dgmm", "components", "100"},
    Variation{"dgmm", "components", "1000"},
    Variation{"mlp", "layers", "16-16"},
    Variation{"mlp", "layers", "50-10-5"},
    Variation{"arx", "output_lags", "1"},
    Variation{"arx", "output_lags", "4"},
    Variation{"narx_polynomial", "degree", "2"},
    Variation{"viscoelastic", "network", "standard_linear_solid"},
    Variation{"viscoelastic", "network", "generalised_maxwell(3)"},
    Variation{"hammerstein_wiener", "map", "piecewise_linear"},
};

/// What `all` leaves out because it is searched for iteratively, and people who ask for a search wait for.
constexpr std::array<std::string_view, 8> kSlow{"arx",
                                                "narx_polynomial",
                                                "prandtl_ishlinskii_improved",
                                                "nonlinear_backlash",
                                                "bouc_wen",
                                                "exponential_loading",
                                                "viscoelastic",
                                                "hammerstein_wiener"};

}  // namespace

std::vector<ModelChoice> search_candidates(const Dataset& dataset,
                                           const std::vector<std::string>& wanted_inputs) {
  std::vector<ModelChoice> candidates = model_choices(dataset, "all", wanted_inputs);
  for (const std::string_view family : kSlow)
    std::ranges::move(model_choices(dataset, family, wanted_inputs),
                      std::back_inserter(candidates));
  const std::size_t plain = candidates.size();
  for (std::size_t i = 0; i < plain; ++i) {
    const FamilyInfo& family = find_family(candidates[i].family);
    for (const Variation& variation : kStructureGrid) {
      const std::string option(variation.option);
      if (variation.family != family.name || !has_option(family, option) ||
          candidates[i].options.contains(option))
        continue;
      ModelChoice varied = candidates[i];
      varied.options[option] = variation.value;
      candidates.push_back(std::move(varied));
    }
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
    if (summary.failed_folds > 0 || summary.folds == 0) continue;
    if (!chosen.insert(summary.family).second) continue;
    search.winners.push_back(*std::ranges::find_if(candidates, [&](const ModelChoice& choice) {
      return choice.family == summary.family && choice.variant() == summary.variant &&
             choice.input_set == summary.input_set;
    }));
  }
  return search;
}

}  // namespace torsio

#include "files/known_families.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "files/family_names.hpp"

namespace torsio {

AnyParameters parameters_of_family(std::string_view family) {
  std::optional<AnyParameters> found;
  KnownFamilies::for_each([&]<class F>(std::type_identity<F> /*family*/) {
    if (F::kFamily == family) found.emplace(typename F::Parameters{});
  });
  if (found) return *std::move(found);
  throw UsageError({.problem = "no model family is called \"" + std::string(family) + '"',
                    .expected = "one of " + known_model_families()});
}

std::string known_model_families() {
  return fmt::format("{}", fmt::join(KnownFamilies::kNames, ", "));
}

}  // namespace torsio

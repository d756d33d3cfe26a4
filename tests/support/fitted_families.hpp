#pragma once

#include <algorithm>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "torsio/fit/families.hpp"

/// The table of fitters as parameters of tests, one test for each family:
///
///     INSTANTIATE_TEST_SUITE_P(EveryFamily, MyTest, testing::ValuesIn(spring_families()), kFamilyName);
namespace torsio::test {

inline std::vector<std::string> fitted_families() {
  std::vector<std::string> names;
  for (const FamilyInfo& family : families()) names.emplace_back(family.name);
  return names;
}

/// Those that can be fitted to a spring.
inline std::vector<std::string> spring_families() {
  std::vector<std::string> names = fitted_families();
  std::erase_if(names, [](const std::string& name) { return !find_family(name).is_spring; });
  return names;
}

/// Small values of the options that set how long a fit takes, for tests that need no better model.
inline std::map<std::string, std::string> quick_options(std::string_view family) {
  std::map<std::string, std::string> options;
  for (const auto& [name, value] : std::map<std::string, std::string>{{"samples", "300"},
                                                                      {"inducing_points", "20"},
                                                                      {"rounds", "1"},
                                                                      {"updates", "5000"},
                                                                      {"epochs", "10"},
                                                                      {"restarts", "0"},
                                                                      {"starts", "2"},
                                                                      {"iterations", "80"}}) {
    const auto known = find_family(family).options;
    if (std::ranges::find(known, name, &OptionInfo::name) != known.end()) options[name] = value;
  }
  return options;
}

inline constexpr auto kFamilyName = [](const auto& info) { return info.param; };

}  // namespace torsio::test

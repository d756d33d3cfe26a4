// What it means to be a fitter: for every entry of `families()` with its variants. Options that only set
// how long a fit takes are small.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <map>
#include <ostream>
#include <string>
#include <string_view>
#include <vector>

#include "fit/common/model_run.hpp"
#include "laws/law_data.hpp"
#include "support/dump_any.hpp"
#include "support/fitted_families.hpp"
#include "torsio/core/error.hpp"
#include "torsio/fit/families.hpp"

namespace torsio::test {
namespace {

struct FitCase {
  const FamilyInfo* family;
  std::map<std::string, std::string> options;
};

/// The defaults of each family, then each switch that it shares with others turned on.
std::vector<FitCase> fit_cases() {
  std::vector<FitCase> cases;
  for (const FamilyInfo& family : families()) {
    cases.push_back({&family, {}});
    for (const auto& [option, value] : std::map<std::string, std::string>{
             {"rates", "true"}, {"schedule", "support_m"}, {"branch", "false"}})
      if (std::ranges::find(family.options, option, &OptionInfo::name) != family.options.end())
        cases.push_back({&family, {{option, value}}});
  }
  return cases;
}

void PrintTo(const FitCase& fit_case, std::ostream* out) { *out << fit_case.family->name; }

std::string case_name(const testing::TestParamInfo<FitCase>& info) {
  std::string name(info.param.family->name);
  for (const auto& [option, value] : info.param.options) name += "_" + option + "_" + value;
  return name;
}

/// Fits that simulate each record many times get shorter ones, so that a law stays within seconds.
std::size_t samples_for(const FamilyInfo& family) {
  constexpr std::array<std::string_view, 4> kSlow{"hammerstein_wiener", "narx_gaussian_process",
                                                  "narx_parametric_gp",
                                                  "narx_parametric_gp_variational"};
  return std::ranges::find(kSlow, family.name) == kSlow.end() ? 4000 : 1000;
}

class FitLaws : public testing::TestWithParam<FitCase> {
 protected:
  FittedModel fit(const Progress& progress = {}) {
    const auto& [family, switches] = GetParam();
    std::map<std::string, std::string> options = quick_options(family->name);
    options.insert(switches.begin(), switches.end());
    return family->fit(data_, Options(family->options, options), {.seed = 5, .progress = progress});
  }

  TrainingData data_ = data_for(*GetParam().family, samples_for(*GetParam().family));
};

TEST_P(FitLaws, AFitIsDeterministic) {
  const FittedModel first = fit();
  const FittedModel second = fit();
  EXPECT_EQ(dump(first.model.parameters()), dump(second.model.parameters()));
  EXPECT_EQ(first.notes, second.notes);
  EXPECT_EQ(first.model.input_count(), data_.input_count());
}

/// Algorithms that papers print are there for comparison: that of 000 (sign corrected) beats the mean, that of 002 may
/// end as the zero function, which is a little worse than the mean.
double least_fit_percent(std::string_view family) {
  if (family == "dgmm_paper") return 0.0;
  return family.ends_with("parametric_gp_paper") ? -5.0 : 80.0;
}

TEST_P(FitLaws, AFitExplainsASpringWithFriction) {
  EXPECT_GT(evaluate(fit().model, data_).fit_percent, least_fit_percent(GetParam().family->name));
}

TEST_P(FitLaws, AFitStopsWhenAsked) {
  EXPECT_THROW(fit([](double, std::string_view) { return false; }), Cancelled);
}

INSTANTIATE_TEST_SUITE_P(EveryFamily, FitLaws, testing::ValuesIn(fit_cases()), case_name);

}  // namespace
}  // namespace torsio::test

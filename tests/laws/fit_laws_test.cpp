// What it means to be a fitter: for every entry of `families()` with its defaults and its variants.
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
#include "support/driven_record.hpp"
#include "support/dump.hpp"
#include "support/example_data.hpp"
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

/// `noisy_spring` recorded at two places of a support, the second with a stiffer spring.
TrainingData two_springs(std::size_t samples) {
  TrainingData data = noisy_spring(samples);
  data.inputs.push_back({.expression = "support_m"});
  data.sequences.push_back(data.sequences.front());
  for (std::size_t i = 0; i < data.sequences.size(); ++i) {
    Sequence& sequence = data.sequences[i];
    const Matrix two = sequence.features;
    sequence.features = Matrix(two.rows, 3);
    for (std::size_t n = 0; n < two.rows; ++n) {
      std::ranges::copy(two.row(n), sequence.features.row(n).begin());
      sequence.features(n, 2) = 0.1 * static_cast<double>(i);
      sequence.target[n] += 50.0 * static_cast<double>(i) * two(n, 0);
    }
  }
  return data;
}

/// A spring, or for families whose input is a force the motion that one of them made of it.
TrainingData data_for(const FamilyInfo& family) {
  constexpr std::size_t kSamples = 600;
  if (family.name == DynamicBoucWen::kFamily)
    return recorded(hysteretic(), multisine(kSamples, 750.0, 5.0, 100.0, 60.0), 5e-6);
  if (family.name == FrictionDrive::kFamily)
    return recorded(carriage(), multisine(kSamples, 1000.0, 2.0, 20.0, 200.0), 1e-6);
  // Their fits simulate each record many times: shorter ones keep a law within seconds.
  constexpr std::array<std::string_view, 4> kSlow{"hammerstein_wiener", "narx_gaussian_process",
                                                  "narx_parametric_gp",
                                                  "narx_parametric_gp_variational"};
  return two_springs(std::ranges::find(kSlow, family.name) == kSlow.end() ? 4000 : 1000);
}

class FitLaws : public testing::TestWithParam<FitCase> {
 protected:
  FittedModel fit(const Progress& progress = {}) {
    const auto& [family, options] = GetParam();
    return family->fit(data_, Options(family->options, options), {.seed = 5, .progress = progress});
  }

  TrainingData data_ = data_for(*GetParam().family);
};

TEST_P(FitLaws, AFitIsDeterministic) {
  const FittedModel first = fit();
  const FittedModel second = fit();
  EXPECT_EQ(dump(first.model.parameters()), dump(second.model.parameters()));
  EXPECT_EQ(first.notes, second.notes);
  EXPECT_EQ(first.model.input_count(), data_.input_count());
}

TEST_P(FitLaws, AFitExplainsASpringWithFriction) {
  // The paper's algorithm (sign corrected) is there for comparison: it need only beat the mean.
  const double least_percent = GetParam().family->name == "dgmm_paper" ? 0.0 : 80.0;
  EXPECT_GT(evaluate(fit().model, data_).fit_percent, least_percent);
}

TEST_P(FitLaws, AFitStopsWhenAsked) {
  EXPECT_THROW(fit([](double, std::string_view) { return false; }), Cancelled);
}

INSTANTIATE_TEST_SUITE_P(EveryFamily, FitLaws, testing::ValuesIn(fit_cases()), case_name);

}  // namespace
}  // namespace torsio::test

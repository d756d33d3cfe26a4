#include "torsio/fit/families.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <string>
#include <vector>

#include "model/linear/linear_coulomb.hpp"
#include "support/error_message.hpp"
#include "support/example_data.hpp"
#include "support/fitted_families.hpp"
#include "torsio/core/error.hpp"

namespace torsio {
namespace {

TEST(Families, HaveNamesThatDiffer) {
  std::vector<std::string> names = test::fitted_families();
  std::ranges::sort(names);
  EXPECT_EQ(std::ranges::adjacent_find(names), names.end());
}

class EntryOfFamilies : public testing::TestWithParam<std::string> {};

TEST_P(EntryOfFamilies, IsFoundAndItsOptionsAcceptTheirDefaults) {
  const FamilyInfo& family = find_family(GetParam());
  EXPECT_EQ(family.name, GetParam());
  EXPECT_FALSE(family.summary.empty());
  for (const OptionInfo& option : family.options) {
    const std::map<std::string, std::string> as_default{
        {std::string(option.name), std::string(option.default_value)}};
    EXPECT_NO_THROW(Options(family.options, as_default)) << option.name;
    EXPECT_FALSE(option.help.empty()) << option.name;
  }
  for (const auto& [option, value] : family.variations)
    EXPECT_NO_THROW(Options(family.options, {{std::string(option), std::string(value)}})) << option;
}

INSTANTIATE_TEST_SUITE_P(EveryFamily, EntryOfFamilies, testing::ValuesIn(test::fitted_families()),
                         test::kFamilyName);

class SpringFamilies : public testing::TestWithParam<std::string> {};

TEST_P(SpringFamilies, FitModelsOfTheirName) {
  const FamilyInfo& family = find_family(GetParam());
  const Options options(family.options, test::quick_options(family.name));
  const FittedModel fitted = family.fit(test::noisy_spring(), options, {.seed = 1});
  EXPECT_EQ(fitted.model.family(), family.model_family);
}

INSTANTIATE_TEST_SUITE_P(EveryFamily, SpringFamilies, testing::ValuesIn(test::spring_families()),
                         test::kFamilyName);

TEST(Families, NameTheNearestWhenOneIsUnknown) {
  try {
    (void)find_family("polynomal");
    FAIL() << "found a family that does not exist";
  } catch (const UsageError& error) {
    const std::string message = error.what();
    EXPECT_NE(message.find("linear, linear_coulomb, polynomial"), std::string::npos) << message;
    EXPECT_NE(message.find("Did you mean 'polynomial'?"), std::string::npos) << message;
  }
}

TEST(Families, StateWhereOptionsGoIfTheyAreInTheName) {
  EXPECT_NE(test::error_message([] {
              (void)find_family("linear:rate_scale=1");
            }).find("--set NAME=VALUE"),
            std::string::npos);
}

TEST(Families, PassTheirOptionsOn) {
  const TrainingData data = test::noisy_spring();
  const FamilyInfo& coulomb = find_family("linear_coulomb");
  const auto given =
      coulomb.fit(data, Options(coulomb.options, {{"rate_scale", "0.25"}}), {.seed = 1});
  EXPECT_EQ(given.model.get_if<LinearCoulomb>()->parameters().rate_scale, 0.25);
  const FamilyInfo& polynomial = find_family("polynomial");
  const auto cubic = polynomial.fit(
      data, Options(polynomial.options, {{"degree", "3"}, {"branch", "false"}, {"rates", "true"}}),
      {.seed = 1});
  EXPECT_EQ(cubic.model.parameter_count(), 5U);
}

}  // namespace
}  // namespace torsio

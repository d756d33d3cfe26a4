#include "torsio/fit/families.hpp"

#include <gtest/gtest.h>

#include <set>
#include <string>

#include "model/linear/linear_coulomb.hpp"
#include "support/every_family.hpp"
#include "support/example_data.hpp"
#include "torsio/core/error.hpp"

namespace torsio {
namespace {

TEST(Families, StandInTheTableOnceEachWithOptionsThatTheirOwnCheckAccepts) {
  std::set<std::string_view> names;
  for (const FamilyInfo& family : families()) {
    EXPECT_TRUE(names.insert(family.name).second) << family.name;
    EXPECT_FALSE(family.summary.empty());
    for (const OptionInfo& option : family.options) {
      const std::map<std::string, std::string> as_default{
          {std::string(option.name), std::string(option.default_value)}};
      EXPECT_NO_THROW(Options(family.options, as_default)) << family.name << ": " << option.name;
      EXPECT_FALSE(option.help.empty()) << family.name << ": " << option.name;
    }
    for (const auto& [option, value] : family.variations)
      EXPECT_NO_THROW(Options(family.options, {{std::string(option), std::string(value)}}))
          << family.name << ": " << option;
  }
}

TEST(Families, FindThemselvesAndFitModelsOfTheirFamily) {
  for (const FamilyInfo& family : families()) {
    const FamilyInfo& found = find_family(family.name);
    EXPECT_EQ(&found, &family);
    if (!test::is_for_springs(family)) continue;
    const FittedModel fitted =
        found.fit(test::noisy_spring(), Options(found.options, {}), {.seed = 1});
    EXPECT_EQ(fitted.model.family(), family.model_family) << family.name;
  }
}

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

#include "files/known_families.hpp"

#include <gtest/gtest.h>

#include <string>

#include "files/family_names.hpp"
#include "support/every_family.hpp"
#include "torsio/core/error.hpp"

namespace torsio {
namespace {

template <class Family>
class KnownFamily : public testing::Test {};
TYPED_TEST_SUITE(KnownFamily, test::EveryFamily);

TYPED_TEST(KnownFamily, HasEmptyParametersByItsName) {
  const AnyParameters parameters = parameters_of_family(TypeParam::kFamily);
  EXPECT_NE(parameters.get_if<typename TypeParam::Parameters>(), nullptr);
  EXPECT_EQ(parameters.family(), TypeParam::kFamily);
}

TEST(KnownFamilies, AreListedWhenOneIsUnknown) {
  try {
    (void)parameters_of_family("lineal");
    FAIL() << "accepted an unknown family";
  } catch (const UsageError& error) {
    EXPECT_NE(std::string(error.what()).find("lineal"), std::string::npos);
    EXPECT_NE(std::string(error.what()).find("linear, linear_coulomb, polynomial"),
              std::string::npos);
  }
}

}  // namespace
}  // namespace torsio

#include "files/known_families.hpp"

#include <gtest/gtest.h>

#include <string>

#include "torsio/core/error.hpp"

namespace torsio {
namespace {

TEST(KnownFamilies, HaveEmptyParametersByName) {
  KnownFamilies::for_each([]<class F>(std::type_identity<F> /*family*/) {
    const AnyParameters parameters = parameters_of_family(F::kFamily);
    EXPECT_NE(parameters.get_if<typename F::Parameters>(), nullptr) << F::kFamily;
    EXPECT_EQ(parameters.family(), F::kFamily);
  });
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

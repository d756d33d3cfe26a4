#pragma once

#include <gtest/gtest.h>

#include <string_view>
#include <variant>

#include "torsio/model/any_model.hpp"

namespace torsio::test {

template <class Models>
struct TypesOf;
template <class... Family>
struct TypesOf<std::variant<Family...>> {
  using Types = testing::Types<Family...>;
};

/// The families of `KnownFamilies` for TYPED_TEST_SUITE: a new one is tested without another line.
using EveryFamily = TypesOf<KnownFamilies::Models>::Types;

/// Whether a family of the table can be fitted to a spring: those driven by a force want a motion as
/// their target.
inline bool is_for_springs(std::string_view family) {
  return family != DynamicBoucWen::kFamily && family != FrictionDrive::kFamily;
}

}  // namespace torsio::test

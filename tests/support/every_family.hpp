#pragma once

#include <gtest/gtest.h>

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

}  // namespace torsio::test

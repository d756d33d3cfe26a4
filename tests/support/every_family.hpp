#pragma once

#include <gtest/gtest.h>

#include <string_view>
#include <type_traits>

#include "files/known_families.hpp"

namespace torsio::test {

/// The families of `KnownFamilies` for TYPED_TEST_SUITE: a new one is tested without another line.
using EveryFamily = KnownFamilies::In<testing::Types>;

/// Whether a family of the table can be fitted to a spring: those driven by a force need a motion as
/// their target.
inline bool is_for_springs(std::string_view family) {
  bool is_spring = true;
  KnownFamilies::for_each([&]<class F>(std::type_identity<F> /*family*/) {
    if (F::kFamily == family) is_spring = traits_of<F>().is_spring;
  });
  return is_spring;
}

}  // namespace torsio::test

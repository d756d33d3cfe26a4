#pragma once

#include <gtest/gtest.h>

#include <string>
#include <type_traits>

#include "files/known_families.hpp"

namespace torsio::test {

/// The families of `KnownFamilies` for TYPED_TEST_SUITE: a new one is tested without another line.
using EveryFamily = KnownFamilies::In<testing::Types>;

/// The same and the model of any family.
template <class... Family>
using WithAnyModel = testing::Types<Family..., AnyModel>;
using EveryModel = KnownFamilies::In<WithAnyModel>;

template <class Kept, class... Rest>
struct InvertibleOf {
  using Type = Kept;
};
template <class... Kept, class First, class... Rest>
struct InvertibleOf<testing::Types<Kept...>, First, Rest...> {
  using Next = std::conditional_t<Invertible<First>, testing::Types<Kept..., First>,
                                  testing::Types<Kept...>>;
  using Type = typename InvertibleOf<Next, Rest...>::Type;
};
template <class... Family>
using InvertibleAndAny = typename InvertibleOf<testing::Types<>, Family..., AnyModel>::Type;
using EveryInvertibleModel = KnownFamilies::In<InvertibleAndAny>;

/// Names typed tests after the family.
struct ModelName {
  template <class M>
  static std::string GetName(int /*index*/) {
    if constexpr (NamedFamily<M>) {
      return std::string(M::kFamily);
    } else {
      return "any_model";
    }
  }
};

}  // namespace torsio::test

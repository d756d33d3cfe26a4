#include "core/did_you_mean.hpp"

#include <gtest/gtest.h>

#include <array>
#include <string_view>

namespace torsio {
namespace {

constexpr std::array<std::string_view, 3> kVerbs{"fit", "evaluate", "compare"};

TEST(DidYouMean, NamesTheNearestName) {
  EXPECT_EQ(did_you_mean("fitt", kVerbs), "Did you mean 'fit'?");
  EXPECT_EQ(did_you_mean("comapre", kVerbs), "Did you mean 'compare'?");
}

TEST(DidYouMean, SuggestsNothingWhereNothingIsNear) {
  EXPECT_EQ(did_you_mean("simulate", kVerbs), "");
  EXPECT_EQ(did_you_mean("", kVerbs), "");
}

TEST(DidYouMean, GivesTheNewNameOfARenamedOption) {
  constexpr std::array<std::string_view, 2> kOptions{"inducing_points", "iterations"};
  EXPECT_EQ(did_you_mean("clusters", kOptions), "It is now called 'inducing_points'.");
  EXPECT_EQ(did_you_mean("clusters", kVerbs), "") << "the new name belongs to another list";
}

}  // namespace
}  // namespace torsio

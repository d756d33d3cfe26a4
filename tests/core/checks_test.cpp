#include "core/checks.hpp"

#include <gtest/gtest.h>

#include <string>

#include "support/error_message.hpp"

namespace torsio {
namespace {

using test::error_message;

TEST(Checks, PlaceOfOneAndOfTwoParts) {
  EXPECT_EQ(error_message([] { require(false, "spring", "a number", 1e-9); }),
            "spring: expected a number, found 1e-09");
  const std::string owner = "grey_box";
  EXPECT_EQ(error_message([&] {
              require(false, {owner, "bound"}, "a number", "none");
            }),
            "grey_box: bound: expected a number, found none");
}

TEST(Checks, TheAdviceHasALineOfItsOwn) {
  EXPECT_EQ(error_message([] { refuse("--age", "0 to 1", "2", "Take a share of the life."); }),
            "--age: expected 0 to 1, found 2\n  Take a share of the life.");
}

TEST(Checks, ThrowsAUsageErrorWhereOneIsNamed) {
  EXPECT_THROW(require<UsageError>(false, "--age", "0 to 1", 2.0), UsageError);
}

TEST(Checks, WhatHoldsPasses) {
  EXPECT_EQ(error_message([] { require(true, "spring", "a number", 0.0); }), "");
}

}  // namespace
}  // namespace torsio

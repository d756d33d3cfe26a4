#include "fit/common/memory_check.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "support/error_message.hpp"

namespace torsio {
namespace {

using testing::ContainsRegex;
using testing::HasSubstr;

TEST(RequireMemory, StatesTheCountThatFits) {
  MemoryNeed need{.what = "the table",
                  .bytes = 8e18,
                  .count = 1'000'000'000,
                  .counted = "samples",
                  .growth = 2.0,
                  .advice = "Set samples={} or less."};
  const std::string message = test::error_message([&] { require_memory(need); });
  EXPECT_THAT(message, HasSubstr("the table would not fit into this machine's memory"));
  EXPECT_THAT(message, HasSubstr("8000000000.0 GB"));
  EXPECT_THAT(message, ContainsRegex("Set samples=[0-9]+ or less"));
  need.bytes = 1.0;
  EXPECT_EQ(test::error_message([&] { require_memory(need); }), "");
}

TEST(RequireMemory, StatesTheMemoryWhereNothingIsCounted) {
  const MemoryNeed need{.what = "the training", .bytes = 8e18, .advice = "Take fewer layers."};
  EXPECT_THAT(test::error_message([&] { require_memory(need); }), HasSubstr("Take fewer layers."));
}

}  // namespace
}  // namespace torsio

#include "torsio/safety/history.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <array>
#include <vector>

#include "support/error_message.hpp"

namespace torsio {
namespace {

std::vector<double> row_of(const History& history, std::size_t row) {
  const std::span<const double> numbers = history.row(row);
  return {numbers.begin(), numbers.end()};
}

TEST(History, KeepsTheLastRowsInTheirOrder) {
  History history(3, 2);
  EXPECT_EQ(history.columns(), 2U);
  EXPECT_EQ(history.size(), 0U);
  for (const double n : {1.0, 2.0}) history.record(std::array{n, -n});
  EXPECT_EQ(history.size(), 2U);
  EXPECT_EQ(row_of(history, 0), (std::vector{1.0, -1.0}));
  EXPECT_EQ(row_of(history, 1), (std::vector{2.0, -2.0}));
  for (const double n : {3.0, 4.0}) history.record(std::array{n, -n});
  EXPECT_EQ(history.size(), 3U);
  EXPECT_EQ(row_of(history, 0), (std::vector{2.0, -2.0}));
  EXPECT_EQ(row_of(history, 2), (std::vector{4.0, -4.0}));
}

RC_GTEST_PROP(History, HoldsTheNewestRowsForAnySize, ()) {
  const auto rows = *rc::gen::inRange<std::size_t>(1, 9);
  const auto recorded = *rc::gen::inRange<std::size_t>(0, 40);
  History history(rows, 1);
  for (std::size_t n = 0; n < recorded; ++n) history.record(std::array{static_cast<double>(n)});
  RC_ASSERT(history.size() == std::min(rows, recorded));
  for (std::size_t k = 0; k < history.size(); ++k)
    RC_ASSERT(history.row(k)[0] == static_cast<double>(recorded - history.size() + k));
}

TEST(History, IgnoresRowsOfAnotherSize) {
  History history(3, 2);
  history.record(std::array{1.0});
  history.record(std::array{1.0, 2.0, 3.0});
  history.record({});
  EXPECT_EQ(history.size(), 0U);
}

TEST(History, KeepsWhatIsRecordedFromAFreezeToAReset) {
  History history(2, 1);
  history.record(std::array{1.0});
  EXPECT_FALSE(history.is_frozen());
  history.freeze();
  EXPECT_TRUE(history.is_frozen());
  history.record(std::array{2.0});
  EXPECT_EQ(history.size(), 1U);
  EXPECT_EQ(row_of(history, 0), std::vector{1.0});
  history.reset();
  EXPECT_FALSE(history.is_frozen());
  EXPECT_EQ(history.size(), 0U);
  for (const double n : {3.0, 4.0, 5.0}) history.record(std::array{n});
  EXPECT_EQ(row_of(history, 0), std::vector{4.0});
  history.reset();
  for (const double n : {6.0, 7.0}) history.record(std::array{n});
  EXPECT_EQ(row_of(history, 0), std::vector{6.0}) << "begins with the first row again";
}

TEST(History, RefusesSizesThatAreNone) {
  const auto refusal = [](std::size_t rows, std::size_t columns) {
    return test::error_message([&] { const History history(rows, columns); });
  };
  EXPECT_EQ(refusal(0, 1),
            "history: expected rows and columns of at most 10000000 numbers, found 0 rows, 1 "
            "columns");
  EXPECT_NE(refusal(1, 0), "");
  EXPECT_EQ(refusal(1'000'000, 10), "");
  EXPECT_NE(refusal(1'000'001, 10), "");
  EXPECT_NE(refusal(std::size_t{1} << 63U, 4), "");
}

}  // namespace
}  // namespace torsio

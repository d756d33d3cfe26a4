#include "torsio/core/error.hpp"

#include <gtest/gtest.h>

namespace torsio {
namespace {

TEST(Error, StatesPlaceExpectedFoundAndAdvice) {
  const Error error({.place = "a.csv: line 3",
                     .expected = "4 cells",
                     .found = "3",
                     .advice = "Add the missing cell."});
  EXPECT_STREQ(error.what(), "a.csv: line 3: expected 4 cells, found 3\n  Add the missing cell.");
}

TEST(Error, LeavesOutWhatIsUnknown) {
  EXPECT_STREQ(Error({.problem = "no samples"}).what(), "no samples");
  EXPECT_STREQ(Error({.place = "x", .problem = "bad", .found = "7"}).what(), "x: bad; found 7");
}

}  // namespace
}  // namespace torsio

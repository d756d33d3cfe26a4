#include "core/cells.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstddef>
#include <limits>
#include <vector>

namespace torsio::detail {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// Knots, values between and beyond them, and what is not a number.
struct Knots {
  std::vector<double> knots{-2.0, -1.0, 0.5, 0.75, 3.0};
  std::vector<double> values{-kInfinity, -5.0, -2.0, -1.5, -1.0, 0.0,      0.5,
                             0.6,        0.75, 1.0,  3.0,  9.0,  kInfinity};
};

TEST(CellOf, IsTheSameFromEveryCellToLookAtFirst) {
  const Knots k;
  for (const double x : k.values) {
    std::size_t expected = 0;  // by counting
    for (std::size_t i = 1; i + 1 < k.knots.size(); ++i) expected += x >= k.knots[i] ? 1 : 0;
    for (std::size_t near = 0; near + 1 < k.knots.size(); ++near)
      EXPECT_EQ(cell_of(k.knots, x, near), expected) << x << " from " << near;
  }
}

TEST(CellOf, OfNaNIsACell) {
  const Knots k;
  for (std::size_t near = 0; near + 1 < k.knots.size(); ++near)
    EXPECT_LT(cell_of(k.knots, std::nan(""), near), k.knots.size() - 1);
  EXPECT_EQ(cell_of(std::vector{0.0, 1.0}, std::nan(""), 0), 0U);
}

}  // namespace
}  // namespace torsio::detail

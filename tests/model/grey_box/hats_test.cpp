#include "model/grey_box/hats.hpp"

#include <gtest/gtest.h>

#include <vector>

namespace torsio::detail {
namespace {

TEST(HatCell, ReproducesTheValueBetweenAndBeyondTheKnots) {
  const std::vector<double> knots{-2.0, -1.0, 0.5, 0.75, 3.0};
  for (const double x : {-3.0, -2.0, -1.2, 0.0, 0.7, 2.9, 4.0}) {
    const HatCell<double> cell = hat_cell(knots, x);
    EXPECT_NEAR((1.0 - cell.share) * knots[cell.left] + cell.share * knots[cell.left + 1], x,
                1e-14);
  }
}

}  // namespace
}  // namespace torsio::detail

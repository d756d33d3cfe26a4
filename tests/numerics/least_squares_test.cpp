#include "numerics/least_squares.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstddef>
#include <vector>

#include "support/error_message.hpp"
#include "torsio/core/random.hpp"

namespace torsio {
namespace {

/// Columns of very different size, one of which is the sum of two others and one 0.
Matrix uneven_design(std::size_t rows) {
  Random random(4);
  Matrix design(rows, 6);
  for (std::size_t n = 0; n < rows; ++n) {
    design(n, 0) = 1.0;
    design(n, 1) = 1e-4 * random.normal();
    design(n, 2) = 1e5 * (1.0 + 0.01 * random.normal());
    design(n, 3) = design(n, 1) + design(n, 2);
    design(n, 5) = random.normal();
  }
  return design;
}

LeastSquares streamed(const Matrix& design, const std::vector<double>& target,
                      std::size_t block_rows) {
  StreamedLeastSquares equations(design.columns, block_rows);
  for (std::size_t n = 0; n < design.rows; ++n) equations.add(design.row(n), target[n]);
  return equations.solve();
}

TEST(StreamedLeastSquares, EqualTheCompleteOnesForBlocksOfAnySize) {
  const Matrix design = uneven_design(1000);
  Random random(5);
  std::vector<double> target;
  for (std::size_t n = 0; n < design.rows; ++n)
    target.push_back(3.0 + 2e4 * design(n, 1) - 1e-4 * design(n, 2) + 0.5 * design(n, 5) +
                     0.1 * random.normal());
  const LeastSquares complete = least_squares(design, target);
  EXPECT_EQ(complete.dropped, (std::vector<std::size_t>{4, 3}));
  for (const std::size_t block_rows : {1, 2, 7, 64, 999, 1000, 5000}) {
    SCOPED_TRACE(block_rows);
    const LeastSquares blocks = streamed(design, target, block_rows);
    EXPECT_EQ(blocks.dropped, complete.dropped);
    for (std::size_t j = 0; j < design.columns; ++j)
      EXPECT_NEAR(blocks.coefficients[j], complete.coefficients[j],
                  1e-9 * std::abs(complete.coefficients[j]));
  }
}

TEST(StreamedLeastSquares, RefuseFewerSamplesThanCoefficients) {
  Random random(6);
  Matrix design(3, 4);
  for (double& value : design.values) value = random.normal();
  const std::vector<double> target(3, 1.0);
  const auto complete = test::error_message([&] { (void)least_squares(design, target); });
  EXPECT_EQ(test::error_message([&] { (void)streamed(design, target, 2); }), complete);
  EXPECT_FALSE(complete.empty());
}

}  // namespace
}  // namespace torsio

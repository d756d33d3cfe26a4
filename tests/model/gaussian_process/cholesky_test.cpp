#include "model/gaussian_process/cholesky.hpp"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <vector>

#include "model/gaussian_process/double_gemm.hpp"
#include "support/each_instruction_set.hpp"
#include "support/numbers.hpp"
#include "torsio/core/random.hpp"

namespace torsio {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using test::kNaN;

MatrixXd random_matrix(Index rows, Index columns, std::uint64_t seed) {
  Random random(seed);
  return MatrixXd::NullaryExpr(rows, columns, [&] { return random.normal(); });
}

/// Its lower triangle; above it NaN, which must not be read.
SquareMatrix lower_of(const MatrixXd& matrix) {
  SquareMatrix lower(static_cast<std::size_t>(matrix.rows()));
  for (std::size_t i = 0; i < lower.size(); ++i)
    for (std::size_t j = 0; j < lower.size(); ++j)
      lower(i, j) = j <= i ? matrix(static_cast<Index>(i), static_cast<Index>(j)) : kNaN;
  return lower;
}

MatrixXd lower_triangle(const SquareMatrix& matrix) {
  const auto size = static_cast<Index>(matrix.size());
  MatrixXd lower = MatrixXd::Zero(size, size);
  for (Index i = 0; i < size; ++i)
    for (Index j = 0; j <= i; ++j)
      lower(i, j) = matrix(static_cast<std::size_t>(i), static_cast<std::size_t>(j));
  return lower;
}

MatrixXd positive_definite(Index size) {
  const MatrixXd root = random_matrix(size, size + 3, 7);
  return root * root.transpose() / static_cast<double>(size) + MatrixXd::Identity(size, size);
}

TEST(Cholesky, FactorisesSolvesAndInvertsAnySize) {
  test::on_each_instruction_set([](const char* name) {
    SCOPED_TRACE(name);
    for (const Index size : {1, 2, 7, 47, 48, 49, 95, 96, 97, 150, 333}) {
      SCOPED_TRACE(size);
      const MatrixXd a = positive_definite(size);
      SquareMatrix factor = lower_of(a);
      ASSERT_TRUE(cholesky(factor));
      const MatrixXd l = lower_triangle(factor);
      EXPECT_LT((l * l.transpose() - a).cwiseAbs().maxCoeff(), 1e-13 * a.norm());
      EXPECT_NEAR(log_determinant(factor), 2.0 * a.llt().matrixLLT().diagonal().array().log().sum(),
                  1e-10);
      const Eigen::VectorXd b = random_matrix(size, 1, 8);
      std::vector<double> x(b.begin(), b.end());
      solve(factor, x);
      const Eigen::VectorXd found = Eigen::Map<Eigen::VectorXd>(x.data(), size);
      EXPECT_LT((a * found - b).cwiseAbs().maxCoeff(), 1e-12);
      invert(factor);
      const MatrixXd inverse = lower_triangle(factor).selfadjointView<Eigen::Lower>();
      EXPECT_LT((a * inverse - MatrixXd::Identity(size, size)).cwiseAbs().maxCoeff(), 1e-12);
    }
  });
}

TEST(Cholesky, RefusesWhatIsNotPositiveDefinite) {
  for (const Index size : {1, 40, 130}) {
    for (const double spoilt : {-1.0, 0.0, kNaN, HUGE_VAL}) {
      SquareMatrix matrix = lower_of(positive_definite(size));
      matrix(matrix.size() - 1, matrix.size() - 1) = spoilt;
      EXPECT_FALSE(cholesky(matrix)) << size << ", " << spoilt;
    }
  }
}

TEST(DoubleGemm, MultipliesAnyShapeAnyWayRound) {
  test::on_each_instruction_set([](const char* name) {
    SCOPED_TRACE(name);
    double_gemm::Scratch scratch;
    for (const Index rows : {1, 5, 8, 100})
      for (const Index columns : {1, 23, 24, 500})
        for (const Index depth : {1, 3, 192, 401}) {
          const MatrixXd a = random_matrix(rows, depth, 1);     // column-major
          const MatrixXd b = random_matrix(columns, depth, 2);  // its transpose is row-major
          const double_gemm::Factor left{a.data(), 1, static_cast<std::size_t>(rows)};
          const double_gemm::Factor right{b.data(), static_cast<std::size_t>(columns), 1};
          const MatrixXd product = a * b.transpose();
          for (const auto mode :
               {double_gemm::Mode::set, double_gemm::Mode::add, double_gemm::Mode::subtract}) {
            using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
            RowMajor c = RowMajor::Constant(rows, columns, 2.0);
            double_gemm::multiply(
                left, right, static_cast<std::size_t>(depth), mode,
                {c.data(), static_cast<std::size_t>(columns), static_cast<std::size_t>(rows),
                 static_cast<std::size_t>(columns)},
                false, scratch);
            MatrixXd expected = product;
            if (mode == double_gemm::Mode::add) expected = product.array() + 2.0;
            if (mode == double_gemm::Mode::subtract) expected = 2.0 - product.array();
            EXPECT_LT((c - expected).cwiseAbs().maxCoeff(), 1e-11)
                << rows << " x " << columns << ", depth " << depth;
          }
        }
  });
}

}  // namespace
}  // namespace torsio

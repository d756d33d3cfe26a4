#include "torsio/signal/normaliser.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "signal/fit_normaliser.hpp"
#include "support/numbers.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/random.hpp"

namespace torsio {
namespace {

using test::kNaN;

Matrix noise(std::size_t rows, std::size_t columns) {
  Matrix data(rows, columns);
  Random random(11);
  for (std::size_t i = 0; i < rows; ++i)
    for (std::size_t j = 0; j < columns; ++j)
      data(i, j) =
          100.0 * static_cast<double>(j) + std::exp2(static_cast<double>(j)) * random.normal();
  return data;
}

TEST(Normaliser, GivesEveryChannelZeroMeanAndUnitDeviation) {
  const Matrix data = noise(2000, 3);
  const Normaliser normaliser = fit_normaliser(data);
  std::array<double, 3> mean{};
  std::array<double, 3> square{};
  for (std::size_t i = 0; i < data.rows; ++i) {
    std::array<double, 3> scaled{};
    normaliser.apply(data.row(i), scaled);
    for (std::size_t j = 0; j < 3; ++j) {
      mean[j] += scaled[j] / 2000.0;
      square[j] += scaled[j] * scaled[j] / 2000.0;
    }
  }
  for (std::size_t j = 0; j < 3; ++j) {
    EXPECT_NEAR(mean[j], 0.0, 1e-12);
    EXPECT_NEAR(square[j], 1.0, 1e-12);
  }
}

TEST(Normaliser, IsUndoneByItsInverseInPlace) {
  const Matrix data = noise(50, 4);
  const Normaliser normaliser = fit_normaliser(data);
  for (std::size_t i = 0; i < data.rows; ++i) {
    std::array<double, 4> values{};
    normaliser.apply(data.row(i), values);
    normaliser.undo(values, values);
    for (std::size_t j = 0; j < 4; ++j) EXPECT_NEAR(values[j], data(i, j), 1e-11);
  }
}

TEST(Normaliser, DoesNotBlowUpChannelsThatHardlyMove) {
  Matrix data(1000, 2, 0.1);  // the mean of a thousand tenths is not exactly a tenth
  EXPECT_EQ(fit_normaliser(data).parameters().scale, (std::vector<double>{1.0, 1.0}));
  data(0, 1) = 0.2;
  const std::array<double, 2> floors{0.5, 0.01};
  EXPECT_EQ(fit_normaliser(data, floors).parameters().scale, (std::vector<double>{0.5, 0.01}));
}

TEST(Normaliser, RefusesWhatCannotBeScaled) {
  EXPECT_THROW(Normaliser({.centre = {0.0}, .scale = {}}), UsageError);
  EXPECT_THROW(Normaliser({.centre = {0.0}, .scale = {0.0}}), UsageError);
  EXPECT_THROW(Normaliser({.centre = {0.0}, .scale = {-1.0}}), UsageError);
  EXPECT_THROW(Normaliser({.centre = {kNaN}, .scale = {1.0}}), UsageError);
  EXPECT_THROW((void)fit_normaliser(Matrix(0, 2)), UsageError);
  EXPECT_THROW((void)fit_normaliser(Matrix(3, 1, kNaN)), UsageError);
  const std::array<double, 1> floors{0.5};
  EXPECT_THROW((void)fit_normaliser(Matrix(3, 2), floors), UsageError);
}

}  // namespace
}  // namespace torsio
